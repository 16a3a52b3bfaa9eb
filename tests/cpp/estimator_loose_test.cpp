// The streaming estimator with the loosely coupled filter, as T published it and with all its
// improvements: no heap in the hot path, defined effects of bad samples, a valid state after any
// input. Accuracy is tested from Python on whole recordings.
#include "loose_configs.hpp"
#include "shaken_robot.hpp"

namespace {

using namespace tensegrity::test;
using tensegrity::CableLengths;
using tensegrity::PrismConfig;
using tensegrity::Status;
using Estimator = tensegrity::PrismEstimator<double, tensegrity::LooseFilter<double>>;

const PrismConfig<double> kPaper;
const PrismConfig<double> kImproved = improved_loose_config<double>();

}  // namespace

TEST_CASE("loose: the hot path never touches the heap") {
  check_no_heap<Estimator>(kPaper);
  check_no_heap<Estimator>(kImproved);
}

TEST_CASE("loose: state and covariance stay valid when shaken") {
  check_valid_when_shaken<Estimator>(kPaper);
  check_valid_when_shaken<Estimator>(kImproved);
}

TEST_CASE("loose: a robot that stands still starts level, and stays where it is") {
  check_stands_still<Estimator>(kImproved);
}

TEST_CASE("loose: it does not start while it moves") { check_starts_at_rest<Estimator>(kPaper); }

TEST_CASE("loose: samples that cannot be used are dropped, counted and change nothing") {
  check_drops_bad_samples<Estimator>(kImproved);
}

TEST_CASE("loose: measurements too late for the state are dropped") {
  check_drops_late_samples<Estimator>(kPaper);
}

TEST_CASE("loose: calls ahead of the IMU may come in any order") {
  check_calls_ahead_come_in_any_order<Estimator>(kImproved);
}

TEST_CASE("loose: gaps widen the covariance and are counted") {
  check_gaps_widen<Estimator>(kImproved);
}

TEST_CASE("loose: after a long gap no foot is where it was") {
  Shaken<double> world;
  Estimator estimator(world.robot, kImproved);
  world.run(estimator, 0, 1000, true);
  CHECK(estimator.state().contacts == kFeet);
  estimator.imu(10'000 * kStep, tensegrity::Vector3<double>::Zero(), 9.81 * world.up);
  CHECK(estimator.state().contacts == std::array<bool, 6>{});
}

TEST_CASE("loose: a shape needs all nine cables") {
  Shaken<double> world;
  Estimator estimator(world.robot, kImproved);
  world.run(estimator, 0, 1000, true);
  const auto before = estimator.state();
  CableLengths<double> some = world.lengths;
  some[3] = std::numeric_limits<double>::quiet_NaN();
  CHECK(estimator.cables(999 * kStep, some) == Status::kNotFinite);
  const auto after = estimator.state();
  CHECK(after.health.cables_dropped == before.health.cables_dropped + 1);
  CHECK(after.endcaps_world == before.endcaps_world);
}
