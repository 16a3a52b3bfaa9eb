// The rigid body that carries the IMU, over one sample (T eqs. 4-8), discretised exactly.
//
// Angular velocity and specific force are taken as constant in the body frame over the sample.
// Mean and transition are then integrals of that motion; T and DRIFT hold R fixed over the step
// instead. The noise of a sample is an error of its mean, which holds for the step as well: it acts
// like a bias of this step alone.
#pragma once

#include <array>

#include "tensegrity/math/packet.hpp"
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
  Scalar dt;            // [s]
  Scalar fall;          // |g| dt [m/s]: g x xi_R dt = fall (xi_Ry, -xi_Rx, 0)
  Block<Scalar> int_r;  // int R [s]; by the accelerometer xi_v gets -int_r zeta_a
  Block<Scalar> velocity_by_gyro, position_by_gyro;
  Block<Scalar> position_by_accel;

  // What any other column of the group sees of a gyro error: -hat(x) int R.
  Block<Scalar> column_by_gyro(const Packet<Scalar>& x) const {
    Block<Scalar> m;
    for (std::size_t k = 0; k < 3; ++k) m[k] = Packet<Scalar>::cross(int_r[k], x);
    return m;
  }
};

// Moves R, v [m/s] and p [m] by `imu` without its biases, over dt [s].
//   R+ = R G0, v+ = v + R G1 a dt + g dt, p+ = p + v dt + R G2 a dt^2 + g dt^2/2
//
// With x = omega dt and y = R x all of it is made of the columns of R, y x R and y x (y x R):
//   R Gamma_m(x) = R / m! + c_{m+1} hat(y) R + c_{m+2} hat(y)^2 R,
//   R d(Gamma_m(x) a)/dx = -c hat(R a) R + d (y a' + (x'a) R) + s x',
//   s = c* y x R a + d* y x (y x R a) - 2 d R a,
// with c = c_{m+1}, d = c_{m+2} and their slopes c*, d*.
template <typename Scalar, typename Velocity, typename Position>
Strapdown<Scalar> integrate(Matrix3<Scalar>& rotation, Velocity&& velocity, Position&& position,
                            const ImuSample<Scalar>& imu, Scalar dt, Scalar gravity) {
  using P = Packet<Scalar>;
  using V3 = Vector3<Scalar>;
  const V3 x = imu.gyro * dt;
  const V3& a = imu.accel;
  const RotationSeries<Scalar> c(x.squaredNorm());
  const auto slopes = c.slopes();
  const Scalar dt2 = dt * dt, dt3 = dt2 * dt;

  const Block<Scalar> r = {P(rotation.col(0)), P(rotation.col(1)), P(rotation.col(2))};
  const auto turned = [&](const Block<Scalar>& m, const V3& v) {
    P sum = v[0] * m[0];
    sum.add(v[1], m[1]);
    sum.add(v[2], m[2]);
    return sum;
  };
  const auto combine = [](Scalar f, const P& u, Scalar g, const P& v, Scalar h, const P& w) {
    P sum = f * u;
    sum.add(g, v);
    sum.add(h, w);
    return sum;
  };

  const P y = turned(r, x), force = turned(r, a);
  Strapdown<Scalar> s;
  s.dt = dt;
  s.fall = gravity * dt;
  Block<Scalar> next, r_g2, across;  // R Gamma_0, R Gamma_2 dt^2, force x R
  for (std::size_t j = 0; j < 3; ++j) {
    const P once = P::cross(y, r[j]), twice = P::cross(y, once);
    s.int_r[j] = combine(dt, r[j], dt * c.c2, once, dt * c.c3, twice);
    r_g2[j] = combine(dt2 / 2, r[j], dt2 * c.c3, once, dt2 * c.c4, twice);
    s.position_by_accel[j] = Scalar(-1) * r_g2[j];
    across[j] = P::cross(force, r[j]);
    next[j] = combine(Scalar(1), r[j], c.c1, once, c.c2, twice);
  }
  const P g(Scalar(0), Scalar(0), -gravity, Scalar(0));
  const P start_velocity(velocity);
  const P moved = P(position) + (dt * start_velocity + (turned(r_g2, a) + dt2 / 2 * g));
  const P faster = start_velocity + (turned(s.int_r, a) + dt * g);
  moved.store_vector(position);
  faster.store_vector(velocity);
  s.velocity_by_gyro = s.column_by_gyro(faster);
  s.position_by_gyro = s.column_by_gyro(moved);
  const Scalar xa = x.dot(a);
  const P once = P::cross(y, force), twice = P::cross(y, once);
  const P by_x1 = combine(slopes.c2, once, slopes.c3, twice, -2 * c.c3, force);
  const P by_x2 = combine(slopes.c3, once, slopes.c4, twice, -2 * c.c4, force);
  const auto subtract = [&](P& to, int j, Scalar dtn, Scalar c, Scalar d, const P& by_x) {
    to.add(dtn * c, across[std::size_t(j)]);
    to.subtract(dtn * d * a[j], y);
    to.subtract(dtn * d * xa, r[std::size_t(j)]);
    to.subtract(dtn * x[j], by_x);
  };
  for (int j = 0; j < 3; ++j) {
    subtract(s.velocity_by_gyro[std::size_t(j)], j, dt2, c.c2, c.c3, by_x1);
    subtract(s.position_by_gyro[std::size_t(j)], j, dt3, c.c3, c.c4, by_x2);
  }
  next = orthonormalized(next);
  for (int j = 0; j < 3; ++j) {
    auto column = rotation.col(j);
    next[std::size_t(j)].store_vector(column);
  }
  return s;
}

}  // namespace tensegrity::inekf
