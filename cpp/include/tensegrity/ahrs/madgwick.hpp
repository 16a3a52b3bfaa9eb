// Orientation of an IMU by gradient descent.
//
// M = Madgwick, Harrison, Vaidyanathan 2011, "Estimation of IMU and MARG orientation using a
// gradient descent algorithm". Rates are integrated; a step of fixed length `gain` per second goes
// down the gradient of the squared difference between the measured direction of gravity (and of the
// magnetic field, if given) and the one that the orientation predicts:
//
//   f(q) = R(q)' e_z - a/|a|                                       (M eq. 25)
//   dq/dt = 1/2 q (0, w) - gain J'f / |J'f|                        (M eqs. 11, 34, 33)
//   q <- normalized(q + dq/dt dt)                                  (M eq. 13)
//
// q rotates from the IMU's frame to the world, z up; accelerations are specific forces: at rest
// R(q)' e_z |g|. Without a magnetometer the heading drifts with the gyroscope's bias and only
// inclinations mean anything. The step does not grow with the error, so no accelerometer sample,
// however wrong, turns the orientation by more than 2 gain dt; a wrong gyroscope sample turns it by
// w dt and is forgotten at the rate 2 gain. f is taken before the sample's rotation is added, as in
// M: a rod that turns at w is seen late by one sample, w dt.
#pragma once

#include <cmath>

#include "tensegrity/math/so3.hpp"

namespace tensegrity::ahrs {

template <typename Scalar>
struct MadgwickSettings {
  Scalar gain = Scalar(0.033);  // beta of M §III-F for an IMU [1/s]
  // Beyond these a sample is no measurement: full scale of the sensor, for the length of the vector
  // with a reserve of sqrt(3) for three saturated axes.
  Scalar largest_rate = Scalar(60);       // [rad/s], sensor of 2000 deg/s
  Scalar largest_force = Scalar(280);     // [m/s^2], sensor of 16 g
  Scalar largest_interval = Scalar(0.5);  // one sample says nothing about a longer time [s]
};

template <typename Scalar>
class Madgwick {
 public:
  using V3 = Vector3<Scalar>;
  using Quaternion = Eigen::Quaternion<Scalar>;

  explicit Madgwick(const MadgwickSettings<Scalar>& settings = {}) : settings_(settings) {}

  // Begins with the least rotation that explains a specific force measured at rest [m/s^2].
  // kOutOfRange when it has no direction or is too large.
  Status start(const V3& force) {
    if (!force.allFinite()) return Status::kNotFinite;
    if (!(force.norm() > 0 && force.norm() <= settings_.largest_force)) return Status::kOutOfRange;
    // Not by Eigen: it decomposes a matrix, which takes a compiler ten seconds.
    orientation_ = shortest_rotation<Scalar>(force.normalized(), V3::UnitZ());
    started_ = true;
    return Status::kOk;
  }

  // Begins with a known orientation; kOutOfRange when it is not of unit length (1 %).
  Status start(const Quaternion& orientation) {
    if (!orientation.coeffs().allFinite()) return Status::kNotFinite;
    if (std::abs(orientation.norm() - 1) > Scalar(0.01)) return Status::kOutOfRange;
    orientation_ = orientation.normalized();
    started_ = true;
    return Status::kOk;
  }

  // One sample: angular rate [rad/s] and specific force [m/s^2] in the IMU's frame over the last
  // `dt` [s]. A force of zero has no direction; the rate alone is used. kNotInitialized before
  // start().
  Status update(const V3& rate, const V3& force, Scalar dt) {
    const Status status = check(rate, force, dt);
    if (status != Status::kOk) return status;
    V4 gradient = V4::Zero();
    if (force.norm() > 0) gradient = gravity_gradient(force.normalized());
    advance(rate, gradient, dt);
    return Status::kOk;
  }

  // As above with the magnetic field in the IMU's frame, in any unit (MARG, M eqs. 31 and 45-46):
  // the heading is then relative to magnetic north (world x). A field of zero is left out.
  Status update(const V3& rate, const V3& force, const V3& field, Scalar dt) {
    if (!field.allFinite()) return Status::kNotFinite;
    if (!(field.norm() > 0)) return update(rate, force, dt);
    const Status status = check(rate, force, dt);
    if (status != Status::kOk) return status;
    V4 gradient = V4::Zero();
    if (force.norm() > 0) {
      gradient = gravity_gradient(force.normalized()) + field_gradient(field.normalized());
    }
    advance(rate, gradient, dt);
    return Status::kOk;
  }

