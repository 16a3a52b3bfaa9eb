// One IMU sample: the base rod by strapdown integration, the other rods by inertia.
//
// Endcaps 2 .. 5 move with constant velocity, driven by white acceleration. The transition
// F = I + A is never formed: it acts on the columns of P, P F', and then on the rows of the lower
// triangle of that.
#pragma once

#include "tensegrity/inekf/strapdown.hpp"
#include "tensegrity/math/symmetric.hpp"
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
  const inekf::ImuSample<Scalar> motion{imu.gyro - belief.gyro_bias, imu.accel - belief.accel_bias};
  auto& x = belief.columns;
  const inekf::Strapdown<Scalar> body =
      inekf::integrate(belief.rotation, x.col(0), x.col(1), motion, dt, gravity);
  x.template middleCols<4>(2) += dt * x.template middleCols<4>(6);
  belief.rate = motion.gyro;

  // A, columns of the gyro's bias: every column of the group sees it through the rotation.
  Matrix<Scalar, B::Dim, 3> by_gyro = Matrix<Scalar, B::Dim, 3>::Zero();
  by_gyro.template middleRows<3>(B::kRotation) = -body.int_r;
  by_gyro.template middleRows<3>(B::kVelocity) = body.velocity_by_gyro;
  by_gyro.template middleRows<3>(B::kPosition) = body.position_by_gyro;
  for (int c = 2; c < B::kColumns; ++c) {
    by_gyro.template middleRows<3>(B::column_index(c)) = body.column_by_gyro(x.col(c));
  }

  // ---- P F': every row of it
  auto& p = belief.covariance;
  const M3& v_rotation = body.velocity_by_rotation;
  const M3 p_rotation = v_rotation * (dt / 2);
  const auto add = [&](int to, int from, const M3& m) { add_columns(p, to, from, m, B::Dim); };
  p.template middleCols<3>(B::kPosition) += dt * p.template middleCols<3>(B::kVelocity);
  p.template middleCols<12>(B::kEndcaps) += dt * p.template middleCols<12>(B::kRates);
  add(B::kPosition, B::kRotation, p_rotation);
  add(B::kPosition, B::kAccelBias, body.position_by_accel);
  add(B::kVelocity, B::kRotation, v_rotation);
  add(B::kVelocity, B::kAccelBias, -body.int_r);
  add(B::kRotation, B::kGyroBias, -body.int_r);
  for (int c = 0; c < B::kColumns; ++c) {
    const int at = B::column_index(c);
    add(at, B::kGyroBias, by_gyro.template middleRows<3>(at));
  }

  // ---- F (P F'): rows from the diagonal on. The noise of a sample is one more error of its
  // biases, which reaches column j of P F' as row j of A.
  const Scalar gyro_variance = noise.gyro * noise.gyro;
  const Scalar accel_variance = noise.accel * noise.accel;
  for (int j = 0; j < B::kOffsets; ++j) {
    auto column = p.col(j);
    const V3 r = column.template segment<3>(B::kRotation);
    const V3 v = column.template segment<3>(B::kVelocity);
    const V3 gyro =
        column.template segment<3>(B::kGyroBias) + gyro_variance * by_gyro.row(j).transpose();
    V3 accel = column.template segment<3>(B::kAccelBias);
    if (j >= B::kVelocity && j < B::kPosition) {
      accel -= accel_variance * body.int_r.row(j - B::kVelocity).transpose();
    } else if (j >= B::kPosition && j < B::kGyroBias) {
      accel += accel_variance * body.position_by_accel.row(j - B::kPosition).transpose();
    }
    if (j < B::kGyroBias) {
      column.template segment<3>(B::kVelocity) += v_rotation * r - body.int_r * accel;
      column.template segment<3>(B::kPosition) +=
          dt * v + p_rotation * r + body.position_by_accel * accel;
    }
    if (j < B::kRates) {
      column.template segment<12>(B::kEndcaps) += dt * column.template segment<12>(B::kRates);
    }
    const Scalar g0 = gyro[0], g1 = gyro[1], g2 = gyro[2];
    const Scalar *a0 = &by_gyro(0, 0), *a1 = &by_gyro(0, 1), *a2 = &by_gyro(0, 2);
    Scalar* y = &p(0, j);
    for (int i = packet_start(j); i < padded(B::kOffsets); ++i) {
      y[i] += a0[i] * g0 + a1[i] * g1 + a2[i] * g2;
    }
  }

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
