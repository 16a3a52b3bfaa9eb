// P <- F P F' + noise of the sample, for an error that begins with those of a strapdown body,
//   e = (zeta_bg, zeta_ba, xi_R, xi_v, xi_p, ...).
//
// Biases move all that comes after them, the rotation v and p, the velocity p: in this order F is
// lower triangular by blocks, and its parts, one after the other, are shears that need no more of P
// than its lower triangle (shear.hpp):
//   the body falls and moves:
//     xi_v+ = xi_v + g x xi_R dt
//     xi_p+ = xi_p + dt xi_v + g x xi_R dt^2/2
//   the accelerometer's error reaches xi_v and xi_p
//   the gyro's reaches the whole group
// The noise of a sample is one more error of its biases.
#pragma once

#include "tensegrity/inekf/body_error.hpp"
#include "tensegrity/inekf/strapdown.hpp"
#include "tensegrity/math/shear.hpp"

namespace tensegrity::inekf {

// The body falls and moves over `dt` [s]; `fall` = |g| dt [m/s]. Of P the first `rows` rows (a
// multiple of four) of the lower triangle.
template <typename P>
void fall_and_move(P& covariance, typename P::Scalar fall, typename P::Scalar dt, int rows) {
  using Scalar = typename P::Scalar;
  using E = BodyError;
  using Pack = Packet<Scalar>;
  const auto p = columns(covariance);
  Scalar *rx = p[E::kRotation], *ry = p[E::kRotation + 1];
  Scalar *vx = p[E::kVelocity], *vy = p[E::kVelocity + 1], *vz = p[E::kVelocity + 2];
  // Rows that begin a packet; the rows of v are the last three of one.
  constexpr int kV = E::kVelocity - 1, kP = E::kPosition;
  static_assert(kV % 4 == 0 && kP % 4 == 0);
  // g x xi_R = |g| (xi_Ry, -xi_Rx, 0); the fall's effect on p is `half` of that on v.
  const Scalar half = fall * dt / 2;
  const Pack x = Pack::constant(1, 0, 0, 0), y = Pack::constant(0, 1, 0, 0),
             z = Pack::constant(0, 0, 1, 0);
  const Pack v_by_rx = -fall * z, v_by_ry = fall * y;  // after a row of R
  const Pack p_by_rx = -half * y, p_by_ry = half * x;
  const Pack p_by_v = dt * Pack::constant(1, 1, 1, 0);
  // Rows of p and of v in one column, by the rows of R and v that they see. The fourth number of
  // `v` does not matter.
  const auto move = [&](Scalar* column, Scalar rx, Scalar ry, const Pack& v) {
    Pack sum = Pack(column + kP) + p_by_v * v;
    sum.add(rx, p_by_rx);
    sum.add(ry, p_by_ry);
    sum.store(column + kP);
  };
  const auto fall_in = [&](Scalar* column, Scalar rx, Scalar ry) {
    Pack sum(column + kV);
    sum.add(rx, v_by_rx);
    sum.add(ry, v_by_ry);
    sum.store(column + kV);
  };

  // Columns of p, and after the rows of p those of v.
  for (int i = kP; i < rows; i += 4) {
    const Pack by_x(rx + i), by_y(ry + i);
    Pack v0(vx + i), v1(vy + i);
    Pack p0(p[kP] + i), p1(p[kP + 1] + i), p2(p[kP + 2] + i);
    p0.add(dt, v0), p1.add(dt, v1), p2.add(dt, Pack(vz + i));
    p0.add(half, by_y), p1.subtract(half, by_x);
    p0.store(p[kP] + i), p1.store(p[kP + 1] + i), p2.store(p[kP + 2] + i);
    if (i == kP) continue;
    v0.add(fall, by_y), v1.subtract(fall, by_x);
    v0.store(vx + i), v1.store(vy + i);
  }
  // Rows of p in the columns of v, then rows of p and v in those before. What of R or v is above
  // the diagonal has its mirror image below.
  const Pack rx_v(rx + kV), ry_v(ry + kV);
  move(vx, rx[9], ry[9], Pack(vx + 9));
  move(vy, rx[10], ry[10], {vx[10], vy[10], vy[11], vy[11]});
  move(vz, rx[11], ry[11], {vx[11], vy[11], vz[11], vz[11]});
  const Scalar rx_ry = rx[7], rx_rz = rx[8], ry_rz = ry[8];
  for (int j = 0; j < E::kVelocity; ++j) {
    Scalar* column = p[j];
    const Scalar by_x = j == 7 ? rx_ry : j == 8 ? rx_rz : column[6];
    const Scalar by_y = j == 8 ? ry_rz : column[7];
    move(column, by_x, by_y, Pack(column + 9));
    fall_in(column, by_x, by_y);
  }
  // Rows of p in its columns, by what p now has in those of R and v.
  for (int k = kP; k < kP + 3; ++k) move(p[k], rx[k], ry[k], {vx[k], vy[k], vz[k], vz[k]});
  // Columns of v in the rows of p and v, and the rows of v in them.
  const Pack rx_p(rx + kP), ry_p(ry + kP);
  const auto add = [](Scalar* to, Scalar factor, const Pack& x) {
    Pack sum(to);
    sum.add(factor, x);
    sum.store(to);
  };
  add(vx + kP, fall, ry_p), add(vy + kP, -fall, rx_p);
  add(vx + kV, fall, ry_v), add(vy + kV, -fall, rx_v);
  for (int k = 9; k < 12; ++k) fall_in(p[k], rx[k], ry[k]);
}

// What the errors of the sensors do.
template <typename Scalar, int Rows>
class SensorErrors {
  using E = BodyError;

