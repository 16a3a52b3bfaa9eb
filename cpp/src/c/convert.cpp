#include "convert.hpp"

#include <cmath>

namespace tensegrity::c {

namespace {

// Every field, once. A structured binding takes exactly as many names as a struct has fields, so
// that a field which is added to one struct alone does not compile.
#define TENSEGRITY_CONFIG_FIELDS(F)                                                                \
  F(shape), F(spin), F(contact_point), F(contact_noise), F(max_shape_iterations), F(imu_sampling), \
      F(static_bias_initialization), F(init_bias_size), F(static_gyro_limit),                      \
      F(static_accel_limit), F(max_imu_gap), F(max_latency), F(chi_square_gate), F(gravity),       \
      F(terrain), F(friction), F(contact_error), F(cable_gate), F(orientation_std),                \
      F(velocity_std), F(position_std), F(gyroscope_bias), F(gyroscope_bias_std),                  \
      F(accelerometer_bias), F(accelerometer_bias_std), F(spin_prior_std), F(cable_offset_std),    \
      F(ground_slope_std), F(gyroscope_std), F(accelerometer_std), F(gyroscope_bias_walk),         \
      F(accelerometer_bias_walk), F(cable_std), F(contact_std), F(contact_position_std),           \
      F(spin_walk), F(shape_std_rest), F(shape_std_moving), F(endcap_acceleration_rest),           \
      F(endcap_acceleration_moving), F(active_force), F(active_rate), F(creep_std),                \
      F(slip_length), F(slip_speed), F(foot_rise_std), F(foot_height_std), F(rod_rate_std),        \
      F(rod_inclination_std), F(ground_height_walk), F(ground_slope_walk)
#define TENSEGRITY_HEALTH_FIELDS(F)                                                       \
  F(imu_dropped), F(imu_gaps), F(cables_dropped), F(contacts_dropped), F(shape_failures), \
      F(contacts_rejected), F(cables_rejected), F(spin_resets), F(velocity_resets),       \
      F(terrain_mismatches)
#define TENSEGRITY_STATE_FIELDS(F)                                                          \
  F(t), F(initialized), F(rotation), F(position), F(velocity), F(gyro_bias), F(accel_bias), \
      F(spin), F(spin_variance), F(endcaps_body), F(endcaps_world), F(endcap_covariance),   \
      F(rotation_covariance), F(velocity_covariance), F(position_covariance), F(contacts),  \
      F(load_shares), F(cable_nis), F(ground_nis), F(health)

#define TENSEGRITY_NAME(field) field
#define TENSEGRITY_ASSIGN(field) assign(from.field, to.field)
#define TENSEGRITY_COPY(FIELDS)                                    \
  {                                                                \
    [[maybe_unused]] const auto& [FIELDS(TENSEGRITY_NAME)] = from; \
  }                                                                \
  {                                                                \
    [[maybe_unused]] const auto& [FIELDS(TENSEGRITY_NAME)] = to;   \
  }                                                                \
  FIELDS(TENSEGRITY_ASSIGN)

// ---- one field

// Numbers, flags, enumerators.
template <typename From, typename To>
void assign(const From& from, To& to) {
  to = static_cast<To>(from);
}
void assign(const Real (&from)[3], Vector3<Real>& to) { to = {from[0], from[1], from[2]}; }
void assign(const Vector3<Real>& from, Real (&to)[3]) { Eigen::Map<Vector3<Real>>{to} = from; }
template <int Size>
void assign(const Matrix<Real, Size>& from, Real (&to)[Size][Size]) {
  Eigen::Map<Eigen::Matrix<Real, Size, Size, Eigen::RowMajor>>{&to[0][0]} = from;
}
// One endcap a column in C++, a row in C: the same bytes.
void assign(const Endcaps<Real>& from, Real (&to)[6][3]) {
  Eigen::Map<Endcaps<Real>>{&to[0][0]} = from;
}
template <typename Element>
void assign(const std::array<Element, 6>& from, Element (&to)[6]) {
  for (std::size_t i = 0; i < 6; ++i) to[i] = from[i];
}
void assign(const PrismHealth& from, tensegrity_health& to) {
  TENSEGRITY_COPY(TENSEGRITY_HEALTH_FIELDS);
}

// ---- what can be

bool below(int enumerator, int count) { return enumerator >= 0 && enumerator < count; }

// The undeformed robot's triangles have to fit between the ends of its rods.
bool has_shape(const Prism<Real>& robot) { return robot.undeformed().allFinite(); }

// The enumerators of both languages have the same numbers.
static_assert(int(Status::kWrongChirality) == TENSEGRITY_WRONG_CHIRALITY &&
              int(Status::kNotInitialized) == TENSEGRITY_NOT_INITIALIZED &&
              int(Status::kNotFinite) == TENSEGRITY_NOT_FINITE &&
              int(Status::kOutOfRange) == TENSEGRITY_OUT_OF_RANGE &&
              int(Status::kDuplicate) == TENSEGRITY_DUPLICATE &&
              int(Status::kOutOfOrder) == TENSEGRITY_OUT_OF_ORDER &&
              int(Status::kTooLate) == TENSEGRITY_TOO_LATE && int(Status::kGap) == TENSEGRITY_GAP &&
              int(Status::kRejected) == TENSEGRITY_REJECTED &&
              int(Status::kNotConverged) == TENSEGRITY_NOT_CONVERGED);
static_assert(int(Chirality::kClockwise) == TENSEGRITY_CLOCKWISE &&
              int(ShapeMethod::kTracker) == TENSEGRITY_SHAPE_TRACKER &&
              int(SpinMethod::kEstimated) == TENSEGRITY_SPIN_ESTIMATED &&
              int(ContactPoint::kRolling) == TENSEGRITY_CONTACT_ROLLING &&
              int(ContactNoise::kFromShape) == TENSEGRITY_NOISE_FROM_SHAPE &&
              int(ImuSampling::kInstantaneous) == TENSEGRITY_IMU_INSTANTANEOUS &&
              int(Terrain::kSlope) == TENSEGRITY_TERRAIN_SLOPE &&
              int(Terrain::kUnknown) == TENSEGRITY_TERRAIN_UNKNOWN);

}  // namespace

tensegrity_status check(const tensegrity_robot& robot) {
  for (const Real length :
       {robot.rod_length, robot.imu_offset, robot.endcap_radius, robot.side_length}) {
    if (!std::isfinite(length)) return TENSEGRITY_NOT_FINITE;
  }
  const bool positive = robot.rod_length > 0 && robot.endcap_radius > 0 && robot.side_length > 0;
  if (!positive || std::abs(robot.imu_offset) > robot.rod_length / 2 ||
      !below(robot.chirality, 2) || !has_shape(to_cpp(robot))) {
    return TENSEGRITY_OUT_OF_RANGE;
  }
  return TENSEGRITY_OK;
}

tensegrity_status check(const tensegrity_config& c) {
  const Real positive[] = {c.static_gyro_limit,
                           c.static_accel_limit,
                           c.max_imu_gap,
                           c.gravity,
                           c.friction,
                           c.contact_error,
                           c.gyroscope_std,
                           c.accelerometer_std,
                           c.cable_std,
                           c.contact_position_std,
                           c.shape_std_rest,
                           c.shape_std_moving,
                           c.endcap_acceleration_rest,
                           c.endcap_acceleration_moving,
                           c.active_force,
                           c.active_rate,
                           c.creep_std,
                           c.slip_speed,
                           c.foot_rise_std,
                           c.foot_height_std,
                           c.rod_rate_std,
                           c.rod_inclination_std};
  const Real not_negative[] = {c.max_latency,
                               c.chi_square_gate,
                               c.cable_gate,
                               c.orientation_std,
                               c.velocity_std,
                               c.position_std,
                               c.gyroscope_bias_std,
                               c.accelerometer_bias_std,
                               c.spin_prior_std,
                               c.cable_offset_std,
                               c.ground_slope_std,
                               c.gyroscope_bias_walk,
                               c.accelerometer_bias_walk,
                               c.contact_std,
                               c.spin_walk,
                               c.slip_length,
                               c.ground_height_walk,
                               c.ground_slope_walk};
  bool finite = true, in_range = true;
  for (const Real value : positive) {
    finite = finite && std::isfinite(value);
    in_range = in_range && value > 0;
  }
  for (const Real value : not_negative) {
    finite = finite && std::isfinite(value);
    in_range = in_range && value >= 0;
  }
  for (int i = 0; i < 3; ++i) {
    finite = finite && std::isfinite(c.gyroscope_bias[i]) && std::isfinite(c.accelerometer_bias[i]);
  }
  if (!finite) return TENSEGRITY_NOT_FINITE;
  in_range = in_range && c.init_bias_size >= 1 && c.max_shape_iterations >= 1 &&
             c.chi_square_gate < 1 && c.contact_error < Real(0.5) && below(c.shape, 2) &&
             below(c.spin, 2) && below(c.contact_point, 2) && below(c.contact_noise, 2) &&
             below(c.imu_sampling, 2) && below(c.terrain, 3);
  return in_range ? TENSEGRITY_OK : TENSEGRITY_OUT_OF_RANGE;
}

Prism<Real> to_cpp(const tensegrity_robot& robot) {
  Prism<Real> prism;
  prism.rod_length = robot.rod_length;
  prism.imu_offset = robot.imu_offset;
  prism.endcap_radius = robot.endcap_radius;
  prism.side_length = robot.side_length;
  prism.chirality = static_cast<Chirality>(robot.chirality);
  return prism;
}

PrismConfig<Real> to_cpp(const tensegrity_config& from) {
  PrismConfig<Real> to;
  TENSEGRITY_COPY(TENSEGRITY_CONFIG_FIELDS);
  return to;
}

tensegrity_config to_c(const PrismConfig<Real>& from) {
  tensegrity_config to;
  TENSEGRITY_COPY(TENSEGRITY_CONFIG_FIELDS);
  return to;
}

void to_c(const PrismState<Real>& from, tensegrity_state& to) {
  TENSEGRITY_COPY(TENSEGRITY_STATE_FIELDS);
}

}  // namespace tensegrity::c
