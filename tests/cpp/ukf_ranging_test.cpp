// RangingEstimator on a robot that stands still: start, accuracy, gates, and the rules of stamps.
#include <cmath>
#include <limits>
#include <random>

#include "allocations.hpp"
#include "doctest/doctest.h"
#include "tensegrity/math/so3.hpp"
#include "tensegrity/ukf/ranging_estimator.hpp"

using namespace tensegrity;
using namespace tensegrity::ukf;

namespace {

constexpr std::int64_t kPeriod = 100'000'000;  // [ns]

// A world without forces: what a net would do is the business of the tests of the dynamics.
struct FreeFlight {
  template <typename Scalar>
  Status step(MatrixRef<Scalar> states, const ConstVectorRef<Scalar>&, Scalar dt, int steps) {
    const Eigen::Index n = states.cols() / 2;
    states.leftCols(n) += Scalar(steps) * dt * states.rightCols(n);
    // Friction: without it velocities would be random walks.
    states.rightCols(n) *= Scalar(0.5);
    return Status::kOk;
  }
};

struct Drift {
  Status step(MatrixRef<double> states, const ConstVectorRef<double>& lengths, double dt,
              int steps) {
    return FreeFlight().step<double>(states, lengths, dt, steps);
  }
};

RangingRobot<double> superball() {
  const double a = 0.425, b = 0.85;
  RangingRobot<double> robot;
  robot.nodes = {{-a, -b, 0}, {-a, b, 0}, {0, a, b},  {0, a, -b},  {-b, 0, a},  {b, 0, a},
                 {a, b, 0},   {a, -b, 0}, {0, -a, b}, {0, -a, -b}, {-b, 0, -a}, {b, 0, -a}};
  for (int k = 0; k < 12; k += 2) robot.rods.push_back({k, k + 1});
  return robot;
}

RangingAnchors<double> anchors() {
  RangingAnchors<double> result;
  result.positions = {{5, 4, 0.4}, {-5, 4, 2.5}, {-5, -4, 0.5}, {5, -4, 3}, {0, 6, 4}};
  result.offsets = MatrixX<double>::Constant(12, 5, 3.9);
  result.offset_std = MatrixX<double>::Constant(12, 5, 0.02);
  result.internal_offsets = MatrixX<double>::Constant(12, 12, 3.9);
  return result;
}

// The robot on the face of nodes 5, 7, 8, turned about the vertical by `heading`.
struct World {
  RangingRobot<double> robot = superball();
  RangingAnchors<double> fixed = anchors();
  VectorX<double> positions = VectorX<double>::Zero(36);
  RangingModel<double> model{robot, fixed, 1};
  std::mt19937 random{5};

  explicit World(double heading) {
    const Vector3<double> down = (robot.nodes[5] + robot.nodes[7] + robot.nodes[8]).normalized();
    const Matrix3<double> turn =
        Eigen::AngleAxisd(heading, Vector3<double>::UnitZ()).toRotationMatrix() *
        tensegrity::shortest_rotation<double>(down, -Vector3<double>::UnitZ());
    const double height = -(turn * robot.nodes[5]).z();
    for (int i = 0; i < 12; ++i) {
      positions.segment<3>(3 * i) =
          turn * robot.nodes[std::size_t(i)] + Vector3<double>(1, -0.5, height);
    }
  }

  double noise(double std) { return std::normal_distribution<double>(0, std)(random); }
  double range(int node, int anchor) {
    return (model.module(positions, node) - fixed.positions[std::size_t(anchor)]).norm() + 3.9 +
           noise(0.05);
  }
  double cosine(int rod) const {
    const Vector3<double> axis = positions.segment<3>(6 * rod) - positions.segment<3>(6 * rod + 3);
    return axis.normalized().z();
  }
  double worst(const RangingState<double>& state) const {
    double result = 0;
    for (int i = 0; i < 12; ++i) {
      result = std::max(result, (state.node(i) - positions.segment<3>(3 * i)).norm());
    }
    return result;
  }
};

using Estimator = RangingEstimator<double, Drift>;

Estimator estimator(const World& world, const RangingConfig<double>& config = {}) {
  return Estimator(world.robot, world.fixed, Drift{}, VectorX<double>::Ones(24), config);
}

// One round: every module ranges half of the anchors, rods tell their inclinations.
template <typename E>
void feed(E& estimator, World& world, std::int64_t t, int round) {
  for (int i = 0; i < 12; ++i) {
    for (int a = 0; a < 5; ++a) {
      if ((i + a + round) % 2 == 0) estimator.range(t, i, a, world.range(i, a));
    }
  }
  for (int r = 0; r < 6; ++r) estimator.inclination(t, r, world.cosine(r));
}

}  // namespace

