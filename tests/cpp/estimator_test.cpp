// The whole streaming estimator: no heap in the hot path, defined effects of bad samples, a valid
// state after any input. Accuracy is tested from Python on whole recordings.
#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>
#include <cstdlib>
#include <limits>
#include <random>

#include "allocations.hpp"
#include "tensegrity/estimator/prism_estimator.hpp"

namespace {

using tensegrity::CableLengths;
using tensegrity::Endcaps;
using tensegrity::kPrismCables;
using tensegrity::Nanoseconds;
using tensegrity::Prism;
using tensegrity::PrismConfig;
using tensegrity::PrismEstimator;
using tensegrity::Status;
using tensegrity::Vector3;

template <typename Scalar>
PrismConfig<Scalar> full_config() {
  PrismConfig<Scalar> config;
  config.shape = tensegrity::ShapeMethod::kTracker;
  config.spin = tensegrity::SpinMethod::kEstimated;
  config.contact_point = tensegrity::ContactPoint::kRolling;
  config.contact_noise = tensegrity::ContactNoise::kFromShape;
  config.chi_square_gate = Scalar(0.999);
  return config;
}

// A robot on its feet (0, 3, 5) that, after standing still, is shaken.
template <typename Scalar>
class Shaken {
 public:
  Shaken() {
    const Endcaps<Scalar> q = robot.undeformed();
    for (int k = 0; k < 9; ++k) {
      const auto cable = kPrismCables[std::size_t(k)];
      lengths[k] = (q.col(cable.from) - q.col(cable.to)).norm();
    }
    const Vector3<Scalar> a = q.col(3) - q.col(0), b = q.col(5) - q.col(0);
    up = a.cross(b).normalized();
    if (up.dot(q.col(2) - q.col(0)) < 0) up = -up;
  }

  Vector3<Scalar> noise(Scalar size) {
    return size *
           Vector3<Scalar>(Scalar(normal(random)), Scalar(normal(random)), Scalar(normal(random)));
  }

  // Steps from `first` to before `last` of 5 ms; quiet ones stand still.
  void run(PrismEstimator<Scalar>& estimator, int first, int last, bool quiet) {
    for (int k = first; k < last; ++k) {
      const Nanoseconds t = k * 5'000'000LL;
      std::array<bool, 6> flags{true, false, false, true, false, true};
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
      estimator.imu(t, noise(Scalar(0.002)) + noise(shake / 10),
                    Scalar(9.81) * up + noise(Scalar(0.043)) + noise(shake));
    }
  }

  Prism<Scalar> robot;
  CableLengths<Scalar> lengths;
  Vector3<Scalar> up;
  std::mt19937 random{3};
  std::normal_distribution<double> normal;
};

template <typename Scalar>
void check_valid(const PrismEstimator<Scalar>& estimator) {
  const auto& belief = estimator.belief();
  REQUIRE(belief.finite());
  const int n = belief.dim();
  const auto p = belief.covariance.topLeftCorner(n, n).template cast<double>().eval();
  CHECK((p - p.transpose()).norm() == 0);
  // Positive semi-definite up to rounding, in units of each state's own standard deviation.
  CHECK(p.diagonal().minCoeff() >= 0);
  const Eigen::VectorXd scale =
      p.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * p * scale.asDiagonal();
  const double smallest =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation).eigenvalues().minCoeff();
  CHECK(smallest > -1e3 * double(std::numeric_limits<Scalar>::epsilon()));
}

}  // namespace

TEST_CASE("the hot path never touches the heap") {
  for (const auto& config : {PrismConfig<double>(), full_config<double>()}) {
    Shaken<double> world;
    PrismEstimator<double> estimator(world.robot, config);
    const long before = tensegrity::testing::allocations();
    world.run(estimator, 0, 500, true);      // the start
    world.run(estimator, 500, 2500, false);  // propagation, anchors in and out, gates
    const auto state = estimator.state();
    const long counted = tensegrity::testing::allocations() - before;
    CHECK(state.initialized);
    CHECK(counted == 0);
    // The counter itself works.
    void* volatile block = std::malloc(8);
    std::free(block);
    int* volatile number = new int(3);
    delete number;
    CHECK(tensegrity::testing::allocations() >= before + counted + 2);
  }
}

TEST_CASE_TEMPLATE("state and covariance stay valid when shaken", Scalar, double, float) {
  for (const auto& config : {PrismConfig<Scalar>(), full_config<Scalar>()}) {
    Shaken<Scalar> world;
    PrismEstimator<Scalar> estimator(world.robot, config);
    world.run(estimator, 0, 500, true);
    REQUIRE(estimator.initialized());
    check_valid(estimator);
    for (int k = 500; k < 2500; k += 100) {
      world.run(estimator, k, k + 100, false);
      check_valid(estimator);
    }
  }
}

TEST_CASE("a robot that stands still starts level, and stays where it is") {
  Shaken<double> world;
  PrismEstimator<double> estimator(world.robot, full_config<double>());
  world.run(estimator, 0, 2000, true);
  const auto state = estimator.state();
  REQUIRE(state.initialized);
  CHECK(state.position.head<2>().norm() < 0.01);
  CHECK(state.velocity.norm() < 4 * std::sqrt(state.velocity_covariance.trace()));
  for (const int foot : {0, 3, 5}) {
    CHECK(state.endcaps_world(2, foot) == doctest::Approx(world.robot.endcap_radius).epsilon(0.3));
  }
  CHECK(state.contacts == std::array<bool, 6>{true, false, false, true, false, true});
}