 public:
  // `gyro_std` [rad/s] and `accel_std` [m/s^2]: of the sample.
  SensorErrors(const Strapdown<Scalar>& body, Scalar gyro_std, Scalar accel_std)
      : gyro_(E::kGyroBias, gyro_std * gyro_std), accel_(E::kAccelBias, accel_std * accel_std) {
    // By whole packets of rows: (b_a, R), (R, v) and p; of the accelerometer (R, v) and p.
    for (int k = 0; k < 3; ++k) {
      const std::size_t column = std::size_t(k);
      const Packet<Scalar> int_r = Scalar(-1) * body.int_r[column];
      const Packet<Scalar> zero_v = shifted(body.velocity_by_gyro[column]);
      (Packet<Scalar>::template permute<3, 3, 0, 1>(int_r)).store(gyro_.column(k) + 4);
      (Packet<Scalar>::template permute<2, 3, 3, 3>(int_r) + zero_v).store(gyro_.column(k) + 8);
      body.position_by_gyro[column].store(gyro_.column(k) + E::kPosition);
      shifted(int_r).store(accel_.column(k) + 8);
      body.position_by_accel[column].store(accel_.column(k) + E::kPosition);
    }
  }

  // Rows at .. at + 2 of the group see a gyro error through `m`. By ascending `at`.
  void set_group(int at, const Block<Scalar>& m) { gyro_.set(at, m); }
  // Rows that see none.
  void clear(int first, int end) { gyro_.clear(first, end); }

  // P <- F P F' and the noise of the sample. The group ends at `group_end`, P at `rows`, a multiple
  // of four.
  template <typename P>
  void apply(P& covariance, int group_end, int rows) const {
    accel_.apply(covariance, E::kVelocity, E::kBodyEnd, rows);
    gyro_.apply(covariance, E::kRotation, group_end, rows);
  }

 private:
  // A vector of three after a zero.
  static Packet<Scalar> shifted(const Packet<Scalar>& x) {
    return Packet<Scalar>::template permute<3, 0, 1, 2>(x);
  }

  Shear<Scalar, Rows> gyro_, accel_;
};

}  // namespace tensegrity::inekf
