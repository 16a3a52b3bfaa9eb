// A robot on its feet that is shaken, for the tests of the streaming estimators, and what must hold
// for every filter behind them.
#pragma once

#include <doctest/doctest.h>

#include <array>
#include <cstdlib>
#include <limits>
#include <random>

#include "allocations.hpp"
#include "tensegrity/estimator/prism_estimator.hpp"

namespace tensegrity::test {

inline constexpr Nanoseconds kStep = 5'000'000;  // of the IMU
inline constexpr std::array<bool, 6> kFeet{true, false, false, true, false, true};

// Symmetric, and positive semi-definite up to rounding of `epsilon` in units of each state's own
// standard deviation.
void check_covariance(const Eigen::MatrixXd& p, double epsilon);

template <typename Scalar, int Extra, int Anchors>
void check_valid(const inekf::Belief<Scalar, Extra, Anchors>& belief) {
  REQUIRE(belief.finite());
  const int n = belief.dim();
  check_covariance(belief.complete_covariance().topLeftCorner(n, n).template cast<double>(),
                   double(std::numeric_limits<Scalar>::epsilon()));
}
template <typename Scalar>
void check_valid(const tight::Belief<Scalar>& belief) {
  REQUIRE(belief.finite());
  check_covariance(belief.complete_covariance().template cast<double>(),
                   double(std::numeric_limits<Scalar>::epsilon()));
}

// Stands on endcaps 0, 3 and 5; when it is not quiet its IMU is shaken, its contact flags are
// chance, and only its cables know that nothing happens.
template <typename Scalar>
class Shaken {
 public:
  using V3 = Vector3<Scalar>;

  Shaken() {
    const Endcaps<Scalar> q = robot.undeformed();
    for (int k = 0; k < 9; ++k) {
      const Cable cable = kPrismCables[std::size_t(k)];
      lengths[k] = (q.col(cable.from) - q.col(cable.to)).norm();
    }
    const V3 a = q.col(3) - q.col(0), b = q.col(5) - q.col(0);
    up = a.cross(b).normalized();
    if (up.dot(q.col(2) - q.col(0)) < 0) up = -up;
  }

  // Drawn one by one: compilers evaluate the arguments of a call in an order of their own, and the
  // robot is to be shaken alike on every processor.
  V3 noise(Scalar size) {
    V3 result;
    for (int axis = 2; axis >= 0; --axis) result[axis] = size * Scalar(normal(random));
    return result;
  }

  // IMU steps from `first` to before `last`, cables at every other.
  template <typename Estimator>
  void run(Estimator& estimator, int first, int last, bool quiet) {
    for (int k = first; k < last; ++k) {
      const Nanoseconds t = k * kStep;
      std::array<bool, 6> flags = kFeet;
      if (!quiet) {
        for (bool& flag : flags) flag = random() % 3 == 0;
      }
      estimator.contacts(t, flags);
      if (k % 2 == 0) {
        CableLengths<Scalar> measured = lengths;
        for (int c = 0; c < 9; ++c) measured[c] += Scalar(0.002 * normal(random));
        estimator.cables(t, measured);
      }
      const Scalar shake = quiet ? Scalar(0) : (random() % 50 == 0 ? Scalar(80) : Scalar(3));
      const V3 accel = Scalar(9.81) * up + noise(Scalar(0.043)) + noise(shake);
      const V3 gyro = noise(Scalar(0.002)) + noise(shake / 10);
      estimator.imu(t, gyro, accel);
    }
  }