  bool started() const { return started_; }
  const MadgwickSettings<Scalar>& settings() const { return settings_; }

  // From the IMU's frame to the world; identity before start().
  const Quaternion& orientation() const { return orientation_; }

  // Cosine of the angle between the vertical (up) and an axis of unit length in the IMU's frame;
  // the z axis is the rod's when the IMU is mounted along it.
  Scalar inclination_cosine(const V3& axis = V3::UnitZ()) const { return up().dot(axis); }

 private:
  using V4 = Eigen::Matrix<Scalar, 4, 1>;  // w, x, y, z

  Status check(const V3& rate, const V3& force, Scalar dt) const {
    if (!std::isfinite(dt) || !rate.allFinite() || !force.allFinite()) return Status::kNotFinite;
    const bool possible = rate.norm() <= settings_.largest_rate &&
                          force.norm() <= settings_.largest_force && dt > 0 &&
                          dt <= settings_.largest_interval;
    if (!possible) return Status::kOutOfRange;
    return started_ ? Status::kOk : Status::kNotInitialized;
  }

  // R(q)' e_z
  V3 up() const {
    const Scalar w = orientation_.w(), x = orientation_.x(), y = orientation_.y(),
                 z = orientation_.z();
    return V3(2 * (x * z - w * y), 2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  }

  // J'f of M eqs. 25, 26 for the measured direction of gravity.
  V4 gravity_gradient(const V3& measured) const {
    const Scalar w = orientation_.w(), x = orientation_.x(), y = orientation_.y(),
                 z = orientation_.z();
    const V3 f = up() - measured;
    return 2 * V4(-y * f.x() + x * f.y(), z * f.x() + w * f.y() - 2 * x * f.z(),
                  -w * f.x() + z * f.y() - 2 * y * f.z(), x * f.x() + y * f.y());
  }

  // J'f of M eqs. 29, 30 for the measured direction of the field. Its dip is taken from the
  // measurement itself, so that only the heading is corrected (M eqs. 45, 46).
  V4 field_gradient(const V3& measured) const {
    const Scalar w = orientation_.w(), x = orientation_.x(), y = orientation_.y(),
                 z = orientation_.z();
    const V3 in_world = orientation_ * measured;
    const Scalar bx = std::hypot(in_world.x(), in_world.y()), bz = in_world.z();
    const V3 north(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (w * y + x * z));
    const V3 f = bx * north + bz * up() - measured;
    return 2 * V4(-bz * y * f.x() + (bz * x - bx * z) * f.y() + bx * y * f.z(),
                  bz * z * f.x() + (bx * y + bz * w) * f.y() + (bx * z - 2 * bz * x) * f.z(),
                  -(2 * bx * y + bz * w) * f.x() + (bx * x + bz * z) * f.y() +
                      (bx * w - 2 * bz * y) * f.z(),
                  (bz * x - 2 * bx * z) * f.x() + (bz * y - bx * w) * f.y() + bx * x * f.z());
  }

  void advance(const V3& rate, const V4& gradient, Scalar dt) {
    const Quaternion spin =
        orientation_ * Quaternion(Scalar(0), rate.x() / 2, rate.y() / 2, rate.z() / 2);
    V4 derivative(spin.w(), spin.x(), spin.y(), spin.z());
    const Scalar steepness = gradient.norm();
    if (steepness > 0) derivative -= settings_.gain / steepness * gradient;
    orientation_ =
        Quaternion(orientation_.w() + dt * derivative[0], orientation_.x() + dt * derivative[1],
                   orientation_.y() + dt * derivative[2], orientation_.z() + dt * derivative[3]);
    orientation_.normalize();
  }

  MadgwickSettings<Scalar> settings_;
  Quaternion orientation_ = Quaternion::Identity();
  bool started_ = false;
};

}  // namespace tensegrity::ahrs
