#include "reference.h"

#include <cmath>
#include <variant>

#include "tensegrity/estimator/prism_estimator.hpp"

namespace {

using Real = tensegrity_real;
using Full = tensegrity::PrismEstimator<Real, tensegrity::TightFilter<Real>>;
using Paper = tensegrity::PrismEstimator<Real, tensegrity::LooseFilter<Real>>;
using V3 = tensegrity::Vector3<Real>;

std::variant<std::monostate, Full, Paper> estimator;

template <typename Call>
auto call(const Call& f) {
  Full* full = std::get_if<Full>(&estimator);
  return full != nullptr ? f(*full) : f(std::get<Paper>(estimator));
}

bool same(Real a, Real b) { return a == b || (std::isnan(a) && std::isnan(b)); }

template <typename Derived>
bool same(const Eigen::DenseBase<Derived>& a, const Real* row_major) {
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      if (!same(a(i, j), *row_major++)) return false;
    }
  }
  return true;
}

const char* difference(const tensegrity::PrismState<Real>& a, const tensegrity_state& b) {
  if (a.t != b.t) return "t";
  if (a.initialized != b.initialized) return "initialized";
  if (!same(a.rotation, b.rotation[0])) return "rotation";
  if (!same(a.position, b.position)) return "position";
  if (!same(a.velocity, b.velocity)) return "velocity";
  if (!same(a.gyro_bias, b.gyro_bias)) return "gyro_bias";
  if (!same(a.accel_bias, b.accel_bias)) return "accel_bias";
  if (!same(a.spin, b.spin)) return "spin";
  if (!same(a.spin_variance, b.spin_variance)) return "spin_variance";
  if (!same(a.endcaps_body.transpose(), b.endcaps_body[0])) return "endcaps_body";
  if (!same(a.endcaps_world.transpose(), b.endcaps_world[0])) return "endcaps_world";
  if (!same(a.endcap_covariance, b.endcap_covariance[0])) return "endcap_covariance";
  if (!same(a.rotation_covariance, b.rotation_covariance[0])) return "rotation_covariance";
  if (!same(a.velocity_covariance, b.velocity_covariance[0])) return "velocity_covariance";
  if (!same(a.position_covariance, b.position_covariance[0])) return "position_covariance";
  for (std::size_t i = 0; i < 6; ++i) {
    if (a.contacts[i] != b.contacts[i]) return "contacts";
    if (!same(a.load_shares[i], b.load_shares[i])) return "load_shares";
  }
  if (!same(a.cable_nis, b.cable_nis)) return "cable_nis";
  if (!same(a.ground_nis, b.ground_nis)) return "ground_nis";
  const tensegrity::PrismHealth& h = a.health;
  const tensegrity_health& g = b.health;
  const bool healthy =
      h.imu_dropped == g.imu_dropped && h.imu_gaps == g.imu_gaps &&
      h.cables_dropped == g.cables_dropped && h.contacts_dropped == g.contacts_dropped &&
      h.shape_failures == g.shape_failures && h.contacts_rejected == g.contacts_rejected &&
      h.cables_rejected == g.cables_rejected && h.spin_resets == g.spin_resets &&
      h.velocity_resets == g.velocity_resets && h.terrain_mismatches == g.terrain_mismatches;
  return healthy ? nullptr : "health";
}

}  // namespace

// The library's code of both estimators: what is tested here is the way to it.
extern template class tensegrity::PrismEstimator<Real, tensegrity::TightFilter<Real>>;
extern template class tensegrity::PrismEstimator<Real, tensegrity::LooseFilter<Real>>;

void reference_create(reference_method method) {
  tensegrity::Prism<Real> robot;
  robot.imu_offset = REFERENCE_IMU_OFFSET;
  tensegrity::PrismConfig<Real> config;
  config.cable_std = REFERENCE_CABLE_STD;
  config.init_bias_size = REFERENCE_BIAS_SIZE;
  config.gyroscope_bias = V3(0, REFERENCE_BIAS, 0);
  config.static_bias_initialization = method == REFERENCE_FULL;  // else the bias is that of above
  config.imu_sampling = tensegrity::ImuSampling::kInstantaneous;
  config.terrain = tensegrity::Terrain::kSlope;
  config.shape = tensegrity::ShapeMethod::kTracker;
  if (method == REFERENCE_FULL) {
    estimator.emplace<Full>(robot, config);
  } else {
    estimator.emplace<Paper>(robot, config);
  }
}

int reference_imu(int64_t t, const Real gyro[3], const Real accel[3]) {
  return call([&](auto& e) { return int(e.imu(t, V3(gyro), V3(accel))); });
}
int reference_rod_imu(int64_t t, int rod, const Real gyro[3], const Real accel[3]) {
  return call([&](auto& e) { return int(e.rod_imu(t, rod, V3(gyro), V3(accel))); });
}
int reference_cables(int64_t t, const Real lengths[9]) {
  return call([&](auto& e) { return int(e.cables(t, tensegrity::CableLengths<Real>(lengths))); });
}
int reference_contacts(int64_t t, const bool flags[6]) {
  const std::array<bool, 6> six{flags[0], flags[1], flags[2], flags[3], flags[4], flags[5]};
  return call([&](auto& e) { return int(e.contacts(t, six)); });
}

const char* reference_difference(const tensegrity_state* state) {
  return call([&](auto& e) { return difference(e.state(), *state); });
}
