// What the tightly coupled filter knows: the base rod as a rigid body, and the endcaps of the other
// two rods as points with velocities, all in the world and in one group.
//
// Mean:  X = (R, v, p, q_2 .. q_5, w_2 .. w_5) in SE_10(3) with R body to world, v and p those of
//        the IMU, q_i the centre of endcap i and w_i its velocity; Euclidean part
//        theta = (b_g, b_a, m, o) with m = (height, slope x, slope y) of the ground plane
//        z = m_0 + m_1 x + m_2 y, and o the constant errors of the cable sensors, which come
//        last because only cables look at them: above the diagonal the filter keeps up no more of
//        P than the columns before them.
// Error: right-invariant, Xbar X^-1 = exp(xi) and thetabar - theta.
//
// A net of rods and cables measures distances only. In this error the distance of two endcaps does
// not depend on R at all (a rotation of everything changes no distance), so that no correction by
// cables can invent a heading: the reason to hold endcaps in the group instead of a shape in the
// body frame. Rods 23 and 45 keep their length by a measurement (members.hpp).
#pragma once

#include "tensegrity/inekf/body_error.hpp"
#include "tensegrity/inekf/column_covariance.hpp"
#include "tensegrity/inekf/retraction.hpp"
#include "tensegrity/math/so3.hpp"
#include "tensegrity/math/symmetric.hpp"
#include "tensegrity/robot/prism.hpp"

namespace tensegrity::tight {

template <typename Scalar_>
struct Belief : inekf::BodyError {
  using Scalar = Scalar_;
  using V3 = Vector3<Scalar>;
  using M3 = Matrix3<Scalar>;

  // Where the error's further blocks start.
  static constexpr int kEndcaps = kBodyEnd;
  static constexpr int kRates = 27;
  static constexpr int kGround = 39;
  static constexpr int kOffsets = 42;
  // 51 states, and one that is always zero: columns of P are then whole SIMD packets.
  static constexpr int Dim = 52;
  // So many columns of P are kept complete; of those after them only what is below the diagonal.
  static constexpr int kComplete = padded(kOffsets);
  // Columns of the group: v, p, q_2 .. q_5, w_2 .. w_5.
  static constexpr int kColumns = 10;
  static constexpr int column_index(int column) {
    return column == 0 ? kVelocity : column == 1 ? kPosition : kEndcaps + 3 * (column - 2);
  }

  using Covariance = Matrix<Scalar, Dim>;
  using ErrorVector = Vector<Scalar, Dim>;

  explicit Belief(const Prism<Scalar>& robot) : base{robot.endcap0(), robot.endcap1()} { reset(); }

  // Back to how it was constructed. In place: a second covariance is much of a small stack.
  void reset() {
    rotation.setIdentity();
    columns.setZero();
    gyro_bias.setZero();
    accel_bias.setZero();
    offsets.setZero();
    ground.setZero();
    rate.setZero();
    covariance.setZero();
  }

  std::array<V3, 2> base;  // endcaps 0 and 1, body [m]
  M3 rotation;             // R
  Matrix<Scalar, 3, kColumns> columns;
  V3 gyro_bias;               // b_g, body [rad/s]
  V3 accel_bias;              // b_a, body [m/s^2]
  Vector<Scalar, 9> offsets;  // o, measured - true [m]
  V3 ground;                  // m [m], [1], [1]
  V3 rate;                    // angular, of the last step, bias removed, body [rad/s]
  Covariance covariance;

  auto velocity() const { return columns.col(0); }  // [m/s]
  auto position() const { return columns.col(1); }  // [m]

  // Centre and velocity of any endcap in the world [m], [m/s], and where their errors start. Those
  // of the base rod move with the body: xi_q = xi_p, and xi_w = xi_v + R hat(b_i) zeta_g.
  V3 endcap(int i) const {
    return i < 2 ? V3(position() + rotation * base[std::size_t(i)]) : V3(columns.col(i));
  }
  V3 endcap_velocity(int i) const {
    return i < 2 ? V3(velocity() + rotation * rate.cross(base[std::size_t(i)]))
                 : V3(columns.col(i + 4));
  }
  static constexpr int endcap_index(int i) { return i < 2 ? kPosition : kEndcaps + 3 * (i - 2); }
  static constexpr int endcap_velocity_index(int i) {
    return i < 2 ? kVelocity : kRates + 3 * (i - 2);
  }

  Endcaps<Scalar> endcaps_world() const {
    Endcaps<Scalar> q;
    for (int i = 0; i < 6; ++i) q.col(i) = endcap(i);
    return q;
  }
  Endcaps<Scalar> endcaps_body() const {
    return rotation.transpose() * (endcaps_world().colwise() - V3(position()));
  }
  // Upward unit normal of the ground.
  V3 ground_normal() const { return V3(-ground[1], -ground[2], 1).normalized(); }

  // X <- Exp(-xi) X, theta <- theta - zeta: takes an estimated error out of the mean.
  void retract(const ErrorVector& e) {
    const inekf::Retraction<Scalar> group(&e[kRotation]);
    group.move(rotation);
    for (int c = 0; c < kColumns; ++c) group.move(columns.col(c), &e[column_index(c)]);
    gyro_bias -= e.template segment<3>(kGyroBias);
    rate += e.template segment<3>(kGyroBias);
    accel_bias -= e.template segment<3>(kAccelBias);
    offsets -= e.template segment<9>(kOffsets);
    ground -= e.template segment<3>(kGround);
  }

  bool finite() const {
    return rotation.allFinite() && columns.allFinite() && gyro_bias.allFinite() &&
           accel_bias.allFinite() && offsets.allFinite() && ground.allFinite() &&
           covariance.allFinite();
  }

  // Makes the whole of P symmetric.
  void complete() { mirror(covariance, 0, Dim); }
  Covariance complete_covariance() const {
    Covariance p = covariance;
    mirror(p, 0, Dim);
    return p;
  }

  // Covariances of errors in the world frame: of a column x it is xi_x + xi_R x x.
  M3 position_covariance() const {
    return inekf::column_covariance(covariance, position(), kPosition);
  }
  M3 velocity_covariance() const {
    return inekf::column_covariance(covariance, velocity(), kVelocity);
  }
  M3 rotation_covariance() const { return covariance.template block<3, 3>(kRotation, kRotation); }
  // Joint covariance of the endcaps in the body frame [m^2], q stacked by endcap. An error of
  // R' (q_i - p) is R' (xi_q - xi_p) up to the rotation, which leaves the body frame.
  Matrix<Scalar, 18> endcap_covariance() const {
    Matrix<Scalar, 18> out = Matrix<Scalar, 18>::Zero();
    const M3 to_body = rotation.transpose();
    const M3 pp = covariance.template block<3, 3>(kPosition, kPosition);
    for (int i = 2; i < 6; ++i) {
      for (int j = 2; j < 6; ++j) {
        const int a = endcap_index(i), b = endcap_index(j);
        const M3 relative = covariance.template block<3, 3>(a, b) -
                            covariance.template block<3, 3>(a, kPosition) -
                            covariance.template block<3, 3>(kPosition, b) + pp;
        out.template block<3, 3>(3 * i, 3 * j) = to_body * relative * rotation;
      }
    }
    return out;
  }
};

}  // namespace tensegrity::tight
