// P <- F P F' + noise of the sample, for an error that begins with those of a strapdown body,
//   e = (xi_R, xi_v, xi_p, zeta_bg, zeta_ba, ...).
//
// F = I + A is never formed. It acts on the columns of P, P F', and then on the rows of the lower
// triangle of that. A is known by few columns: those of xi_R, xi_v and zeta_ba in the body's own
// rows, those of zeta_bg in the rows of every column of the group. The noise of a sample is one
// more error of its biases, which reaches column j of P F' as row j of A.
#pragma once

#include "tensegrity/inekf/strapdown.hpp"
#include "tensegrity/math/symmetric.hpp"

namespace tensegrity::inekf {

template <typename Scalar, int Rows>
class Transition {
 public:
  // Where each block of the body's error starts.
  static constexpr int kRotation = 0, kVelocity = 3, kPosition = 6, kGyroBias = 9, kAccelBias = 12;

  // `gyro_std` [rad/s] and `accel_std` [m/s^2]: of the sample. Of `rows` rows, a multiple of four,
  // those after the body's see no error of the gyro, but for those of `set_group`.
  Transition(const Strapdown<Scalar>& body, Scalar gyro_std, Scalar accel_std, int rows)
      : body_(body), gyro_variance_(gyro_std * gyro_std), accel_variance_(accel_std * accel_std) {
    for (int k = 0; k < 3; ++k) set_zero(&by_(kBody, k), &by_(0, k) + rows);
    for (int k = 0; k < 3; ++k) {
      const std::size_t column = std::size_t(k);
      const Packet<Scalar> by_int_r = Scalar(-1) * body.int_r[column];
      set_column(k, by_int_r, body.velocity_by_gyro[column], body.position_by_gyro[column]);
      set_column(kByAccel + k, {}, by_int_r, body.position_by_accel[column]);
      set_column(kByVelocity + k, {}, {}, body.dt * unit(k));
    }
    // The body falls along z, about which no turn matters.
    const Scalar half = body.dt / 2;
    const Packet<Scalar> by_x = -body.fall * unit(1), by_y = body.fall * unit(0);
    set_column(kByTilt, {}, by_x, half * by_x);
    set_column(kByTilt + 1, {}, by_y, half * by_y);
  }

  // P F': the body's columns, all `rows` of them.
  template <typename P>
  void body_columns(P& covariance, int rows) const {
    constexpr int kStride = P::RowsAtCompileTime;
    const Scalar fall = body_.fall, dt = body_.dt, half_fall = fall * dt / 2;
    for (int i = 0; i < rows; i += 4) {
      Scalar* at = &covariance(i, 0);
      const auto load = [&](int column) { return Packet<Scalar>(at + column * kStride); };
      const Packet<Scalar> g0 = load(kGyroBias), g1 = load(kGyroBias + 1), g2 = load(kGyroBias + 2);
      const Packet<Scalar> a0 = load(kAccelBias), a1 = load(kAccelBias + 1),
                           a2 = load(kAccelBias + 2);
      const Packet<Scalar> rx = load(kRotation), ry = load(kRotation + 1);
      const auto turned = [&](int row, Packet<Scalar>& x) {
        x.add(by_(row, 0), g0);
        x.add(by_(row, 1), g1);
        x.add(by_(row, 2), g2);
      };
      const auto accelerated = [&](int row, Packet<Scalar>& x) {
        x.add(by_(row, kByAccel), a0);
        x.add(by_(row, kByAccel + 1), a1);
        x.add(by_(row, kByAccel + 2), a2);
      };
      for (int k = 0; k < 3; ++k) {
        const Packet<Scalar> v = load(kVelocity + k);
        Packet<Scalar> p = load(kPosition + k), v_next = v;
        if (k == 0) v_next.add(fall, ry), p.add(half_fall, ry);
        if (k == 1) v_next.subtract(fall, rx), p.subtract(half_fall, rx);
        p.add(dt, v);
        accelerated(kPosition + k, p);
        turned(kPosition + k, p);
        p.store(at + (kPosition + k) * kStride);
        accelerated(kVelocity + k, v_next);
        turned(kVelocity + k, v_next);
        v_next.store(at + (kVelocity + k) * kStride);
      }
      for (int k = 0; k < 3; ++k) {
        Packet<Scalar> r = load(kRotation + k);
        turned(kRotation + k, r);
        r.store(at + (kRotation + k) * kStride);
      }
    }
  }

  // Rows at .. at + 2 of the group see a gyro error through `m`. By ascending `at`.
  void set_group(int at, const Block<Scalar>& m) {
    for (int k = 0; k < 3; ++k) m[std::size_t(k)].store(&by_(at, k));
  }

  // P F': columns at .. at + 2 of the group, from the diagonal on.
  template <typename P>
  void group_columns(P& covariance, int at, int rows) const {
    add_columns(covariance, at, kGyroBias, by_.template block<3, 3>(at, 0), packet_start(at), rows);
  }

