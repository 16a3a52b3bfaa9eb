// Both filters in single precision stay valid, too.
#include "loose_configs.hpp"
#include "shaken_robot.hpp"

using namespace tensegrity::test;
using tensegrity::LooseFilter;
using tensegrity::PrismConfig;
using tensegrity::PrismEstimator;
using tensegrity::TightFilter;

TEST_CASE("float, tight: state and covariance stay valid when shaken") {
  check_valid_when_shaken<PrismEstimator<float, TightFilter<float>>>(PrismConfig<float>());
}

TEST_CASE("float, loose: state and covariance stay valid when shaken") {
  using Estimator = PrismEstimator<float, LooseFilter<float>>;
  check_valid_when_shaken<Estimator>(PrismConfig<float>());
  check_valid_when_shaken<Estimator>(improved_loose_config<float>());
}
