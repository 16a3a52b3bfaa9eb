// Forward kinematics as a measurement (T eq. 11): an anchored endcap is where the shape says.
//
// The residual of endcap i is z_i = R h_i + p - d_i, with h_i its centre in the body frame. In the
// right-invariant error it is linear without approximation in the group part (T eq. 12):
//   z_i = xi_p - xi_di + R (dh_i/d extra) zeta_extra + R n_i.
#pragma once

#include <type_traits>

#include "tensegrity/inekf/correct.hpp"

namespace tensegrity::inekf {

// Endcap positions of up to `N` endcaps in the body frame as the shape reconstruction gives them.
// Their errors are independent ones of the same variance, and, where they are known, those of the
// shape as a whole.
template <typename Scalar, int N, int Extra>
struct Kinematics {
  Matrix<Scalar, 3, N> h;                         // endcap centres, body [m]
  Matrix<Scalar, 3 * N, Extra> h_extra;           // dh/d(extra), body
  Scalar variance = 0;                            // of independent errors [m^2]
  bool correlated = false;                        // is `shape_covariance` set?
  Matrix<Scalar, 3 * N, 3 * N> shape_covariance;  // joint covariance of h, body [m^2]

  // Joint covariance of endcaps i and j [m^2].
  Matrix3<Scalar> covariance(int i, int j) const {
    Matrix3<Scalar> m = Matrix3<Scalar>::Zero();
    if (correlated) m = shape_covariance.template block<3, 3>(3 * i, 3 * j);
    if (i == j) m.diagonal().array() += variance;
    return m;
  }
  // Of all endcaps [m^2].
  Matrix<Scalar, 3 * N> joint_covariance() const {
    Matrix<Scalar, 3 * N> m = Matrix<Scalar, 3 * N>::Zero();
    if (correlated) m = shape_covariance;
    m.diagonal().array() += variance;
    return m;
  }
};

// All anchored endcaps in one measurement: their errors are correlated through the shape.
// `Contacts` is the belief's anchor_count; its covariance is read by whole columns, i.e. complete.
template <int Contacts, typename B, int N, typename Scalar = typename B::Scalar>
void contact_innovation(const B& belief, const Kinematics<Scalar, N, B::Extra>& k,
                        Innovation<B, 3 * Contacts, Contacts>& z) {
  using M3 = Matrix3<Scalar>;
  constexpr int kRows = 3 * Contacts, kStates = Innovation<B, kRows, Contacts>::kStates;
  const M3& r = belief.rotation;
  const auto& p = belief.covariance;

  Vector<Scalar, kRows> residual;
  Matrix<Scalar, padded(kRows), B::Extra> f;  // R dh/d(extra)
  for (int i = 0; i < Contacts; ++i) {
    const int id = belief.anchor_ids[std::size_t(i)];
    residual.template segment<3>(3 * i) = r * k.h.col(id) + belief.position - belief.anchors.col(i);
    f.template middleRows<3>(3 * i) = r * k.h_extra.template middleRows<3>(3 * id);
  }
  for (int row = kRows; row < padded(kRows); ++row) f.row(row).setZero();

  // Column by column of H': P H', and of that what H sees again.
  for (int i = 0; i < Contacts; ++i) {
    for (int c = 0; c < 3; ++c) {
      const int column = 3 * i + c;
      Scalar* cross = z.system.column(column) + z.system.kBelow;
      Sum<Scalar, kStates, 2 + B::Extra> sum;
      sum.add(Scalar(1), &p(0, B::kPosition + c));
      sum.add(Scalar(-1), &p(0, B::anchor_index(i) + c));
      for (int e = 0; e < B::Extra; ++e) sum.add(f(column, e), &p(0, B::kExtra + e));
      sum.store(cross);
      const Scalar* seen = cross + B::kPosition;
      for (int row = packet_start(column); row < kRows; row += 4) {
        Packet<Scalar> s(seen[row % 3], seen[(row + 1) % 3], seen[(row + 2) % 3], seen[row % 3]);
        s.subtract(Scalar(1), Packet<Scalar>(cross + B::kAnchors + row));
        for (int e = 0; e < B::Extra; ++e) {
          s.add(cross[B::kExtra + e], Packet<Scalar>(&f(row, e)));
        }
        s.store(z.system.column(column) + row);
      }
      z.covariance()(column, column) += k.variance;
    }
  }
  z.set_residual(residual);
  if (!k.correlated) return;
  for (int i = 0; i < Contacts; ++i) {
    const int a = 3 * belief.anchor_ids[std::size_t(i)];
    for (int j = 0; j <= i; ++j) {
      const M3 noise =
          k.shape_covariance.template block<3, 3>(a, 3 * belief.anchor_ids[std::size_t(j)]);
      z.covariance().template block<3, 3>(3 * i, 3 * j) +=
          r.lazyProduct(noise.lazyProduct(r.transpose()).eval());
    }
  }
}

// Corrects with all anchored endcaps, whose number becomes a size here. `gate`: chi-square beyond
// which nothing happens (0: none).
template <int Contacts = 1, typename B, int N, typename Scalar = typename B::Scalar>
Correction<Scalar> correct_contacts(B& belief, const Kinematics<Scalar, N, B::Extra>& k,
                                    Scalar gate) {
  if (belief.anchor_count == Contacts) {
    Innovation<B, 3 * Contacts, Contacts> z;
    belief.complete();
    contact_innovation(belief, k, z);
    return correct(belief, z, gate);
  }
  if constexpr (Contacts < B::MaxAnchors) return correct_contacts<Contacts + 1>(belief, k, gate);
  return {};
}

}  // namespace tensegrity::inekf
