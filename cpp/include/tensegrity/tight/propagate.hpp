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

  // Endcaps by their velocities: columns, and rows from the diagonal on.
  auto& p = belief.covariance;
  add_columns(p, B::kEndcaps, B::kRates, 12, dt, packet_start(B::kEndcaps));
  for (int j = 0; j < B::kRates; ++j) {
    p.col(j).template segment<12>(B::kEndcaps) += dt * p.col(j).template segment<12>(B::kRates);
  }
  inekf::fall_and_move(p, gravity * dt, dt, B::Dim);
  inekf::SensorErrors<Scalar, B::Dim> errors(body, noise.gyro, noise.accel);
  for (int c = 2; c < B::kColumns; ++c) {
    errors.set_group(B::column_index(c), body.column_by_gyro(Packet<Scalar>(x.col(c))));
  }
  errors.apply(p, B::kGround, B::Dim);

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
  mirror(p, 0, B::kComplete);
}

}  // namespace tensegrity::tight
