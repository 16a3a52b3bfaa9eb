// The rigid body that carries the IMU, over one sample (T eqs. 4-8), discretised exactly.
//
// Angular velocity and specific force are taken as constant in the body frame over the sample.
// Mean and transition are then integrals of that motion; T and DRIFT hold R fixed over the step
// instead. The noise of a sample is an error of its mean, which holds for the step as well: it acts
// like a bias of this step alone.
#pragma once

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
// With x = omega dt, y = R x and f = R a, all of it is made of y, f and the columns r_j of R: the
// others of these give R hat(v) e_j = R v x r_j, and hat(x)^2 = x x' - |x|^2 I. In column j
//   R Gamma_m(x) = c_m r_j + c_{m+1} y x r_j + c_{m+2} x_j y,
//   R d(Gamma_m(x) a)/dx = -c f x r_j + d (a_j y + (x . a) r_j) + x_j s,
//   s = c* y x f + d* (x . a) y - (d* |x|^2 + 2 d) f,
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

  const Block<Scalar> r = to_block(rotation);
  const auto combine = [](Scalar f, const P& u, Scalar g, const P& v, Scalar h, const P& w) {
    P sum = f * u;
    sum.add(g, v);
    sum.add(h, w);
    return sum;
  };

  // R v x r_j
  const auto across = [&](const V3& v, int j) {
    P product = v[(j + 2) % 3] * r[std::size_t(j + 1) % 3];
    product.subtract(v[(j + 1) % 3], r[std::size_t(j + 2) % 3]);
    return product;
  };
  const P y = multiply(r, x), force = multiply(r, a);
  const P y2 = c.c2 * y, dt_y3 = dt * c.c3 * y, dt2_y4 = dt2 * c.c4 * y;
  Strapdown<Scalar> s;
  Block<Scalar> next, r_g2;  // R Gamma_0, R Gamma_2 dt^2
  for (int j = 0; j < 3; ++j) {
    const std::size_t k = std::size_t(j);
    const P once = across(x, j);
    s.int_r[k] = combine(dt * c.c1, r[k], dt * c.c2, once, x[j], dt_y3);
    r_g2[k] = combine(dt2 * c.c2, r[k], dt2 * c.c3, once, x[j], dt2_y4);
    s.position_by_accel[k] = Scalar(-1) * r_g2[k];
    next[k] = combine(c.c0, r[k], c.c1, once, x[j], y2);
  }
  const P g = -gravity * P::constant(0, 0, 1, 0);
  const P start_velocity(velocity);
  const P moved = P(position) + (dt * start_velocity + (multiply(r_g2, a) + dt2 / 2 * g));
  const P faster = start_velocity + (multiply(s.int_r, a) + dt * g);
  moved.store_vector(position);
  faster.store_vector(velocity);

  // What a gyro error does to v or p: -hat(column) int R - dtn R d(Gamma_m(x) a)/dx.
  const Scalar xa = x.dot(a), x2 = c.squared_angle;
  const P swept = P::cross(y, force);
  const auto by_gyro = [&](const P& column, Scalar dtn, Scalar c, Scalar d, Scalar c_slope,
                           Scalar d_slope) {
    const P by_x =
        combine(-dtn * c_slope, swept, -dtn * d_slope * xa, y, dtn * (d_slope * x2 + 2 * d), force);
    const P by_a = -dtn * d * y;
    Block<Scalar> m = s.column_by_gyro(column);
    for (int j = 0; j < 3; ++j) {
      const P& own = r[std::size_t(j)];
      P sum = combine(a[j], by_a, -dtn * d * xa, own, x[j], by_x);
      sum.add(dtn * c, across(a, j));
      m[std::size_t(j)] = m[std::size_t(j)] + sum;
    }
    return m;
  };
  s.velocity_by_gyro = by_gyro(faster, dt2, c.c2, c.c3, slopes.c2, slopes.c3);
  s.position_by_gyro = by_gyro(moved, dt3, c.c3, c.c4, slopes.c3, slopes.c4);
  store_block(orthonormalized(next), rotation);
  return s;
}

}  // namespace tensegrity::inekf