TEST_CASE("finds a standing robot and the face that is down, wherever it looks") {
  for (const double heading : {0.0, 0.9, 2.4, -1.7}) {
    World world(heading);
    Estimator e = estimator(world);
    for (int k = 0; k <= 30; ++k) feed(e, world, k * kPeriod, k);
    REQUIRE(e.update(31 * kPeriod) == Status::kOk);
    auto face = e.state().face;
    std::sort(face.begin(), face.end());
    CHECK(face == std::array<int, 3>{5, 7, 8});
    CHECK(world.worst(e.state()) < 0.15);
    CHECK(e.state().health.restarts == 0);
    CHECK(e.state().health.ranges_used > 500);
    for (int i = 0; i < 12; ++i) {
      CHECK(std::abs((e.state().node(i) - e.state().node(i ^ 1)).norm() - 1.7) < 0.01);
    }
  }
}

TEST_CASE("wild ranges and inclinations are left out and counted") {
  World world(0.3);
  Estimator e = estimator(world);
  for (int k = 0; k <= 30; ++k) {
    feed(e, world, k * kPeriod, k);
    if (k > 15) {
      e.range(k * kPeriod + 1, k % 12, k % 5, world.range(k % 12, k % 5) + 4);
      e.inclination(k * kPeriod + 1, k % 6, world.cosine(k % 6) > 0 ? -0.9 : 0.9);
    }
  }
  e.update(31 * kPeriod);
  CHECK(e.state().health.ranges_rejected >= 15);
  CHECK(e.state().health.inclinations_rejected >= 10);
  CHECK(world.worst(e.state()) < 0.15);
}

TEST_CASE("a filter that is elsewhere starts again and says so") {
  World here(0), there(2);
  for (int i = 0; i < 12; ++i) there.positions.segment<3>(3 * i).x() += 8;
  Estimator e = estimator(here);
  for (int k = 0; k <= 20; ++k) feed(e, here, k * kPeriod, k);
  for (int k = 21; k <= 80; ++k) feed(e, there, k * kPeriod, k);
  e.update(81 * kPeriod);
  CHECK(e.state().health.restarts >= 1);
  CHECK(there.worst(e.state()) < 0.3);  // outside of its anchors now
}

TEST_CASE("stamps that repeat, come late or from elsewhere are dropped") {
  World world(0);
  Estimator e = estimator(world);
  CHECK(e.update(0) == Status::kNotInitialized);
  for (int k = 0; k <= 15; ++k) feed(e, world, k * kPeriod, k);
  REQUIRE(e.update(16 * kPeriod) == Status::kOk);
  CHECK(e.update(16 * kPeriod) == Status::kDuplicate);
  CHECK(e.update(15 * kPeriod) == Status::kOutOfOrder);
  const std::int64_t t = 16 * kPeriod;
  CHECK(e.range(t, 0, 0, 8) == Status::kTooLate);
  CHECK(e.range(t + 5, 0, 0, world.range(0, 0)) == Status::kOk);
  CHECK(e.range(t + 5, 0, 0, 8) == Status::kDuplicate);
  CHECK(e.range(t + 4, 0, 0, 8) == Status::kOutOfOrder);
  CHECK(e.range(t + 6, 12, 0, 8) == Status::kOutOfRange);
  CHECK(e.range(t + 6, 0, 5, 8) == Status::kOutOfRange);
  CHECK(e.range(t + 6, 0, 0, 800) == Status::kOutOfRange);
  CHECK(e.range(t + 6, 0, 0, std::nan("")) == Status::kNotFinite);
  CHECK(e.internal_range(t + 6, 3, 3, 5) == Status::kOutOfRange);
  CHECK(e.internal_range(t + 6, 3, 4, 5) == Status::kOk);
  CHECK(e.inclination(t + 6, 6, 0) == Status::kOutOfRange);
  CHECK(e.inclination(t + 6, 0, 1.5) == Status::kOutOfRange);
  CHECK(e.inclination(t + 6, 0, std::nan("")) == Status::kNotFinite);
  CHECK(e.motors(t + 6, VectorX<double>::Ones(3)) == Status::kOutOfRange);
  CHECK(e.motors(t + 6, -VectorX<double>::Ones(24)) == Status::kOutOfRange);
  CHECK(e.motors(t + 6, VectorX<double>::Ones(24)) == Status::kOk);
  CHECK(e.motors(t + 6, VectorX<double>::Ones(24)) == Status::kDuplicate);
  CHECK(e.imu(t + 6, -1, {0, 0, 0}, {0, 0, 9.81}) == Status::kOutOfRange);
  CHECK(e.imu(t + 6, 0, {0, 0, 0}, {0, 0, std::nan("")}) == Status::kNotFinite);
  CHECK(e.imu(t + 6, 1, {0, 35, 0}, {0, 0, 9.81}) == Status::kOutOfRange);
  CHECK(e.imu(t + 7, 1, {0, 1, 0}, {0, 0, 9.81}) == Status::kOk);
  CHECK(e.state().health.imu_rejected == 1);
  CHECK(e.state().health.dropped == 16);

  // Two seconds of silence, then ranges again: a new start.
  CHECK(e.range(t + 20 * kPeriod, 0, 0, world.range(0, 0)) == Status::kGap);
  CHECK_FALSE(e.initialized());
  for (int k = 37; k <= 50; ++k) feed(e, world, k * kPeriod, k);
  CHECK(e.initialized());
  CHECK(e.state().health.gaps == 1);

  // One stamp from another century, and one before all others.
  CHECK(e.range(std::numeric_limits<std::int64_t>::max(), 1, 1, 8) == Status::kGap);
  CHECK(e.range(std::numeric_limits<std::int64_t>::min() + 1, 2, 1, 8) == Status::kOutOfOrder);
  for (int k = 51; k <= 65; ++k) feed(e, world, k * kPeriod, k);
  CHECK(e.initialized());
  CHECK(world.worst(e.state()) < 0.2);
}

