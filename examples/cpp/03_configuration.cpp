// Your robot and your sensors: plain structs in which you set what differs, in SI units.
#include <cstdio>
#include <tensegrity/estimator/prism_estimator.hpp>

int main() {
  // A longer robot with smaller feet. Everything else is that of the robot of T.
  tensegrity::Prism<double> robot;
  robot.rod_length = 1.6;       // m
  robot.endcap_radius = 0.030;  // m

  // An IMU that gives instantaneous values, ground that slopes, cable lengths with 5 mm of noise.
  tensegrity::PrismConfig<double> config;
  config.imu_sampling = tensegrity::ImuSampling::kInstantaneous;
  config.terrain = tensegrity::Terrain::kSlope;
  config.cable_std = 0.005;     // m
  config.init_bias_size = 200;  // still samples in a row that start it

  tensegrity::PrismEstimator<double> estimator(robot, config);
  std::printf("rods of %.2f m, cables of %.1f mm\n", estimator.robot().rod_length,
              1e3 * estimator.config().cable_std);

  // Estimators are values: a copy is a second one in the same state, assignment starts anew.
  tensegrity::PrismEstimator<double> branch = estimator;
  estimator = tensegrity::PrismEstimator<double>(robot, config);

  // Whatever comes in, a status comes back, and what was dropped is counted.
  const Eigen::Vector3d still = Eigen::Vector3d::Zero();
  const tensegrity::Status first = branch.imu(0, still, {0, 0, 9.81});
  const tensegrity::Status again = branch.imu(0, still, {0, 0, 9.81});
  tensegrity::CableLengths<double> lengths = tensegrity::CableLengths<double>::Constant(1.0);
  lengths[3] = -1;
  const tensegrity::Status negative = branch.cables(0, lengths);
  const auto health = branch.state().health;
  std::printf("%s, %s, %s: %u IMU samples and %u cable samples dropped\n", to_string(first),
              to_string(again), to_string(negative), health.imu_dropped, health.cables_dropped);
  return again == tensegrity::Status::kDuplicate && health.cables_dropped == 1 ? 0 : 1;
}