  // F (P F') and the noise of the sample, from the diagonal on. Rows of the group after the body's
  // begin at `group`, a multiple of four; all end at `end`. What is above the diagonal is only read
  // before `group`.
  template <typename P>
  void all_rows(P& covariance, int group, int end) const {
    const int rows = padded(end);
    const auto p = columns(covariance);
    const auto by = columns(by_);
    // Rows of P F' that A has columns for: for the body's, and of zeta_bg.
    alignas(4 * sizeof(Scalar)) Scalar seen[kColumns][4];
    alignas(4 * sizeof(Scalar)) Scalar gyro[3][Rows];
    for (int j = 0; j < group; j += 4) {
      const auto own = p.from_column(j);
      Packet<Scalar> x0, x1, x2, x3;
      const auto load = [&](int at) {
        x0 = Packet<Scalar>(own[0] + at);
        x1 = Packet<Scalar>(own[1] + at);
        x2 = Packet<Scalar>(own[2] + at);
        x3 = Packet<Scalar>(own[3] + at);
        Packet<Scalar>::transpose(x0, x1, x2, x3);
      };
      const auto noisy = [&](Packet<Scalar> row, Scalar variance, int column) {
        row.add(variance, Packet<Scalar>(by[column] + j));
        return row;
      };
      // Biases have no rows in A: the row of p_z, in a packet with theirs, is taken by itself.
      load(kReadRows);
      Packet<Scalar> p_z = x0;
      const Packet<Scalar> gx = noisy(x1, gyro_variance_, 0), gy = noisy(x2, gyro_variance_, 1),
                           gz = noisy(x3, gyro_variance_, 2);
      gx.store(gyro[0] + j);
      gy.store(gyro[1] + j);
      gz.store(gyro[2] + j);
      if (j >= kBody) continue;
      const auto see = [&](int column, const Packet<Scalar>& x) {
        x.store(seen[column]);
        p_z.add(by[column][kReadRows], x);
      };
      see(0, gx);
      see(1, gy);
      see(2, gz);
      load(kAccelBias);
      see(kByAccel, noisy(x0, accel_variance_, kByAccel));
      see(kByAccel + 1, noisy(x1, accel_variance_, kByAccel + 1));
      see(kByAccel + 2, noisy(x2, accel_variance_, kByAccel + 2));
      load(0);
      see(kByTilt, x0);
      see(kByTilt + 1, x1);
      see(kByVelocity, x3);
      load(4);
      see(kByVelocity + 1, x0);
      see(kByVelocity + 2, x1);
      for (int c = 0; c < 4; ++c) own[c][kReadRows] = p_z.at(c);
      if (j < kReadRows) {
        add_product<false>(own, by, Columns<const Scalar, 4>{seen[0]}, kColumns, j, kReadRows);
      }
    }
    // The rows of zeta_bg in the columns of the group, from the rows of the group: P F' and P agree
    // in the columns of zeta_bg.
    Scalar bias[3][3];
    for (int k = 0; k < 3; ++k) {
      for (int l = 0; l < 3; ++l) bias[k][l] = p[kGyroBias + k][kGyroBias + l];
      bias[k][k] += gyro_variance_;
    }
    for (int j = group; j < rows; j += 4) {
      const Packet<Scalar> a0(by[0] + j), a1(by[1] + j), a2(by[2] + j);
      for (int k = 0; k < 3; ++k) {
        Packet<Scalar> row(p[kGyroBias + k] + j);
        row.add(bias[k][0], a0);
        row.add(bias[k][1], a1);
        row.add(bias[k][2], a2);
        row.store(gyro[k] + j);
      }
    }
    const Columns<const Scalar, Rows> errors{gyro[0]};
    for (int row = group; row < rows; row += 4 * kGroup) {
      const int left = (rows - row) / 4;
      const auto rest = p.from(row);
      const auto a = by.from(row);
      if (left >= kGroup) {
        add_rows<kGroup>(rest, a, errors, std::min(row + 4 * kGroup, end));
      } else if (left == 2) {
        add_rows<2>(rest, a, errors, end);
      } else {
        add_rows<1>(rest, a, errors, end);
      }
    }
  }

 private:
  static constexpr int kBody = padded(kGyroBias);            // rows of the body
  static constexpr int kReadRows = packet_start(kGyroBias);  // p_z and zeta_bg
  static constexpr int kGroup = 3;                           // packets of the group's rows at once
  static_assert(kGyroBias % 4 == 1 && kPosition + 3 == kGyroBias && kAccelBias % 4 == 0 &&
                kRotation == 0 && kVelocity == 3);
  // Columns of A that are not zero: zeta_bg, and in the body's rows xi_Rx, xi_Ry, xi_v, zeta_ba.
  static constexpr int kByTilt = 3, kByVelocity = 5, kByAccel = 8, kColumns = 11;

  static Packet<Scalar> unit(int k) {
    return {Scalar(k == 0), Scalar(k == 1), Scalar(k == 2), Scalar(0)};
  }
  // A column of A in the body's rows. In ascending order: the fourth number of a packet is none.
  void set_column(int column, const Packet<Scalar>& rotation, const Packet<Scalar>& velocity,
                  const Packet<Scalar>& position) {
    Scalar* at = &by_(0, column);
    Packet<Scalar>().store(at + kBody - 4);
    rotation.store(at + kRotation);
    velocity.store(at + kVelocity);
    position.store(at + kPosition);
  }

  const Strapdown<Scalar>& body_;
  Scalar gyro_variance_, accel_variance_;
  Matrix<Scalar, Rows, kColumns> by_;
};

}  // namespace tensegrity::inekf
