// What the filter knows: a mean on SE_{2+N}(3) x R^m and the covariance of its right-invariant
// error.
//
// Mean:  X = (R, v, p, d_1 .. d_N) in SE_{2+N}(3) (T eq. 2), body in world, and the Euclidean part
//        theta = (b_g, b_a, extra). `extra` belongs to the measurement model: the loosely coupled
//        filter keeps the spin angle phi there, a tightly coupled one the shape and its rates.
// Error: Xbar X^-1 = exp(xi) and thetabar - theta, so that
//        e = (zeta_bg, zeta_ba, xi_R, xi_v, xi_p, zeta_extra, xi_d1 .. xi_dN).
// Contact points come last: adding and removing one moves nothing else.
#pragma once

#include <array>
#include <cmath>

#include "tensegrity/inekf/body_error.hpp"
#include "tensegrity/inekf/column_covariance.hpp"
#include "tensegrity/inekf/retraction.hpp"
#include "tensegrity/math/so3.hpp"
#include "tensegrity/math/symmetric.hpp"

namespace tensegrity::inekf {

template <typename Scalar_, int Extra_, int MaxAnchors_ = 6>
struct Belief : BodyError {
  using Scalar = Scalar_;
  static constexpr int Extra = Extra_;
  static constexpr int MaxAnchors = MaxAnchors_;

  // Where the error's further blocks start.
  static constexpr int kExtra = kBodyEnd;
  static constexpr int kAnchors = kExtra + Extra;
  static constexpr int MaxDim = kAnchors + 3 * MaxAnchors;

  // Of the leading dim() x dim() block, what is on and below the diagonal; beyond it all is zero.
  // What is above the diagonal is scratch, up to date only after `complete`.
  using Covariance = Matrix<Scalar, padded(MaxDim)>;
  using ErrorVector = Vector<Scalar, padded(MaxDim)>;

  Belief() { reset(); }

  // Back to how it was constructed. In place: a second covariance is much of a small stack.
  void reset() {
    rotation.setIdentity();
    velocity.setZero();
    position.setZero();
    gyro_bias.setZero();
    accel_bias.setZero();
    extra.setZero();
    anchors.setZero();
    anchor_ids.fill(0);
    anchor_count = 0;
    covariance.setZero();
  }

  Matrix3<Scalar> rotation;    // R, body to world
  Vector3<Scalar> velocity;    // v, world [m/s]
  Vector3<Scalar> position;    // p, world [m]
  Vector3<Scalar> gyro_bias;   // b_g, body [rad/s]
  Vector3<Scalar> accel_bias;  // b_a, body [m/s^2]
  Vector<Scalar, Extra> extra;
  Matrix<Scalar, 3, MaxAnchors> anchors;   // d_i, world [m]
  std::array<int, MaxAnchors> anchor_ids;  // which endcap each anchor belongs to
  int anchor_count;
  Covariance covariance;

  int dim() const { return kAnchors + 3 * anchor_count; }
  static constexpr int anchor_index(int slot) { return kAnchors + 3 * slot; }

  // Slot of an endcap's anchor, or -1.
  int find(int id) const {
    for (int slot = 0; slot < anchor_count; ++slot) {
      if (anchor_ids[std::size_t(slot)] == id) return slot;
    }
    return -1;
  }

  // X <- Exp(-xi) X, theta <- theta - zeta: takes an estimated error e out of the mean (T eq. 13).
  void retract(const ErrorVector& e) {
    const Retraction<Scalar> group(&e[kRotation]);
    group.move(rotation);
    group.move(velocity, &e[kVelocity]);
    group.move(position, &e[kPosition]);
    for (int slot = 0; slot < anchor_count; ++slot) {
      group.move(anchors.col(slot), &e[anchor_index(slot)]);
    }
    gyro_bias -= e.template segment<3>(kGyroBias);
    accel_bias -= e.template segment<3>(kAccelBias);
    extra -= e.template segment<Extra>(kExtra);
  }

  // Copies what is below the covariance's diagonal to above it.
  void complete() { mirror(covariance, 0, padded(dim())); }
  Covariance complete_covariance() const {
    Covariance p = covariance;
    mirror(p, 0, padded(dim()));
    return p;
  }

  bool finite() const {
    const int n = dim();
    return rotation.allFinite() && velocity.allFinite() && position.allFinite() &&
           gyro_bias.allFinite() && accel_bias.allFinite() && extra.allFinite() &&
           anchors.leftCols(anchor_count).allFinite() && covariance.topLeftCorner(n, n).allFinite();
  }

  // Covariance of the position error p - pbar in the world [m^2]. The invariant error mixes in the
  // rotation: dp = xi_p - p x xi_R.
  Matrix3<Scalar> position_covariance() const {
    return column_covariance(covariance, position, kPosition);
  }
  Matrix3<Scalar> velocity_covariance() const {
    return column_covariance(covariance, velocity, kVelocity);
  }
  // Covariance of the rotation error in the world frame [rad^2].
  Matrix3<Scalar> rotation_covariance() const { return symmetric_block(covariance, kRotation); }
};

}  // namespace tensegrity::inekf
