// Fresh uncertainty: endcaps put where a shape says, at the start and after losing them, and a
// velocity that is not believed any more.
#pragma once

#include "tensegrity/tight/belief.hpp"

namespace tensegrity::tight {

// Adds an independent spin of the other rods about the base rod, of `std` [rad], to what is
// unknown.
template <typename Scalar>
void widen_spin(Belief<Scalar>& belief, Scalar std) {
  using B = Belief<Scalar>;
  Vector<Scalar, 12> turn;
  for (int i = 2; i < 6; ++i) {
    turn.template segment<3>(3 * (i - 2)) =
        std * belief.rotation.col(2).cross(belief.endcap(i) - belief.position());
  }
  belief.covariance.template block<12, 12>(B::kEndcaps, B::kEndcaps) +=
      turn.lazyProduct(turn.transpose());
}

// Replaces endcaps 2 .. 5 and their velocities by those of the rigid shape `h` (body [m]). Their
// errors become those of the base rod plus, independent of everything else, `position_std` [m] of
// each endcap, `spin_std` [rad] of the shape about the base rod, and `rate_std` [m/s].
template <typename Scalar>
void place_endcaps(Belief<Scalar>& belief, const Endcaps<Scalar>& h, Scalar position_std,
                   Scalar spin_std, Scalar rate_std) {
  using B = Belief<Scalar>;
  using V3 = Vector3<Scalar>;
  using M3 = Matrix3<Scalar>;
  const M3& rotation = belief.rotation;
  std::array<M3, 4> gyro_to;  // xi_w = xi_v + R hat(h) zeta_g
  for (int i = 2; i < 6; ++i) {
    belief.columns.col(i) = belief.position() + rotation * h.col(i);
    belief.columns.col(i + 4) = belief.velocity() + rotation * belief.rate.cross(V3(h.col(i)));
    gyro_to[std::size_t(i - 2)] = rotation * hat(h.col(i));
  }
  belief.complete();
  auto& p = belief.covariance;
  // Rows of the endcaps from those of the base rod, then the same for their columns.
  const auto derive = [&](auto&& m) {
    for (int i = 2; i < 6; ++i) {
      m.template middleRows<3>(B::endcap_index(i)) = m.template middleRows<3>(B::kPosition);
      m.template middleRows<3>(B::endcap_velocity_index(i)) =
          m.template middleRows<3>(B::kVelocity);
      m.template middleRows<3>(B::endcap_velocity_index(i)) +=
          gyro_to[std::size_t(i - 2)].lazyProduct(m.template middleRows<3>(B::kGyroBias));
    }
  };
  derive(p);
  derive(p.transpose());
  widen_spin(belief, spin_std);
  p.diagonal().template segment<12>(B::kEndcaps).array() += position_std * position_std;
  p.diagonal().template segment<12>(B::kRates).array() += rate_std * rate_std;
}

// Adds an independent velocity of the whole robot, of `std` [m/s] per axis, to what is unknown.
template <typename Scalar>
void widen_velocity(Belief<Scalar>& belief, Scalar std) {
  using B = Belief<Scalar>;
  constexpr std::array<int, 5> kMoving = {B::kVelocity, B::kRates, B::kRates + 3, B::kRates + 6,
                                          B::kRates + 9};
  for (const int i : kMoving) {
    for (const int j : kMoving) {
      belief.covariance.template block<3, 3>(i, j).diagonal().array() += std * std;
    }
  }
}

}  // namespace tensegrity::tight