TEST_CASE("the order of the calls within an update does not matter") {
  World world(0.5);
  RangingConfig<double> config;
  config.gate = 0;
  Estimator forward = estimator(world, config), backward = estimator(world, config);
  for (int k = 0; k <= 20; ++k) {
    std::vector<std::array<double, 3>> round;
    for (int i = 0; i < 12; ++i) round.push_back({double(i), double((i + k) % 5), 0});
    for (auto& r : round) r[2] = world.range(int(r[0]), int(r[1]));
    for (const auto& r : round) forward.range(k * kPeriod, int(r[0]), int(r[1]), r[2]);
    std::reverse(round.begin(), round.end());
    for (const auto& r : round) backward.range(k * kPeriod, int(r[0]), int(r[1]), r[2]);
  }
  forward.update(21 * kPeriod);
  backward.update(21 * kPeriod);
  REQUIRE(forward.initialized());
  // Sums in another order, and a search that stops when little is left to gain.
  CHECK((forward.state().positions - backward.state().positions).norm() < 1e-4);
}

TEST_CASE("nothing is allocated after construction, and odd input leaves a finite state") {
  World world(1);
  Estimator e = estimator(world);
  for (int k = 0; k <= 20; ++k) feed(e, world, k * kPeriod, k);
  REQUIRE(e.initialized());
  const long before = tensegrity::testing::allocations();
  for (int k = 21; k <= 60; ++k) {
    feed(e, world, k * kPeriod, k);
    e.internal_range(k * kPeriod, k % 12, (k + 1) % 12, 5);
    e.imu(k * kPeriod, k % 12, {0, 0, 1e9}, {0, 0, 9.81});
    e.imu(k * kPeriod + 1, k % 12, {0, 0, 0}, {0, 0, 9.81});
    e.range(k * kPeriod + 2, k % 12, 1, -200);
  }
  CHECK(tensegrity::testing::allocations() == before);
  CHECK(e.state().positions.allFinite());
  CHECK(e.state().velocities.allFinite());
  CHECK(e.state().position_std.allFinite());
}

TEST_CASE("random displacements of a body never stretch its rods") {
  World world(0.2);
  MatrixX<double> covariance(36, 36);
  displacement_covariance<double>(world.positions, world.robot.rods, 0.3, 0.1, covariance);
  CHECK((covariance - covariance.transpose()).norm() < 1e-12);
  for (const auto& rod : world.robot.rods) {
    const Vector3<double> axis =
        (world.positions.segment<3>(3 * rod[1]) - world.positions.segment<3>(3 * rod[0]))
            .normalized();
    VectorX<double> stretch = VectorX<double>::Zero(36);
    stretch.segment<3>(3 * rod[1]) = axis;
    stretch.segment<3>(3 * rod[0]) = -axis;
    CHECK(stretch.dot(covariance * stretch) == doctest::Approx(0).epsilon(1e-9));
  }
  // A rotation and a translation of 0.3 m each, and 0.1 m of each node across its rod.
  double sum = 0;
  for (int i = 0; i < 36; ++i) sum += covariance(i, i) / 12;
  CHECK(sum == doctest::Approx(3 * 0.09 + 2 * 0.09 + 2.5 * 0.01));

  MatrixX<double> noise = MatrixX<double>::Zero(72, 72);
  noise.topLeftCorner(36, 36) = covariance;
  integrate_acceleration<double>(noise, 0.1);
  CHECK((noise.bottomRightCorner(36, 36) - 0.1 * covariance).norm() < 1e-12);
  CHECK((noise.topRightCorner(36, 36) - 0.005 * covariance).norm() < 1e-12);
  CHECK((noise.topLeftCorner(36, 36) - 0.001 / 3 * covariance).norm() < 1e-12);
}
