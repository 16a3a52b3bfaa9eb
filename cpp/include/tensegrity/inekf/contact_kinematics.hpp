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
template <typename Scalar, int N, int Extra>
struct Kinematics {
  Matrix<Scalar, 3, N> h;                   // endcap centres, body [m]
  Matrix<Scalar, 3 * N, Extra> h_extra;     // dh/d(extra), body
  Matrix<Scalar, 3 * N, 3 * N> covariance;  // joint covariance of h, body [m^2]
};

// All anchored endcaps in one measurement: their errors are correlated through the shape.
// `Contacts` is the belief's anchor_count.
template <int Contacts, typename B, int N, typename Scalar = typename B::Scalar>
Innovation<B, 3 * Contacts, Contacts> contact_innovation(const B& belief,
                                                         const Kinematics<Scalar, N, B::Extra>& k) {
  using M3 = Matrix3<Scalar>;
  const M3& r = belief.rotation;
  const auto& p = belief.covariance;

  Innovation<B, 3 * Contacts, Contacts> z;
  constexpr int kStates = decltype(z)::kStates;
  std::array<Matrix<Scalar, 3, B::Extra>, Contacts> f;  // R dh/d(extra)
  for (int i = 0; i < Contacts; ++i) {
    const int id = belief.anchor_ids[std::size_t(i)];
    const int at = B::anchor_index(i);
    auto& fi = f[std::size_t(i)];
    fi = r * k.h_extra.template middleRows<3>(3 * id);
    z.residual.template segment<3>(3 * i) =
        r * k.h.col(id) + belief.position - belief.anchors.col(i);
    for (int c = 0; c < 3; ++c) {
      Sum<Scalar, kStates, 2 + B::Extra> cross;
      cross.add(Scalar(1), &p(0, B::kPosition + c));
      cross.add(Scalar(-1), &p(0, at + c));
      for (int e = 0; e < B::Extra; ++e) cross.add(fi(c, e), &p(0, B::kExtra + e));
      cross.store(&z.cross(0, 3 * i + c));
    }
  }
  for (int i = 0; i < Contacts; ++i) {
    const int a = 3 * belief.anchor_ids[std::size_t(i)];
    const auto& fi = f[std::size_t(i)];
    for (int j = 0; j <= i; ++j) {
      const M3 noise = k.covariance.template block<3, 3>(a, 3 * belief.anchor_ids[std::size_t(j)]);
      const M3 turned = r.lazyProduct(noise.lazyProduct(r.transpose()).eval());
      for (int c = 0; c < 3; ++c) {
        const auto seen = z.cross.col(3 * j + c);
        for (int row = 0; row < 3; ++row) {
          Scalar sum = turned(row, c) + seen[B::kPosition + row] - seen[B::anchor_index(i) + row];
          for (int e = 0; e < B::Extra; ++e) sum += fi(row, e) * seen[B::kExtra + e];
          z.covariance(3 * i + row, 3 * j + c) = sum;
        }
      }
    }
  }
  return z;
}

// Corrects with all anchored endcaps, whose number becomes a size here. `gate`: chi-square beyond
// which nothing happens (0: none).
template <int Contacts = 1, typename B, int N, typename Scalar = typename B::Scalar>
Correction<Scalar> correct_contacts(B& belief, const Kinematics<Scalar, N, B::Extra>& k,
                                    Scalar gate) {
  if (belief.anchor_count == Contacts) {
    return correct(belief, contact_innovation<Contacts>(belief, k), gate);
  }
  if constexpr (Contacts < B::MaxAnchors) return correct_contacts<Contacts + 1>(belief, k, gate);
  return {};
}

}  // namespace tensegrity::inekf
