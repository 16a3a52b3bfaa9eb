// What the prism's estimator says, as plain values.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "tensegrity/estimator/pending.hpp"

namespace tensegrity {

// Counters since construction. A healthy run has zeros, apart from what its sensors lost.
struct PrismHealth {
  std::uint32_t imu_dropped = 0;        // not finite, out of range, duplicated or out of order
  std::uint32_t imu_gaps = 0;           // steps longer than `max_imu_gap`
  std::uint32_t cables_dropped = 0;     // not finite, out of range, out of order or too late
  std::uint32_t contacts_dropped = 0;   // out of order or too late
  std::uint32_t shape_failures = 0;     // lengths that no shape of this robot fits
  std::uint32_t contacts_rejected = 0;  // corrections that failed the chi-square gate
  std::uint32_t cables_rejected = 0;    // single lengths that failed the filter's gate
  std::uint32_t spin_resets = 0;      // spins of the shape that could not be true, and were widened
  std::uint32_t velocity_resets = 0;  // velocities that could not be true, and were widened
  std::uint32_t terrain_mismatches = 0;  // ground declared flat that turned out to slope
};

template <typename Scalar>
struct PrismState {
  Nanoseconds t = 0;         // stamp of the newest IMU sample in the state [ns]
  bool initialized = false;  // false until the robot has stood still (see `PrismConfig`)
  Matrix3<Scalar> rotation = Matrix3<Scalar>::Identity();             // body to world
  Vector3<Scalar> position = Vector3<Scalar>::Zero();                 // of the IMU in the world [m]
  Vector3<Scalar> velocity = Vector3<Scalar>::Zero();                 // world [m/s]
  Vector3<Scalar> gyro_bias = Vector3<Scalar>::Zero();                // body [rad/s]
  Vector3<Scalar> accel_bias = Vector3<Scalar>::Zero();               // body [m/s^2]
  Scalar spin = 0;                                                    // phi [rad]
  Scalar spin_variance = 0;                                           // [rad^2]
  Endcaps<Scalar> endcaps_body = Endcaps<Scalar>::Zero();             // [m]
  Endcaps<Scalar> endcaps_world = Endcaps<Scalar>::Zero();            // [m]
  Matrix<Scalar, 18> endcap_covariance = Matrix<Scalar, 18>::Zero();  // body frame [m^2]
  Matrix3<Scalar> rotation_covariance = Matrix3<Scalar>::Zero();      // world frame [rad^2]
  Matrix3<Scalar> velocity_covariance = Matrix3<Scalar>::Zero();      // world [m^2/s^2]
  Matrix3<Scalar> position_covariance = Matrix3<Scalar>::Zero();      // world [m^2]
  std::array<bool, 6> contacts{};  // endcaps that the filter holds as contacts
  // Share of the robot's weight that each of them carries, from the geometry at rest; their sum
  // is 1.
  std::array<Scalar, 6> load_shares{};
  // Normalised innovation squared of the newest correction per degree of freedom, NaN: none yet.
  Scalar cable_nis = std::numeric_limits<Scalar>::quiet_NaN();
  Scalar ground_nis = std::numeric_limits<Scalar>::quiet_NaN();  // of the feet's heights
  PrismHealth health;
};

}  // namespace tensegrity
