// Everything that can be set about the prism's estimator, in one plain struct.
//
// The defaults are those of the packaged profiles: T's method for the loosely coupled filter
// (`paper`), the tuned values for the tightly coupled one (`full`). Python fills this struct from
// YAML, where every field has the same name (python/tensegrity/config.py).
#pragma once

#include <cstdint>

#include "tensegrity/types.hpp"

namespace tensegrity {

enum class ShapeMethod : std::uint8_t {
  kLeastSquares,  // T eq. 15a for every sample, warm-started
  kTracker,       // a filter over the shape that knows its fold
};
enum class SpinMethod : std::uint8_t {
  kFixed,      // phi stays what the static start found
  kEstimated,  // phi is a filter state
};
enum class ContactPoint : std::uint8_t {
  kCentre,   // the endcap's centre stands still while in contact (T)
  kRolling,  // the endcap is a sphere that rolls without slip
};
enum class ContactNoise : std::uint8_t {
  kConstant,   // one standard deviation for all endcaps (T)
  kFromShape,  // the joint covariance of the shape reconstruction
};
enum class ImuSampling : std::uint8_t {
  kIntervalMean,   // a sample is the mean over the interval that ends at its stamp
  kInstantaneous,  // a sample is the value at its stamp
};
// What the ground is declared to be. Only the tightly coupled filter uses it.
enum class Terrain : std::uint8_t {
  kFlat,     // one level plane
  kSlope,    // one plane of unknown slope
  kUnknown,  // a plane that changes on the way
};

template <typename Scalar = double>
struct PrismConfig {
  // settings
  // how the loosely coupled filter works
  ShapeMethod shape = ShapeMethod::kLeastSquares;
  SpinMethod spin = SpinMethod::kFixed;
  ContactPoint contact_point = ContactPoint::kCentre;
  ContactNoise contact_noise = ContactNoise::kConstant;
  int max_shape_iterations = 50;  // of a sample's least squares; a bound on the time it may take
  // every filter
  ImuSampling imu_sampling = ImuSampling::kIntervalMean;
  bool static_bias_initialization = true;
  int init_bias_size = 400;                 // samples that have to be still in a row
  Scalar static_gyro_limit = Scalar(0.02);  // standard deviation while still [rad/s]
  Scalar static_accel_limit = Scalar(0.3);  // standard deviation while still [m/s^2]
  Scalar max_imu_gap = Scalar(0.05);        // a longer step counts as missing samples [s]
  Scalar max_latency = Scalar(0.05);        // cables and contacts older than this are dropped [s]
  Scalar chi_square_gate = Scalar(0);       // probability of the contact gate; 0: no gate
  Scalar gravity = Scalar(9.81);            // [m/s^2]
  // the tightly coupled filter
  Terrain terrain = Terrain::kFlat;
  Scalar friction = Scalar(0.7);       // coefficient of the ground, matters on slopes alone
  Scalar contact_error = Scalar(0.1);  // share of contact flags that are wrong
  Scalar cable_gate = Scalar(6);       // cables: innovations beyond so many sigmas are left out

  // priors: standard deviations at the start
  Scalar orientation_std = Scalar(0.02);                         // roll and pitch [rad]
  Scalar velocity_std = Scalar(0.01);                            // [m/s]
  Scalar position_std = Scalar(0.001);                           // [m]
  Vector3<Scalar> gyroscope_bias = Vector3<Scalar>::Zero();      // [rad/s]
  Scalar gyroscope_bias_std = Scalar(0.005);                     // [rad/s]
  Vector3<Scalar> accelerometer_bias = Vector3<Scalar>::Zero();  // [m/s^2]
  Scalar accelerometer_bias_std = Scalar(0.05);                  // [m/s^2]
  Scalar spin_prior_std = Scalar(0.1);                           // [rad]
  Scalar cable_offset_std = Scalar(0.005);                       // constant error of a cable [m]
  Scalar ground_slope_std = Scalar(0.1);                         // at the start

  // noises: standard deviations
  Scalar gyroscope_std = Scalar(0.002);            // of one sample [rad/s]
  Scalar accelerometer_std = Scalar(0.043);        // of one sample [m/s^2]
  Scalar gyroscope_bias_walk = Scalar(0.001);      // [rad/s/sqrt(s)]
  Scalar accelerometer_bias_walk = Scalar(0.001);  // [m/s^2/sqrt(s)]
  Scalar cable_std = Scalar(0.0035);               // [m]
  // the loosely coupled filter alone
  Scalar contact_std = Scalar(0.05);           // random walk of a contact point [m/sqrt(s)]
  Scalar contact_position_std = Scalar(0.05);  // contact kinematics, white part [m]
  Scalar spin_walk = Scalar(0.1);              // [rad/sqrt(s)]
  Scalar shape_std_rest = Scalar(0.01);        // shape at rest [m/sqrt(s)]
  Scalar shape_std_moving = Scalar(0.1);       // shape while rolling or falling [m/sqrt(s)]
  // the tightly coupled filter alone: endcaps (tight/propagate.hpp), feet (tight/friction.hpp)
  Scalar endcap_acceleration_rest = Scalar(0.12);   // white, at rest [m/s/sqrt(s)]
  Scalar endcap_acceleration_moving = Scalar(2.5);  // at full activity [m/s/sqrt(s)]
  Scalar active_force = Scalar(4.3);          // deviation from gravity at full activity [m/s^2]
  Scalar active_rate = Scalar(1.1);           // rate at full activity [rad/s]
  Scalar creep_std = Scalar(0.009);           // of a foot that stands still [m/sqrt(s)]
  Scalar slip_length = Scalar(0.006);         // scale of friction's likelihood [m]
  Scalar slip_speed = Scalar(0.03);           // above it a foot informs across its slip [m/s]
  Scalar foot_rise_std = Scalar(0.024);       // speed off the ground [m/sqrt(s)]
  Scalar foot_height_std = Scalar(0.00125);   // height above the ground [m sqrt(s)]
  Scalar rod_rate_std = Scalar(0.2);          // other rods' IMUs: turn across the rod [rad/s]
  Scalar rod_inclination_std = Scalar(0.02);  // other rods' IMUs: u . e_z in quiet [1]
  Scalar ground_height_walk = Scalar(0.005);  // terrain unknown, moving [m/sqrt(s)]
  Scalar ground_slope_walk = Scalar(0.01);    // terrain unknown, moving [1/sqrt(s)]
};

}  // namespace tensegrity
