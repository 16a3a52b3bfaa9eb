// Forward kinematics as a measurement (T eq. 11): an anchored endcap is where the shape says.
//
// The residual of endcap i is z_i = R h_i + p - d_i, with h_i its centre in the body frame. In the
// right-invariant error it is linear without approximation in the group part (T eq. 12):
//   z_i = xi_p - xi_di + R (dh_i/d extra) zeta_extra + R n_i.
#pragma once

#include "tensegrity/inekf/correct.hpp"

namespace tensegrity::inekf {

// Endcap positions of up to `N` endcaps in the body frame as the shape reconstruction gives them.
template <typename Scalar, int N, int Extra>
struct Kinematics {
  Matrix<Scalar, 3, N> h;                   // endcap centres, body [m]
  Matrix<Scalar, 3 * N, Extra> h_extra;     // dh/d(extra), body
  Matrix<Scalar, 3 * N, 3 * N> covariance;  // joint covariance of h, body [m^2]
};

// All anchored endcaps in one measurement: their errors are correlated through the shape.
template <typename B, int N, typename Scalar = typename B::Scalar>
Innovation<B, 3 * B::MaxAnchors> contact_innovation(const B& belief,
                                                    const Kinematics<Scalar, N, B::Extra>& k) {
  const int n = belief.dim();
  const int contacts = belief.anchor_count;
  const Matrix3<Scalar>& r = belief.rotation;
  const auto& p = belief.covariance;

  Innovation<B, 3 * B::MaxAnchors> z;
  z.resize(n, 3 * contacts);
  std::array<Matrix<Scalar, 3, B::Extra>, B::MaxAnchors> f;  // R dh/d(extra)
  for (int i = 0; i < contacts; ++i) {
    const int id = belief.anchor_ids[i];
    const int at = B::anchor_index(i);
    f[i] = r * k.h_extra.template middleRows<3>(3 * id);
    z.residual.template segment<3>(3 * i) =
        r * k.h.col(id) + belief.position - belief.anchors.col(i);
    auto cross = z.cross.template middleCols<3>(3 * i);
    cross =
        p.template middleCols<3>(B::kPosition).topRows(n) - p.template middleCols<3>(at).topRows(n);
    cross.noalias() += p.template middleCols<B::Extra>(B::kExtra).topRows(n) * f[i].transpose();
  }
  for (int i = 0; i < contacts; ++i) {
    const int at = B::anchor_index(i);
    auto row = z.covariance.template middleRows<3>(3 * i);
    row = z.cross.template middleRows<3>(B::kPosition) - z.cross.template middleRows<3>(at);
    row.noalias() += f[i] * z.cross.template middleRows<B::Extra>(B::kExtra);
    for (int j = 0; j < contacts; ++j) {
      row.template middleCols<3>(3 * j) +=
          r *
          k.covariance.template block<3, 3>(3 * belief.anchor_ids[i], 3 * belief.anchor_ids[j]) *
          r.transpose();
    }
  }
  return z;
}

}  // namespace tensegrity::inekf
