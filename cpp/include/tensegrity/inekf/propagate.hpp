// Strapdown propagation over one IMU sample (T eqs. 4-8), discretised exactly.
//
// Angular velocity and specific force are taken as constant in the body frame over the sample.
// Mean, transition matrix and noise are then integrals of that motion; T and DRIFT hold R fixed
// over the step instead. The transition is never formed: its blocks act on the rows and then on
// the columns of P in place.
#pragma once

#include "tensegrity/inekf/belief.hpp"

namespace tensegrity::inekf {

// One sample, with the biases still in it.
template <typename Scalar>
struct ImuSample {
  Vector3<Scalar> gyro;   // mean angular velocity over the step, body [rad/s]
  Vector3<Scalar> accel;  // mean specific force over the step, body [m/s^2]
};

// Standard deviations. White noise is that of one sample, i.e. of the mean over the step.
template <typename Scalar>
struct ProcessNoise {
  Scalar gyro;        // [rad/s]
  Scalar accel;       // [m/s^2]
  Scalar gyro_bias;   // random walk [rad/s/sqrt(s)]
  Scalar accel_bias;  // random walk [m/s^2/sqrt(s)]
  Scalar anchor;      // random walk of a contact point [m/sqrt(s)]
};

// How contact points move. An endcap is a sphere of radius r that rolls without slip on horizontal
// ground: its centre moves with omega x r e_z. radius = 0 is T's static contact.
template <typename Scalar>
struct Rolling {
  Scalar radius = 0;  // [m]
};

// `extra_walk`: random walk of each extra state [unit/sqrt(s)].
template <typename B, typename Scalar = typename B::Scalar>
void propagate(B& belief, const ImuSample<Scalar>& imu, Scalar dt, Scalar gravity,
               const ProcessNoise<Scalar>& noise, const Rolling<Scalar>& rolling,
               const Vector<Scalar, B::Extra>& extra_walk) {
  using V3 = Vector3<Scalar>;
  using M3 = Matrix3<Scalar>;
  const V3 w = imu.gyro - belief.gyro_bias;
  const V3 a = imu.accel - belief.accel_bias;
  const V3 g(0, 0, -gravity);
  const V3 up = V3::UnitZ();
  const Gamma<Scalar> gamma(w * dt);

  // ---- mean: R+ = R G0, v+ = v + R G1 a dt + g dt, p+ = p + v dt + R G2 a dt^2 + g dt^2/2
  const M3 start = belief.rotation;
  const M3 mean_rotation = start * gamma.g1;  // (1/dt) integral of R over the step
  const V3 turn = start * w * dt;             // integral of R w: w is an eigenvector of Exp(w t)
  belief.position += belief.velocity * dt + start * (gamma.g2 * a) * (dt * dt) + g * (dt * dt / 2);
  belief.velocity += mean_rotation * a * dt + g * dt;
  belief.rotation = orthonormalized<Scalar>(start * gamma.g0);
  const V3 rolled = rolling.radius * turn.cross(up);
  for (int i = 0; i < belief.anchor_count; ++i) belief.anchors.col(i) += rolled;

  // ---- transition. Seen from the end of the step, with t the time to go:
  //   xi_R+ = xi_R - int R          zeta_g
  //   xi_v+ = xi_v + g x xi_R dt      - int (v+ - alpha(t)) x R zeta_g - int R   zeta_a
  //   xi_p+ = xi_p + xi_v dt + g x xi_R dt^2/2 - int (p+ - beta(t)) x R zeta_g - int t R zeta_a
  //   xi_d+ = xi_d + r turn x (e_z x xi_R) - int (d - r e_z) x R    zeta_g
  // with alpha(t) and beta(t) what the specific force still adds to v and p. Their integrals are
  // what a gyro error does to v and p through the rotation: derivatives of Gamma_1 a and Gamma_2 a.
  const Scalar dt2 = dt * dt, dt3 = dt2 * dt, dt4 = dt3 * dt;
  const M3 alpha_r = -dt2 * start * gamma.g1_derivative(a);
  const M3 beta_r = -dt3 * start * gamma.g2_derivative(a);
  const M3 int_r = mean_rotation * dt;
  const M3 gx = hat(g);
  const M3 v_gyro = alpha_r - hat(belief.velocity) * int_r;
  const M3 p_gyro = beta_r - hat(belief.position) * int_r;
  const M3 p_accel = -(start * gamma.g2) * dt2;
  const M3 d_rotation = rolling.radius * hat(turn) * hat(up);
  const V3 contact_offset = rolling.radius * up;

  auto& p = belief.covariance;
  const int n = belief.dim();
  const Scalar gyro_bias_q = noise.gyro_bias * noise.gyro_bias * dt;
  const Scalar accel_bias_q = noise.accel_bias * noise.accel_bias * dt;
  // A bias that walks during the step moves the rest by Phi(t) = L t + Q t^2. A third of the walk
  // before the step and two thirds after it make the variances right; the cross terms then lack
  // L dt / 6 (added below).
  const auto bias_walk = [&](Scalar part) {
    p.diagonal().template segment<3>(B::kGyroBias).array() += part * gyro_bias_q;
    p.diagonal().template segment<3>(B::kAccelBias).array() += part * accel_bias_q;
  };
  // Applies the transition to the rows of a matrix; with the transpose, to its columns.
  const auto transition = [&](auto&& m) {
    const auto rows = [&](int at) { return m.template middleRows<3>(at); };
    const auto bg = rows(B::kGyroBias), ba = rows(B::kAccelBias), r = rows(B::kRotation);
    rows(B::kPosition) +=
        dt * rows(B::kVelocity) + (dt2 / 2) * (gx * r) + p_gyro * bg + p_accel * ba;
    rows(B::kVelocity) += dt * (gx * r) + v_gyro * bg - int_r * ba;
    for (int i = 0; i < belief.anchor_count; ++i) {
      const M3 d_gyro = -hat(belief.anchors.col(i) - contact_offset) * int_r;
      rows(B::anchor_index(i)) += d_rotation * r + d_gyro * bg;
    }
    rows(B::kRotation) -= int_r * bg;
  };
  bias_walk(Scalar(1) / 3);
  transition(p.leftCols(n));
  transition(p.topRows(n).transpose());
  bias_walk(Scalar(2) / 3);
  const auto add_cross = [&](int row, int column, const M3& q) {
    p.template block<3, 3>(row, column) += q;
    p.template block<3, 3>(column, row) += q.transpose();
  };
  const M3 linear_gyro = -gyro_bias_q * dt / 6 * belief.rotation;
  add_cross(B::kRotation, B::kGyroBias, linear_gyro);
  add_cross(B::kVelocity, B::kGyroBias, hat(belief.velocity) * linear_gyro);
  add_cross(B::kPosition, B::kGyroBias, hat(belief.position) * linear_gyro);
  add_cross(B::kVelocity, B::kAccelBias, -accel_bias_q * dt / 6 * belief.rotation);
  for (int i = 0; i < belief.anchor_count; ++i) {
    add_cross(B::anchor_index(i), B::kGyroBias,
              hat(belief.anchors.col(i) - contact_offset) * linear_gyro);
  }

  // ---- white noise. The gyro's enters like its bias, R R^T = I makes it independent of the
  // rotation: with L = (I, v_x, p_x, (d - r e_z)_x) it adds s^2 dt L L^T. v and p vary over the
  // step by alpha and beta; their mean is in L, their spread adds to the vv, vp and pp blocks.
  const Scalar gyro_q = noise.gyro * noise.gyro * dt2;
  const Scalar accel_q = noise.accel * noise.accel * dt2;
  const V3 a0 = belief.rotation * a, a1 = belief.rotation * w.cross(a);
  const V3 v_mid = belief.velocity - (a0 * (dt / 2) - a1 * (dt2 / 6));
  const V3 p_mid = belief.position - (a0 * (dt2 / 6) - a1 * (dt3 / 12));
  const auto add_own = [&](int i, const M3& q) { p.template block<3, 3>(i, i) += q; };
  const M3 v_hat = hat(v_mid), p_hat = hat(p_mid);
  const M3 spread = gyro_q * (a0.squaredNorm() * M3::Identity() - a0 * a0.transpose());
  add_own(B::kRotation, gyro_q * M3::Identity());
  add_cross(B::kVelocity, B::kRotation, gyro_q * v_hat);
  add_cross(B::kPosition, B::kRotation, gyro_q * p_hat);
  add_own(B::kVelocity, -gyro_q * v_hat * v_hat + spread * (dt2 / 12));
  add_cross(B::kPosition, B::kVelocity, -gyro_q * p_hat * v_hat + spread * (dt3 / 24));
  add_own(B::kPosition, -gyro_q * p_hat * p_hat + spread * (dt4 / 45));
  for (int i = 0; i < belief.anchor_count; ++i) {
    const M3 d_hat = hat(belief.anchors.col(i) - contact_offset);
    const int at = B::anchor_index(i);
    add_cross(at, B::kRotation, gyro_q * d_hat);
    add_cross(at, B::kVelocity, -gyro_q * d_hat * v_hat);
    add_cross(at, B::kPosition, -gyro_q * d_hat * p_hat);
    for (int j = 0; j < i; ++j) {
      add_cross(at, B::anchor_index(j),
                -gyro_q * d_hat * hat(belief.anchors.col(j) - contact_offset));
    }
    add_own(at, -gyro_q * d_hat * d_hat + noise.anchor * noise.anchor * dt * M3::Identity());
  }
  // The accelerometer's noise is integrated once and twice.
  p.diagonal().template segment<3>(B::kVelocity).array() += accel_q;
  add_cross(B::kPosition, B::kVelocity, accel_q * (dt / 2) * M3::Identity());
  p.diagonal().template segment<3>(B::kPosition).array() += accel_q * (dt2 / 3);
  p.diagonal().template segment<B::Extra>(B::kExtra) += extra_walk.cwiseAbs2() * dt;
  belief.symmetrize();
}

}  // namespace tensegrity::inekf