  Prism<Scalar> robot;
  CableLengths<Scalar> lengths;
  V3 up;  // body
  std::mt19937 random{3};
  std::normal_distribution<double> normal;
};

// ---- what holds for every filter

template <typename Estimator, typename Scalar>
void check_no_heap(const PrismConfig<Scalar>& config) {
  Shaken<Scalar> world;
  Estimator estimator(world.robot, config);
  const long before = testing::allocations();
  world.run(estimator, 0, 500, true);      // the start
  world.run(estimator, 500, 2500, false);  // everything that can happen
  const auto state = estimator.state();
  const long counted = testing::allocations() - before;
  CHECK(state.initialized);
  CHECK(counted == 0);
  // The counter itself works.
  void* volatile block = std::malloc(8);
  std::free(block);
  int* volatile number = new int(3);
  delete number;
  CHECK(testing::allocations() >= before + counted + 2);
}

template <typename Estimator, typename Scalar>
void check_valid_when_shaken(const PrismConfig<Scalar>& config) {
  Shaken<Scalar> world;
  Estimator estimator(world.robot, config);
  world.run(estimator, 0, 500, true);
  REQUIRE(estimator.initialized());
  check_valid(estimator.filter().belief());
  for (int k = 500; k < 2500; k += 100) {
    world.run(estimator, k, k + 100, false);
    check_valid(estimator.filter().belief());
  }
}

template <typename Estimator>
void check_stands_still(const PrismConfig<double>& config) {
  Shaken<double> world;
  Estimator estimator(world.robot, config);
  world.run(estimator, 0, 2000, true);
  const auto state = estimator.state();
  REQUIRE(state.initialized);
  CHECK(state.position.template head<2>().norm() < 0.05);
  CHECK(state.position.template head<2>().norm() <
        4 * std::sqrt(state.position_covariance.template topLeftCorner<2, 2>().trace()));
  CHECK(state.velocity.norm() < 4 * std::sqrt(state.velocity_covariance.trace()));
  for (const int foot : {0, 3, 5}) {
    CHECK(state.endcaps_world(2, foot) == doctest::Approx(world.robot.endcap_radius).epsilon(0.3));
  }
  CHECK(state.contacts == kFeet);
}

// Starts when it stands still, not before.
template <typename Estimator>
void check_starts_at_rest(const PrismConfig<double>& config) {
  Shaken<double> world;
  Estimator estimator(world.robot, config);
  world.run(estimator, 0, 2000, false);
  CHECK_FALSE(estimator.initialized());
  world.run(estimator, 2000, 3000, true);
  CHECK(estimator.initialized());
}

// Samples that cannot be used are dropped, counted and change nothing.
template <typename Estimator>
void check_drops_bad_samples(const PrismConfig<double>& config) {
  Shaken<double> world;
  Estimator estimator(world.robot, config);
  world.run(estimator, 0, 1000, true);
  const Nanoseconds now = 999 * kStep;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const Vector3<double> still = Vector3<double>::Zero(), force = 9.81 * world.up;
  const auto before = estimator.state();
  const auto covariance = estimator.filter().belief().covariance;

  CHECK(estimator.imu(now + 1, {0, nan, 0}, force) == Status::kNotFinite);
  CHECK(estimator.imu(now + 1, still, {inf, 0, 0}) == Status::kNotFinite);
  CHECK(estimator.imu(now + 1, {1e30, 0, 0}, force) == Status::kOutOfRange);
  CHECK(estimator.imu(now, still, force) == Status::kDuplicate);
  CHECK(estimator.imu(now - 1, still, force) == Status::kOutOfOrder);
  CableLengths<double> bad = CableLengths<double>::Constant(nan);
  CHECK(estimator.cables(now, bad) == Status::kNotFinite);
  bad = world.lengths;
  bad[3] = inf;
  CHECK(estimator.cables(now, bad) == Status::kNotFinite);
  bad[3] = -1;
  CHECK(estimator.cables(now, bad) == Status::kOutOfRange);
  bad[3] = 1e6;
  CHECK(estimator.cables(now, bad) == Status::kOutOfRange);
  CHECK(estimator.cables(now - kStep, world.lengths) == Status::kDuplicate);
  CHECK(estimator.cables(now - kStep - 1, world.lengths) == Status::kOutOfOrder);
  CHECK(estimator.contacts(now - kStep, {}) == Status::kOutOfOrder);
  CHECK(estimator.contacts(now, {}) == Status::kDuplicate);

  const auto after = estimator.state();
  CHECK(after.position == before.position);
  CHECK(after.rotation == before.rotation);
  CHECK(after.endcaps_world == before.endcaps_world);
  CHECK(estimator.filter().belief().covariance == covariance);
  CHECK(after.health.imu_dropped == before.health.imu_dropped + 5);
  CHECK(after.health.cables_dropped == before.health.cables_dropped + 6);
  CHECK(after.health.contacts_dropped == before.health.contacts_dropped + 2);
}

template <typename Estimator>
void check_drops_late_samples(const PrismConfig<double>& config) {
  Shaken<double> world;
  Estimator estimator(world.robot, config);
  for (int k = 0; k < 600; ++k) {
    if (k < 500) estimator.cables(k * kStep, world.lengths);
    estimator.imu(k * kStep, Vector3<double>::Zero(), 9.81 * world.up);
  }
  CHECK(estimator.cables(520 * kStep, world.lengths) == Status::kTooLate);  // 0.4 s
  CHECK(estimator.cables(595 * kStep, world.lengths) == Status::kOk);       // 20 ms
}

// Cables and contacts ahead of the IMU wait for it; the step is split at their stamps.
template <typename Estimator>
void check_calls_ahead_come_in_any_order(const PrismConfig<double>& config) {
  Shaken<double> early_world, late_world;
  Estimator early(early_world.robot, config), late(late_world.robot, config);
  early_world.run(early, 0, 600, true);
  late_world.run(late, 0, 600, true);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int k = 600; k < 1000; ++k) {
    const Nanoseconds t = k * kStep, between = t - 2'000'000;
    const Vector3<double> gyro(normal(random), normal(random), normal(random));
    const Vector3<double> accel = 9.81 * early_world.up + gyro;
    early.cables(between, early_world.lengths);
    early.contacts(between - 1000, kFeet);
    early.imu(t, gyro, accel);
    late.contacts(between - 1000, kFeet);
    late.cables(between, late_world.lengths);
    late.imu(t, gyro, accel);
  }
  CHECK(early.state().position == late.state().position);
  CHECK(early.filter().belief().covariance == late.filter().belief().covariance);
}

template <typename Estimator>
void check_gaps_widen(const PrismConfig<double>& config) {
  Shaken<double> world;
  Estimator estimator(world.robot, config);
  world.run(estimator, 0, 1000, true);
  const Nanoseconds now = 999 * kStep;
  const auto before = estimator.state();
  const Vector3<double> gyro(0.5, 0, 0);
  CHECK(estimator.imu(now + 200'000'000, gyro, 10.5 * world.up) == Status::kGap);
  const auto bridged = estimator.state();
  CHECK(bridged.velocity_covariance.trace() > 2 * before.velocity_covariance.trace());
  check_valid(estimator.filter().belief());
  CHECK(estimator.imu(now + 30'000'000'000, Vector3<double>::Zero(), 9.81 * world.up) ==
        Status::kGap);
  const auto lost = estimator.state();
  CHECK(lost.health.imu_gaps == before.health.imu_gaps + 2);
  CHECK(lost.position_covariance.trace() > 100);
  check_valid(estimator.filter().belief());
}

// Without an IMU they would pile up.
template <typename Estimator>
void check_bounds_waiting(const PrismConfig<double>& config) {
  Shaken<double> world;
  Estimator estimator(world.robot, config);
  for (int k = 0; k < 1000; ++k) estimator.cables(k * 10'000'000LL, world.lengths);
  CHECK(estimator.state().health.cables_dropped == 1000 - 16);
}

}  // namespace tensegrity::test
