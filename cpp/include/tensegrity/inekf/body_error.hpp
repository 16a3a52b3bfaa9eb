// The first states of a filter's error, those of the rigid body that carries the IMU.
#pragma once

namespace tensegrity::inekf {

// Where each block starts. Causes come before what they move: the transition of an IMU sample is
// lower triangular by blocks (transition.hpp).
struct BodyError {
  static constexpr int kGyroBias = 0;
  static constexpr int kAccelBias = 3;
  static constexpr int kRotation = 6;
  static constexpr int kVelocity = 9;
  static constexpr int kPosition = 12;
  static constexpr int kBodyEnd = 15;
};

}  // namespace tensegrity::inekf
