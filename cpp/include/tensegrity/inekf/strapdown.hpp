// The rigid body that carries the IMU, over one sample (T eqs. 4-8), discretised exactly.
//
// Angular velocity and specific force are taken as constant in the body frame over the sample.
// Mean and transition are then integrals of that motion; T and DRIFT hold R fixed over the step
// instead. The noise of a sample is an error of its mean, which holds for the step as well: it acts
// like a bias of this step alone.
#pragma once

#include "tensegrity/math/so3.hpp"

namespace tensegrity::inekf {

// One sample: mean angular velocity [rad/s] and specific force [m/s^2] over the step, body.
template <typename Scalar>
struct ImuSample {
  Vector3<Scalar> gyro;
  Vector3<Scalar> accel;
};

// How the right-invariant error of the body moves, with t the time to go:
//   xi_R+ = xi_R - int R zeta_g
//   xi_v+ = xi_v + g x xi_R dt     - int (v+ - alpha(t)) x R zeta_g - int R   zeta_a
//   xi_p+ = xi_p + g x xi_R dt^2/2 - int (p+ - beta(t))  x R zeta_g - int t R zeta_a + dt xi_v
// with alpha(t) and beta(t) what the specific force still adds to v and p. Their integrals are what
// a gyro error does to v and p through the rotation: derivatives of Gamma_1 a and Gamma_2 a.
template <typename Scalar>
struct Strapdown {
  Scalar dt;              // [s]
  Scalar fall;            // |g| dt [m/s]: g x xi_R dt = fall (xi_Ry, -xi_Rx, 0)
  Matrix3<Scalar> int_r;  // int R [s]; by the accelerometer xi_v gets -int_r zeta_a
  Matrix3<Scalar> velocity_by_gyro, position_by_gyro;
  Matrix3<Scalar> position_by_accel;

  // What any other column of the group sees of a gyro error: -hat(x) int R.
  Matrix3<Scalar> column_by_gyro(const Vector3<Scalar>& x) const {
    Matrix3<Scalar> m;
    for (int k = 0; k < 3; ++k) m.col(k) = int_r.col(k).cross(x);
    return m;
  }
};

// m <- m - c a b
template <typename Scalar>
void subtract_product(Matrix3<Scalar>& m, Scalar c, const Matrix3<Scalar>& a,
                      const Matrix3<Scalar>& b) {
  for (int j = 0; j < 3; ++j) {
    const Scalar x = c * b(0, j), y = c * b(1, j), z = c * b(2, j);
    for (int i = 0; i < 3; ++i) m(i, j) -= a(i, 0) * x + a(i, 1) * y + a(i, 2) * z;
  }
}

// Moves R, v [m/s] and p [m] by `imu` without its biases, over dt [s].
//   R+ = R G0, v+ = v + R G1 a dt + g dt, p+ = p + v dt + R G2 a dt^2 + g dt^2/2
template <typename Scalar, typename Velocity, typename Position>
Strapdown<Scalar> integrate(Matrix3<Scalar>& rotation, Velocity&& velocity, Position&& position,
                            const ImuSample<Scalar>& imu, Scalar dt, Scalar gravity) {
  using V3 = Vector3<Scalar>;
  using M3 = Matrix3<Scalar>;
  const V3& a = imu.accel;
  const V3 g(0, 0, -gravity);
  const Gamma<Scalar> gamma(imu.gyro * dt);
  const Scalar dt2 = dt * dt;

  const M3 start = rotation;
  const M3 start_g2 = start * (dt2 * gamma.g2);
  Strapdown<Scalar> s;
  s.dt = dt;
  s.fall = gravity * dt;
  s.int_r = start * (dt * gamma.g1);
  position += velocity * dt + start_g2 * a + g * (dt2 / 2);
  velocity += s.int_r * a + g * dt;
  rotation = orthonormalized<Scalar>(start * gamma.g0);

  const auto [g1_derivative, g2_derivative] = gamma.derivatives(a);
  s.velocity_by_gyro = s.column_by_gyro(velocity);
  s.position_by_gyro = s.column_by_gyro(position);
  subtract_product(s.velocity_by_gyro, dt2, start, g1_derivative);
  subtract_product(s.position_by_gyro, dt2 * dt, start, g2_derivative);
  s.position_by_accel = -start_g2;
  return s;
}

}  // namespace tensegrity::inekf
