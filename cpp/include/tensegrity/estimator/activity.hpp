// How much is going on, from the IMU alone: 0 at rest, 1 when rolling fast or falling.
//
// Sums how far the specific force is from gravity and how fast the rod turns, each in units of a
// value that counts as active, and forgets with a time constant so that a fall does not end between
// two samples.
#pragma once

#include <algorithm>
#include <cmath>

#include "tensegrity/types.hpp"

namespace tensegrity {

template <typename Scalar>
class Activity {
 public:
  // Deviation of the specific force from gravity [m/s^2] and rate [rad/s] that count as active.
  Activity(Scalar force, Scalar rate) : force_(force), rate_(rate) {}

  // Angular velocity [rad/s] and specific force [m/s^2] without their biases, any frame.
  void update(const Vector3<Scalar>& rate, const Vector3<Scalar>& force, Scalar gravity,
              Scalar dt) {
    const Scalar now =
        std::min(std::abs(force.norm() - gravity) / force_ + rate.norm() / rate_, Scalar(1));
    level_ = std::max(now, level_ * std::exp(-dt / kMemory));
  }

  Scalar level() const { return level_; }

 private:
  static constexpr Scalar kMemory = Scalar(0.1);  // [s]
  Scalar force_, rate_;
  Scalar level_ = 0;
};

}  // namespace tensegrity
