// The streaming estimator with the tightly coupled filter: no heap in the hot path, defined effects
// of bad samples, a valid state after any input. Accuracy is tested from Python on whole
// recordings.
#include "shaken_robot.hpp"

namespace {

using namespace tensegrity::test;
using tensegrity::CableLengths;
using tensegrity::PrismConfig;
using tensegrity::Status;
using Estimator = tensegrity::PrismEstimator<double, tensegrity::TightFilter<double>>;
using Eigen::Vector3d;

const PrismConfig<double> kConfig;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("tight: the hot path never touches the heap") { check_no_heap<Estimator>(kConfig); }

TEST_CASE("tight: state and covariance stay valid when shaken") {
  for (const auto terrain : {tensegrity::Terrain::kFlat, tensegrity::Terrain::kUnknown}) {
    PrismConfig<double> config;
    config.terrain = terrain;
    check_valid_when_shaken<Estimator>(config);
  }
}

TEST_CASE("tight: a robot that stands still starts level, and stays where it is") {
  check_stands_still<Estimator>(kConfig);
}

TEST_CASE("tight: it does not start while it moves") { check_starts_at_rest<Estimator>(kConfig); }

TEST_CASE("tight: samples that cannot be used are dropped, counted and change nothing") {
  check_drops_bad_samples<Estimator>(kConfig);
}

TEST_CASE("tight: measurements too late for the state are dropped") {
  check_drops_late_samples<Estimator>(kConfig);
}

TEST_CASE("tight: calls ahead of the IMU may come in any order") {
  check_calls_ahead_come_in_any_order<Estimator>(kConfig);
}

TEST_CASE("tight: gaps widen the covariance and are counted") {
  check_gaps_widen<Estimator>(kConfig);
}

TEST_CASE("tight: measurements without an IMU do not pile up") {
  check_bounds_waiting<Estimator>(kConfig);
}

TEST_CASE("tight: a cable without a measurement is NaN, the others are used") {
  Shaken<double> world;
  Estimator estimator(world.robot, kConfig);
  world.run(estimator, 0, 1000, true);
  const auto before = estimator.state();
  const CableLengths<double> all = world.lengths;
  for (int k = 1000; k < 2000; k += 2) {
    CableLengths<double> some = all;
    some[k / 100 % 9] = kNan;  // one fails after the other
    some[4] = kNan;            // one for good
    REQUIRE(estimator.cables(k * kStep, some) == Status::kOk);
    for (int i = 0; i < 2; ++i) {
      estimator.imu((k + i) * kStep, Vector3d::Zero(), 9.81 * world.up);
    }
  }
  const auto after = estimator.state();
  CHECK(after.health.cables_dropped == before.health.cables_dropped);
  CHECK((after.endcaps_world - before.endcaps_world).cwiseAbs().maxCoeff() < 0.01);
  check_valid(estimator.filter().belief());
}

TEST_CASE("tight: a cable that jumps is rejected and counted, the shape stays") {
  Shaken<double> world;
  Estimator estimator(world.robot, kConfig);
  world.run(estimator, 0, 1000, true);
  const auto before = estimator.state();
  CableLengths<double> jumped = world.lengths;
  jumped[2] += 0.3;
  CHECK(estimator.cables(1000 * kStep, jumped) == Status::kOk);
  estimator.imu(1000 * kStep, Vector3d::Zero(), 9.81 * world.up);
  const auto after = estimator.state();
  CHECK(after.health.cables_rejected == before.health.cables_rejected + 1);
  CHECK((after.endcaps_body - before.endcaps_body).cwiseAbs().maxCoeff() < 0.005);
}

TEST_CASE("tight: a shape that was lost is found again, for the most part") {
  Shaken<double> world;
  Estimator estimator(world.robot, kConfig);
  world.run(estimator, 0, 1000, true);
  const auto before = estimator.state();
  const CableLengths<double> lengths = world.lengths;
  // Half a second of nonsense that does not contradict itself from sample to sample.
  for (int k = 0; k < 9; ++k) world.lengths[k] *= 1 + 0.25 * std::sin(2.5 * k);
  world.run(estimator, 1000, 1100, true);
  check_valid(estimator.filter().belief());
  const auto error = [&] {  // [m]
    return (estimator.state().endcaps_body - before.endcaps_body).cwiseAbs().maxCoeff();
  };
  const double lost = error();
  CHECK(lost > 0.3);
  world.lengths = lengths;
  world.run(estimator, 1100, 2000, true);
  check_valid(estimator.filter().belief());
  // What is left depends on the noise to its last bit: 0.2 to 0.36 for twenty seeds of it.
  CHECK(error() < 0.5 * lost);
  const auto settled = estimator.state().health.cables_rejected;
  world.run(estimator, 2000, 2100, true);
  CHECK(estimator.state().health.cables_rejected == settled);
}
