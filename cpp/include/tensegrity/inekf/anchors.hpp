// Contact points enter and leave the state (T eqs. 9, 10).
#pragma once

#include "tensegrity/inekf/belief.hpp"

namespace tensegrity::inekf {

// Appends the anchor d = p + R h of endcap `id`.
//   h: endcap centre in the body frame [m]
//   h_extra: dh/d(extra), 3 x Extra, body frame
//   h_covariance: covariance of h, body frame [m^2]
// Returns false, changing nothing, when the capacity is used up or the endcap has an anchor.
template <typename B, typename Scalar = typename B::Scalar>
bool augment(B& belief, int id, const Vector3<Scalar>& h,
             const Matrix<Scalar, 3, B::Extra>& h_extra, const Matrix3<Scalar>& h_covariance) {
  if (belief.anchor_count == B::MaxAnchors || belief.find(id) >= 0) return false;
  belief.complete();
  auto& p = belief.covariance;
  const int n = belief.dim();
  const int at = B::anchor_index(belief.anchor_count);
  const Matrix3<Scalar>& r = belief.rotation;
  // xi_d = xi_p + R dh/d(extra) zeta_extra + R n_h
  const Matrix<Scalar, 3, B::Extra> f = r * h_extra;
  p.template middleRows<3>(at).leftCols(n) = p.template middleRows<3>(B::kPosition).leftCols(n);
  p.template middleRows<3>(at).leftCols(n) +=
      f * p.template middleRows<B::Extra>(B::kExtra).leftCols(n);
  p.template middleCols<3>(at).topRows(n) = p.template middleRows<3>(at).leftCols(n).transpose();
  // Times F^T once more, now on the new row.
  const Matrix3<Scalar> own = p.template block<3, 3>(at, B::kPosition) +
                              p.template block<3, B::Extra>(at, B::kExtra) * f.transpose() +
                              r * h_covariance * r.transpose();
  p.template block<3, 3>(at, at) = (own + own.transpose()) / 2;
  belief.anchors.col(belief.anchor_count) = belief.position + r * h;
  belief.anchor_ids[std::size_t(belief.anchor_count)] = id;
  ++belief.anchor_count;
  return true;
}

// Drops the anchor in `slot`; later slots move down, their order stays.
template <typename B>
void marginalise(B& belief, int slot) {
  auto& p = belief.covariance;
  const int n = belief.dim();
  const int at = B::anchor_index(slot);
  for (int i = at; i + 3 < n; ++i) p.row(i).head(n) = p.row(i + 3).head(n);
  for (int j = at; j + 3 < n; ++j) p.col(j).head(n) = p.col(j + 3).head(n);
  p.template middleRows<3>(n - 3).setZero();
  p.template middleCols<3>(n - 3).setZero();
  for (int i = slot; i + 1 < belief.anchor_count; ++i) {
    belief.anchors.col(i) = belief.anchors.col(i + 1);
    belief.anchor_ids[std::size_t(i)] = belief.anchor_ids[std::size_t(i + 1)];
  }
  --belief.anchor_count;
}

}  // namespace tensegrity::inekf
