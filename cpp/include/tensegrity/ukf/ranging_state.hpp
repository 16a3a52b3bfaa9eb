// What RangingEstimator knows.
#pragma once

#include <array>
#include <cstdint>

#include "tensegrity/types.hpp"
#include "tensegrity/ukf/dense.hpp"

namespace tensegrity::ukf {

struct RangingHealth {
  std::int64_t updates = 0;
  std::int64_t ranges_used = 0;
  std::int64_t ranges_rejected = 0;  // by the gate, internal ones too
  std::int64_t inclinations_used = 0;
  std::int64_t inclinations_rejected = 0;  // by the gate
  std::int64_t imu_rejected = 0;           // samples of impossible rates
  std::int64_t dropped = 0;                // input with a wrong stamp, index or value
  std::int64_t gaps = 0;                   // times without any range for `start_window`
  std::int64_t failed_predictions = 0;     // the dynamics gave numbers that are not finite
  std::int64_t restarts = 0;               // of a filter that was lost
};

template <typename Scalar>
struct RangingState {
  std::int64_t t = 0;  // [ns]
  bool initialized = false;
  VectorX<Scalar> positions;                                 // 3n: ends of the rods, world [m]
  VectorX<Scalar> velocities;                                // 3n [m/s]
  VectorX<Scalar> position_std;                              // 3n [m]
  Vector3<Scalar> centre_of_mass = Vector3<Scalar>::Zero();  // world [m]
  Vector3<Scalar> centre_of_mass_velocity = Vector3<Scalar>::Zero();    // [m/s]
  Matrix3<Scalar> centre_of_mass_covariance = Matrix3<Scalar>::Zero();  // [m^2]
  std::array<int, 3> face{0, 1, 2};  // the three lowest nodes, lowest first
  Scalar surprise = 1;               // mean squared innovation in variances, recently; 1 is right
  RangingHealth health;

  Vector3<Scalar> node(int i) const { return positions.template segment<3>(3 * i); }
};

}  // namespace tensegrity::ukf
