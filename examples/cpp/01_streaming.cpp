// The estimator on board: feed sensors as they come, read the state when you need it.
// Here the sensors are those of a robot that stands still on one face.
#include <cstdio>
#include <tensegrity/estimator/prism_estimator.hpp>

int main() {
  tensegrity::Prism<double> robot;         // the 3-bar prism of T; set its lengths to yours
  tensegrity::PrismConfig<double> config;  // every number can be changed
  tensegrity::PrismEstimator<double> estimator(robot, config);

  const auto endcaps = robot.undeformed();
  tensegrity::CableLengths<double> lengths;
  for (int k = 0; k < 9; ++k) {
    const tensegrity::Cable cable = tensegrity::kPrismCables[std::size_t(k)];
    lengths[k] = (endcaps.col(cable.from) - endcaps.col(cable.to)).norm();
  }
  // Standing on endcaps 0, 3 and 5, gravity pulls along the normal of their plane.
  const Eigen::Vector3d normal = (endcaps.col(3) - endcaps.col(0))
                                     .cross(Eigen::Vector3d(endcaps.col(5) - endcaps.col(0)))
                                     .normalized();
  const Eigen::Vector3d up =
      normal.dot(endcaps.col(2) - endcaps.col(0)) > 0 ? normal : Eigen::Vector3d(-normal);

  for (int k = 0; k <= 600; ++k) {  // 3 s at 200 Hz
    const tensegrity::Nanoseconds t = k * 5'000'000LL;
    estimator.contacts(t, {true, false, false, true, false, true});
    if (k % 2 == 0) estimator.cables(t, lengths);          // m
    estimator.imu(t, Eigen::Vector3d::Zero(), 9.81 * up);  // rad/s, m/s^2
  }

  const auto state = estimator.state();
  std::printf("started: %s\n", state.initialized ? "yes" : "no");
  std::printf("IMU %.3f m above the ground, moved %.4f m\n", state.position.z(),
              state.position.head<2>().norm());
  for (int i = 0; i < 6; ++i) {
    std::printf("endcap %d: %6.3f %6.3f %6.3f m%s\n", i, state.endcaps_world(0, i),
                state.endcaps_world(1, i), state.endcaps_world(2, i),
                state.contacts[std::size_t(i)] ? "  on the ground" : "");
  }
  return state.initialized ? 0 : 1;
}
