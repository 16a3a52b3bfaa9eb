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
  using M3 = Matrix3<Scalar>;
  // Where each block of the body's error starts.
  static constexpr int kRotation = 0, kVelocity = 3, kPosition = 6, kGyroBias = 9, kAccelBias = 12;

  // `gyro_std` [rad/s] and `accel_std` [m/s^2]: of the sample.
  Transition(const Strapdown<Scalar>& body, Scalar gyro_std, Scalar accel_std)
      : body_(body), gyro_variance_(gyro_std * gyro_std), accel_variance_(accel_std * accel_std) {
    by_.template topRows<kBody>().setZero();
    set_zero(kBody, kAccelBias + 3);
    by_.template block<3, 3>(kRotation, 0) = -body.int_r;
    by_.template block<3, 3>(kVelocity, 0) = body.velocity_by_gyro;
    by_.template block<3, 3>(kPosition, 0) = body.position_by_gyro;
    // The body falls along z, about which no turn matters.
    by_(kVelocity + 1, kByTilt) = -body.fall;
    by_(kVelocity, kByTilt + 1) = body.fall;
    by_(kPosition + 1, kByTilt) = -body.fall * body.dt / 2;
    by_(kPosition, kByTilt + 1) = body.fall * body.dt / 2;
    for (int k = 0; k < 3; ++k) by_(kPosition + k, kByVelocity + k) = body.dt;
    by_.template block<3, 3>(kVelocity, kByAccel) = -body.int_r;
    by_.template block<3, 3>(kPosition, kByAccel) = body.position_by_accel;
  }

  // Rows that no error of the gyro reaches. Every row after those of the biases has to be set, by
  // this or by `group_columns`.
  void set_zero(int row, int end) {
    for (; row < end; ++row) by_.row(row).template head<3>().setZero();
  }

  // P F': the body's columns, all `rows` of them.
  template <typename P>
  void body_columns(P& covariance, int rows) const {
    constexpr int kStride = P::RowsAtCompileTime;
    const Scalar fall = body_.fall, dt = body_.dt, half_fall = fall * dt / 2;
    const M3 by_int_r = -body_.int_r;
    for (int i = 0; i < rows; i += 4) {
      Scalar* at = &covariance(i, 0);
      const auto load = [&](int column) { return Packet<Scalar>(at + column * kStride); };
      const Packet<Scalar> g0 = load(kGyroBias), g1 = load(kGyroBias + 1), g2 = load(kGyroBias + 2);
      const Packet<Scalar> a0 = load(kAccelBias), a1 = load(kAccelBias + 1),
                           a2 = load(kAccelBias + 2);
      const Packet<Scalar> rx = load(kRotation), ry = load(kRotation + 1);
      const auto turned = [&](const M3& m, int k, Packet<Scalar>& x) {
        x.add(m(k, 0), g0);
        x.add(m(k, 1), g1);
        x.add(m(k, 2), g2);
      };
      const auto accelerated = [&](const M3& m, int k, Packet<Scalar>& x) {
        x.add(m(k, 0), a0);
        x.add(m(k, 1), a1);
        x.add(m(k, 2), a2);
      };
      for (int k = 0; k < 3; ++k) {
        const Packet<Scalar> v = load(kVelocity + k);
        Packet<Scalar> p = load(kPosition + k), v_next = v;
        if (k == 0) v_next.add(fall, ry), p.add(half_fall, ry);
        if (k == 1) v_next.subtract(fall, rx), p.subtract(half_fall, rx);
        p.add(dt, v);
        accelerated(body_.position_by_accel, k, p);
        turned(body_.position_by_gyro, k, p);
        p.store(at + (kPosition + k) * kStride);
        accelerated(by_int_r, k, v_next);
        turned(body_.velocity_by_gyro, k, v_next);
        v_next.store(at + (kVelocity + k) * kStride);
      }
      for (int k = 0; k < 3; ++k) {
        Packet<Scalar> r = load(kRotation + k);
        turned(by_int_r, k, r);
        r.store(at + (kRotation + k) * kStride);
      }
    }
  }

  // P F': columns at .. at + 2 of the group, which see a gyro error through `m`. Above the diagonal
  // only the rows that `rows_of` reads, or from `first` on.
  template <typename P>
  void group_columns(P& covariance, int at, const M3& m, int rows) {
    constexpr int kRead = packet_start(kGyroBias);
    by_.template block<3, 3>(at, 0) = m;
    add_columns(covariance, at, kGyroBias, m, kRead, kRead + 4);
    add_columns(covariance, at, kGyroBias, m, packet_start(at), rows);
  }
  template <typename P>
  void group_columns(P& covariance, int at, const M3& m, int first, int rows) {
    by_.template block<3, 3>(at, 0) = m;
    add_columns(covariance, at, kGyroBias, m, first, rows);
  }

  // F (P F') and the noise of the sample: rows of columns j .. j + 3 from the packet on their
  // diagonal on. Rows of the group after the body's begin at `group`.
  template <typename P>
  void rows_of(P& covariance, int j, int group, int rows) const {
    constexpr int kStride = P::RowsAtCompileTime;
    Scalar* x = &covariance(0, j);
    const Scalar* a = &by_(0, 0);
    Scalar b[kColumns][4];
    for (int c = 0; c < 4; ++c) {
      for (int k = 0; k < 3; ++k) {
        b[k][c] = x[c * kStride + kGyroBias + k] + gyro_variance_ * by_(j + c, k);
      }
    }
    if (j < kBody) {
      for (int c = 0; c < 4; ++c) {
        const Scalar* column = x + c * kStride;
        for (int k = 0; k < 2; ++k) b[kByTilt + k][c] = column[k];
        for (int k = 0; k < 3; ++k) {
          b[kByVelocity + k][c] = column[kVelocity + k];
          b[kByAccel + k][c] = column[kAccelBias + k] + accel_variance_ * by_(j + c, kByAccel + k);
        }
      }
      add_product<false>(x, kStride, a, Rows, b[0], 4, kColumns, j, kBody);
    }
    add_product<false>(x, kStride, a, Rows, b[0], 4, 3, std::max(j, packet_start(group)), rows);
  }

 private:
  static constexpr int kBody = padded(kGyroBias);  // rows of the body
  // Columns of A that are not zero: zeta_bg, and in the body's rows xi_Rx, xi_Ry, xi_v, zeta_ba.
  static constexpr int kByTilt = 3, kByVelocity = 5, kByAccel = 8, kColumns = 11;

  const Strapdown<Scalar>& body_;
  Scalar gyro_variance_, accel_variance_;
  Matrix<Scalar, Rows, kColumns> by_;
};

}  // namespace tensegrity::inekf
