// The gradient-descent AHRS: against known motion, and against samples that are none.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "allocations.hpp"
#include "tensegrity/ahrs/madgwick.hpp"

namespace {

using tensegrity::Status;
using V3 = tensegrity::Vector3<double>;
using Filter = tensegrity::ahrs::Madgwick<double>;
using Settings = tensegrity::ahrs::MadgwickSettings<double>;

constexpr double kGravity = 9.81;
constexpr double kDt = 0.01;

// What an IMU at rest measures.
V3 force_at(const Eigen::Quaterniond& orientation) {
  return orientation.conjugate() * V3(0, 0, kGravity);
}

double angle_between(const V3& a, const V3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

double tilt_error(const Filter& filter, const Eigen::Quaterniond& truth) {
  return angle_between(filter.orientation().conjugate() * V3::UnitZ(),
                       truth.conjugate() * V3::UnitZ());
}

}  // namespace

TEST_CASE("ahrs: starts level with gravity, in any pose") {
  std::srand(1);
  for (int k = 0; k < 20; ++k) {
    const Eigen::Quaterniond truth = Eigen::Quaterniond::UnitRandom();
    Filter filter;
    REQUIRE(filter.start(force_at(truth)) == Status::kOk);
    CHECK(tilt_error(filter, truth) < 1e-12);
  }
  for (const double sign : {1.0, -1.0}) {
    Filter filter;
    REQUIRE(filter.start(V3(0, 0, sign * kGravity)) == Status::kOk);
    CHECK(filter.inclination_cosine() == doctest::Approx(sign));
  }
}

TEST_CASE("ahrs: follows a turning rod and reports its inclination") {
  Filter filter;
  Eigen::Quaterniond truth = Eigen::Quaterniond::UnitRandom();
  REQUIRE(filter.start(truth) == Status::kOk);
  // M compares the sample with the orientation before it: late by one sample.
  double bound = 0;
  for (int k = 0; k < 2000; ++k) {
    const double t = k * kDt;
    const V3 rate(0.9 * std::sin(1.3 * t), 0.8 * std::cos(0.7 * t), 0.4);
    truth = truth * Eigen::Quaterniond(Eigen::AngleAxisd(rate.norm() * kDt, rate.normalized()));
    REQUIRE(filter.update(rate, force_at(truth), kDt) == Status::kOk);
    bound = std::max(bound, (rate.norm() + 2 * Settings{}.gain) * kDt);
    CHECK(tilt_error(filter, truth) < bound);
  }
  const V3 axis = V3(1, 2, -2) / 3;
  CHECK(std::abs(filter.inclination_cosine() - (truth * V3::UnitZ()).z()) < bound);
  CHECK(std::abs(filter.inclination_cosine(axis) - (truth * axis).z()) < bound);
}

TEST_CASE("ahrs: a wrong inclination decays at twice the gain, no faster") {
  Settings settings;
  settings.gain = 0.1;
  Filter filter(settings);
  const double start = 0.3;  // [rad]
  REQUIRE(filter.start(Eigen::Quaterniond(Eigen::AngleAxisd(start, V3::UnitX()))) == Status::kOk);
  for (int k = 1; k <= 100; ++k) {
    REQUIRE(filter.update(V3::Zero(), V3(0, 0, kGravity), kDt) == Status::kOk);
    const double tilt = std::acos(filter.inclination_cosine());
    CHECK(tilt == doctest::Approx(start - 2 * settings.gain * k * kDt).epsilon(0.01));
  }
}

TEST_CASE("ahrs: the magnetometer finds north") {
  Settings settings;
  settings.gain = 0.5;
  Filter filter(settings);
  const Eigen::Quaterniond truth(Eigen::AngleAxisd(0.8, V3(1, 2, 3).normalized()));
  REQUIRE(filter.start(force_at(truth)) == Status::kOk);
  const V3 field = truth.conjugate() * V3(20, 0, -43);  // [uT], dips downward
  for (int k = 0; k < 3000; ++k) {
    REQUIRE(filter.update(V3::Zero(), force_at(truth), field, kDt) == Status::kOk);
  }
  CHECK(filter.orientation().angularDistance(truth) < 2 * settings.gain * kDt);
}

TEST_CASE("ahrs: a spurious sample within the sensor's scale is forgotten") {
  Filter filter;
  REQUIRE(filter.start(V3(0, 0, kGravity)) == Status::kOk);
  const double gain = Settings{}.gain;
  REQUIRE(filter.update(V3::Zero(), V3(150, -90, -100), kDt) == Status::kOk);
  CHECK(std::acos(filter.inclination_cosine()) <= 2 * gain * kDt * (1 + 1e-6));
  REQUIRE(filter.update(V3(30, 0, 0), V3(0, 0, kGravity), kDt) == Status::kOk);
  const double turned = std::acos(filter.inclination_cosine());
  CHECK(turned == doctest::Approx(30 * kDt).epsilon(0.05));
  const int needed = static_cast<int>(1.05 * turned / (2 * gain * kDt)) + 2;
  for (int k = 0; k < needed; ++k) filter.update(V3::Zero(), V3(0, 0, kGravity), kDt);
  CHECK(std::acos(filter.inclination_cosine()) < 4 * gain * kDt);
}

TEST_CASE("ahrs: samples that are none leave the orientation as it is") {
  Filter filter;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const V3 still = V3::Zero(), gravity(0, 0, kGravity);
  CHECK(filter.update(still, gravity, kDt) == Status::kNotInitialized);
  CHECK(filter.start(V3(still)) == Status::kOutOfRange);
  CHECK(filter.start(V3(nan, 0, 0)) == Status::kNotFinite);
  CHECK(filter.start(Eigen::Quaterniond(2, 0, 0, 0)) == Status::kOutOfRange);
  CHECK_FALSE(filter.started());
  REQUIRE(filter.start(V3(1, 2, 9)) == Status::kOk);
  const Eigen::Vector4d before = filter.orientation().coeffs();
  CHECK(filter.update(V3(0, nan, 0), gravity, kDt) == Status::kNotFinite);
  CHECK(filter.update(still, V3(0, 0, HUGE_VAL), kDt) == Status::kNotFinite);
  CHECK(filter.update(still, gravity, V3(nan, 0, 0), kDt) == Status::kNotFinite);
  CHECK(filter.update(still, gravity, nan) == Status::kNotFinite);
  CHECK(filter.update(V3(0, 0, 1e6), gravity, kDt) == Status::kOutOfRange);
  CHECK(filter.update(still, V3(0, 0, 1e4), kDt) == Status::kOutOfRange);
  CHECK(filter.update(still, gravity, 0.0) == Status::kOutOfRange);
  CHECK(filter.update(still, gravity, 10.0) == Status::kOutOfRange);
  CHECK(filter.orientation().coeffs() == before);
}

TEST_CASE("ahrs: without a direction of gravity the rate alone is used") {
  Filter filter;
  REQUIRE(filter.start(V3(0, 0, kGravity)) == Status::kOk);
  REQUIRE(filter.update(V3(0.2, 0, 0), V3::Zero(), kDt) == Status::kOk);
  CHECK(std::acos(filter.inclination_cosine()) == doctest::Approx(0.2 * kDt).epsilon(1e-4));
}

TEST_CASE("ahrs: single precision is as good as the sensor") {
  tensegrity::ahrs::Madgwick<float> filter;
  Filter reference;
  const V3 force(0.3, -4.0, 8.9);
  REQUIRE(filter.start(tensegrity::Vector3<float>(force.cast<float>())) == Status::kOk);
  REQUIRE(reference.start(force) == Status::kOk);
  std::mt19937 generator(4);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 5000; ++k) {
    const V3 rate(normal(generator), normal(generator), normal(generator));
    REQUIRE(filter.update(rate.cast<float>(), force.cast<float>(), 0.01f) == Status::kOk);
    REQUIRE(reference.update(rate, force, kDt) == Status::kOk);
  }
  CHECK(std::abs(filter.inclination_cosine() - reference.inclination_cosine()) < 1e-4);
  CHECK(std::abs(filter.orientation().norm() - 1) < 1e-6F);
}

TEST_CASE("ahrs: an update allocates nothing") {
  Filter filter;
  REQUIRE(filter.start(V3(0, 0, kGravity)) == Status::kOk);
  const auto before = tensegrity::testing::allocations();
  for (int k = 0; k < 10; ++k) filter.update(V3(0.1, 0.2, 0.3), V3(0, 1, 9), V3(20, 0, -40), kDt);
  CHECK(tensegrity::testing::allocations() == before);
}