TEST_CASE("it does not start while it moves") {
  Shaken<double> world;
  PrismEstimator<double> estimator(world.robot, PrismConfig<double>());
  world.run(estimator, 0, 2000, false);
  CHECK_FALSE(estimator.initialized());
  world.run(estimator, 2000, 3000, true);
  CHECK(estimator.initialized());
}

TEST_CASE("samples that cannot be used are dropped, counted and change nothing") {
  Shaken<double> world;
  PrismEstimator<double> estimator(world.robot, full_config<double>());
  world.run(estimator, 0, 1000, true);
  const Nanoseconds now = 999 * 5'000'000LL;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d still = Eigen::Vector3d::Zero(), force = 9.81 * world.up;
  const auto before = estimator.state();

  CHECK(estimator.imu(now + 1, {0, nan, 0}, force) == Status::kNotFinite);
  CHECK(estimator.imu(now + 1, still, {inf, 0, 0}) == Status::kNotFinite);
  CHECK(estimator.imu(now + 1, {1e30, 0, 0}, force) == Status::kOutOfRange);
  CHECK(estimator.imu(now, still, force) == Status::kDuplicate);
  CHECK(estimator.imu(now - 1, still, force) == Status::kOutOfOrder);
  CableLengths<double> bad = world.lengths;
  bad[3] = nan;
  CHECK(estimator.cables(now, bad) == Status::kNotFinite);
  bad[3] = -1;
  CHECK(estimator.cables(now, bad) == Status::kOutOfRange);
  bad[3] = 1e6;
  CHECK(estimator.cables(now, bad) == Status::kOutOfRange);
  CHECK(estimator.cables(now - 5'000'000, world.lengths) == Status::kDuplicate);
  CHECK(estimator.cables(now - 6'000'000, world.lengths) == Status::kOutOfOrder);
  CHECK(estimator.contacts(now - 5'000'000, {}) == Status::kOutOfOrder);
  CHECK(estimator.contacts(now, {}) == Status::kDuplicate);

  const auto after = estimator.state();
  CHECK(after.position == before.position);
  CHECK(after.rotation == before.rotation);
  CHECK(after.position_covariance == before.position_covariance);
  CHECK(after.health.imu_dropped == before.health.imu_dropped + 5);
  CHECK(after.health.cables_dropped == before.health.cables_dropped + 5);
  CHECK(after.health.contacts_dropped == before.health.contacts_dropped + 2);
}

TEST_CASE("measurements too late for the state are dropped") {
  Shaken<double> world;
  PrismEstimator<double> estimator(world.robot, PrismConfig<double>());
  for (int k = 0; k < 600; ++k) {
    if (k < 500) estimator.cables(k * 5'000'000LL, world.lengths);
    estimator.imu(k * 5'000'000LL, Eigen::Vector3d::Zero(), 9.81 * world.up);
  }
  CHECK(estimator.cables(520 * 5'000'000LL, world.lengths) == Status::kTooLate);  // 0.4 s
  CHECK(estimator.cables(595 * 5'000'000LL, world.lengths) == Status::kOk);       // 20 ms
}

TEST_CASE("the order of calls at one stamp and before it does not matter") {
  // Cables and contacts ahead of the IMU wait for it; the step is split at their stamps.
  Shaken<double> early_world, late_world;
  const auto config = full_config<double>();
  PrismEstimator<double> early(early_world.robot, config), late(late_world.robot, config);
  early_world.run(early, 0, 600, true);
  late_world.run(late, 0, 600, true);
  const std::array<bool, 6> flags{true, false, false, true, false, true};
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int k = 600; k < 1000; ++k) {
    const Nanoseconds t = k * 5'000'000LL, between = t - 2'000'000LL;
    const Eigen::Vector3d gyro(normal(random), normal(random), normal(random));
    const Eigen::Vector3d accel = 9.81 * early_world.up + gyro;
    // One gets them in advance and shuffled, the other in order of their stamps.
    early.cables(between, early_world.lengths);
    early.contacts(between - 1000, flags);
    early.imu(t, gyro, accel);
    late.contacts(between - 1000, flags);
    late.cables(between, late_world.lengths);
    late.imu(t, gyro, accel);
  }
  CHECK(early.state().position == late.state().position);
  CHECK(early.belief().covariance == late.belief().covariance);
}

TEST_CASE("gaps widen the covariance and are counted") {
  Shaken<double> world;
  PrismEstimator<double> estimator(world.robot, full_config<double>());
  world.run(estimator, 0, 1000, true);
  const Nanoseconds now = 999 * 5'000'000LL;
  const auto before = estimator.state();
  CHECK(estimator.imu(now + 200'000'000, Eigen::Vector3d(0.5, 0, 0), 10.5 * world.up) ==
        Status::kGap);
  const auto bridged = estimator.state();
  CHECK(bridged.velocity_covariance.trace() > 2 * before.velocity_covariance.trace());
  CHECK(estimator.imu(now + 30'000'000'000, Eigen::Vector3d::Zero(), 9.81 * world.up) ==
        Status::kGap);
  const auto lost = estimator.state();
  CHECK(lost.health.imu_gaps == before.health.imu_gaps + 2);
  CHECK(lost.position_covariance.trace() > 100);
  CHECK(lost.contacts == std::array<bool, 6>{});
  check_valid(estimator);
}

TEST_CASE("measurements without an IMU do not pile up") {
  PrismEstimator<double> estimator;
  Shaken<double> world;
  for (int k = 0; k < 1000; ++k) estimator.cables(k * 10'000'000LL, world.lengths);
  CHECK(estimator.state().health.cables_dropped == 1000 - 16);
}
