// One IMU sample: the base rod by strapdown integration, the other rods by inertia.
//
// Endcaps 2 .. 5 move with constant velocity, driven by white acceleration.
#pragma once

#include "tensegrity/inekf/transition.hpp"
#include "tensegrity/tight/belief.hpp"

namespace tensegrity::tight {

// Standard deviations of what drives the state.
template <typename Scalar>
struct ProcessNoise {
  Scalar gyro;                 // of one sample [rad/s]
  Scalar accel;                // of one sample [m/s^2]
  Scalar gyro_bias;            // random walk [rad/s/sqrt(s)]
  Scalar accel_bias;           // random walk [m/s^2/sqrt(s)]
  Scalar endcap_acceleration;  // white, of each endcap [m/s/sqrt(s)]
  Scalar ground_height;        // random walk [m/sqrt(s)]
  Scalar ground_slope;         // random walk [1/sqrt(s)]
};

template <typename Scalar>
void propagate(Belief<Scalar>& belief, const inekf::ImuSample<Scalar>& imu, Scalar dt,
               Scalar gravity, const ProcessNoise<Scalar>& noise) {
  using B = Belief<Scalar>;
  const inekf::ImuSample<Scalar> motion{imu.gyro - belief.gyro_bias, imu.accel - belief.accel_bias};
  auto& x = belief.columns;
  const inekf::Strapdown<Scalar> body =
      inekf::integrate(belief.rotation, x.col(0), x.col(1), motion, dt, gravity);
  x.template middleCols<4>(2) += dt * x.template middleCols<4>(6);
  belief.rate = motion.gyro;

  constexpr int kGroupEnd = padded(B::kOffsets);
  inekf::Transition<Scalar, B::Dim> transition(body, noise.gyro, noise.accel, kGroupEnd);

  // ---- P F': of the rows above the diagonal those that are read below
  auto& p = belief.covariance;
  for (int c = 2; c < B::kColumns; ++c) {
    const int at = B::column_index(c);
    if (at < B::kRates) add_columns(p, at, B::kRates + (at - B::kEndcaps), dt, B::Dim);
    transition.set_group(at, body.column_by_gyro(Packet<Scalar>(x.col(c))));
    transition.group_columns(p, at, B::Dim);
  }
  transition.body_columns(p, B::Dim);

  // ---- F (P F'): rows from the diagonal on
  for (int j = 0; j < B::kRates; ++j) {
    p.col(j).template segment<12>(B::kEndcaps) += dt * p.col(j).template segment<12>(B::kRates);
  }
  transition.all_rows(p, packet_start(B::kEndcaps), B::kOffsets);

  // ---- walks of the step
  const auto walk = [&](int at, int size, Scalar std) {
    for (int k = at; k < at + size; ++k) p(k, k) += std * std * dt;
  };
  walk(B::kGyroBias, 3, noise.gyro_bias);
  walk(B::kAccelBias, 3, noise.accel_bias);
  walk(B::kGround, 1, noise.ground_height);
  // White acceleration of endcaps, integrated once and twice.
  const Scalar density = noise.endcap_acceleration * noise.endcap_acceleration;
  for (int k = 0; k < 12; ++k) {
    p(B::kRates + k, B::kRates + k) += density * dt;
    p(B::kRates + k, B::kEndcaps + k) += density * dt * dt / 2;
    p(B::kEndcaps + k, B::kEndcaps + k) += density * dt * dt * dt / 3;
  }
  // The slope changes about where the robot is: z = m_0 + m_1 x + m_2 y stays there.
  Matrix<Scalar, 3, 2> tilt;
  tilt << -x(0, 1), -x(1, 1), 1, 0, 0, 1;
  p.template block<3, 3>(B::kGround, B::kGround) +=
      (noise.ground_slope * noise.ground_slope * dt) * tilt.lazyProduct(tilt.transpose());
  mirror(p, B::Dim);
}

}  // namespace tensegrity::tight
