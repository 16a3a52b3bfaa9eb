// One IMU sample: the base rod by strapdown integration (as in inekf/propagate.hpp, exact for a
// constant rate and specific force in the body), the other rods by inertia.
//
// Endcaps 2 .. 5 move with constant velocity, driven by white acceleration. F is never formed: it
// acts on the columns of P, the result is transposed, and F acts once more.
#pragma once

#include "tensegrity/inekf/propagate.hpp"
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
  using V3 = Vector3<Scalar>;
  using M3 = Matrix3<Scalar>;
  const V3 w = imu.gyro - belief.gyro_bias;
  const V3 a = imu.accel - belief.accel_bias;
  const V3 g(0, 0, -gravity);
  const Gamma<Scalar> gamma(w * dt);
  const Scalar dt2 = dt * dt;

  // ---- mean
  const M3 start = belief.rotation;
  const M3 mean_rotation = start * gamma.g1;
  auto& x = belief.columns;
  x.col(1) += x.col(0) * dt + start * (gamma.g2 * a) * dt2 + g * (dt2 / 2);
  x.col(0) += mean_rotation * a * dt + g * dt;
  x.template middleCols<4>(2) += dt * x.template middleCols<4>(6);
  belief.rotation = orthonormalized<Scalar>(start * gamma.g0);
  belief.rate = w;

  // ---- transition. Every column c of the group sees an error of the gyro's bias through the
  // rotation: xi_c+ = ... - hat(c) int R zeta_g; v and p have their own integrals besides
  // (inekf/propagate.hpp derives them).
  const M3 int_r = mean_rotation * dt;
  const M3 gx = hat(g) * dt;
  std::array<M3, B::kColumns> gyro_to;
  for (int c = 0; c < B::kColumns; ++c) gyro_to[std::size_t(c)] = -hat(x.col(c)) * int_r;
  gyro_to[0] -= dt2 * start * gamma.g1_derivative(a);
  gyro_to[1] -= dt2 * dt * start * gamma.g2_derivative(a);
  const M3 accel_to_position = -dt2 * (start * gamma.g2);

  auto& p = belief.covariance;
  // Rows `to` of F P get m times rows `from`; where a row is both, it is a target last.
  struct Term {
    int to, from;
    M3 m;
  };
  std::array<Term, 15> terms;
  std::size_t count = 0;
  const auto add = [&](int to, int from, const M3& m) { terms[count++] = {to, from, m}; };
  add(B::kPosition, B::kRotation, gx * (dt / 2));
  add(B::kPosition, B::kGyroBias, gyro_to[1]);
  add(B::kPosition, B::kAccelBias, accel_to_position);
  add(B::kVelocity, B::kRotation, gx);
  add(B::kVelocity, B::kGyroBias, gyro_to[0]);
  add(B::kVelocity, B::kAccelBias, -int_r);
  for (int c = 2; c < B::kColumns; ++c) {
    add(B::column_index(c), B::kGyroBias, gyro_to[std::size_t(c)]);
  }
  add(B::kRotation, B::kGyroBias, -int_r);
  for (int side = 0; side < 2; ++side) {
    p.template middleCols<3>(B::kPosition) += dt * p.template middleCols<3>(B::kVelocity);
    p.template middleCols<12>(B::kEndcaps) += dt * p.template middleCols<12>(B::kRates);
    for (const Term& term : terms) {
      Scalar* target = p.col(term.to).data();
      const Scalar* source = p.col(term.from).data();
      const M3& m = term.m;
      for (int i = 0; i < B::Dim; ++i) {  // three columns from three: what is loaded is used thrice
        const Scalar a0 = source[i], a1 = source[i + B::Dim], a2 = source[i + 2 * B::Dim];
        target[i] += m(0, 0) * a0 + m(0, 1) * a1 + m(0, 2) * a2;
        target[i + B::Dim] += m(1, 0) * a0 + m(1, 1) * a1 + m(1, 2) * a2;
        target[i + 2 * B::Dim] += m(2, 0) * a0 + m(2, 1) * a1 + m(2, 2) * a2;
      }
    }
    p.transposeInPlace();
  }

  // ---- noise. That of the gyro enters every column like its bias, L = (I, hat(c) ...).
  const Scalar gyro = noise.gyro * dt;
  Matrix<Scalar, B::Dim, 3> l = Matrix<Scalar, B::Dim, 3>::Zero();
  l.template middleRows<3>(B::kRotation) = gyro * M3::Identity();
  for (int c = 0; c < B::kColumns; ++c) {
    l.template middleRows<3>(B::column_index(c)) = gyro * hat(x.col(c));
  }
  for (int j = 0; j < B::kOffsets; ++j) {
    p.col(j) += l(j, 0) * l.col(0) + l(j, 1) * l.col(1) + l(j, 2) * l.col(2);
  }
  // Rounding made the triangles differ.
  p.template triangularView<Eigen::StrictlyUpper>() = p.transpose();

  const auto walk = [&](int at, int size, Scalar std) {
    p.diagonal().segment(at, size).array() += std * std * dt;
  };
  // White acceleration, integrated once and twice.
  const auto accelerate = [&](int velocity, int position, int size, Scalar density) {
    for (int k = 0; k < size; ++k) {
      p(velocity + k, velocity + k) += density * dt;
      p(position + k, position + k) += density * dt * dt2 / 3;
      p(velocity + k, position + k) += density * dt2 / 2;
      p(position + k, velocity + k) += density * dt2 / 2;
    }
  };
  accelerate(B::kVelocity, B::kPosition, 3, noise.accel * noise.accel * dt);
  accelerate(B::kRates, B::kEndcaps, 12, noise.endcap_acceleration * noise.endcap_acceleration);
  walk(B::kGyroBias, 3, noise.gyro_bias);
  walk(B::kAccelBias, 3, noise.accel_bias);
  walk(B::kGround, 1, noise.ground_height);
  // The slope changes about where the robot is: z = m_0 + m_1 x + m_2 y stays there.
  Matrix<Scalar, 3, 2> tilt;
  tilt << -x(0, 1), -x(1, 1), 1, 0, 0, 1;
  p.template block<3, 3>(B::kGround, B::kGround) +=
      (noise.ground_slope * noise.ground_slope * dt) * tilt.lazyProduct(tilt.transpose());
}

}  // namespace tensegrity::tight
