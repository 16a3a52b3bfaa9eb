// Where a ranging robot is: SUPERball's filter on ranges to four anchors, while the robot stands.
// Calibrated offsets come from ranging/calibration.hpp (docs/range_calibration.md).
#include <algorithm>
#include <cstdio>
#include <random>
#include <tensegrity/dynamics/simulator.hpp>
#include <tensegrity/math/so3.hpp>
#include <tensegrity/ukf/ranging_estimator.hpp>

namespace {

using tensegrity::dynamics::Net;
using tensegrity::dynamics::Simulator;

// Six rods of 1.7 m and 24 cables, half of them actuated: the robot of Caluwaerts et al. 2016.
// Node i of this program is node i + 1 of theirs.
tensegrity::ukf::RangingRobot<double> superball() {
  const double a = 0.425, b = 0.85;  // m
  tensegrity::ukf::RangingRobot<double> robot;
  robot.nodes = {{-a, -b, 0}, {-a, b, 0}, {0, a, b},  {0, a, -b},  {-b, 0, a},  {b, 0, a},
                 {a, b, 0},   {a, -b, 0}, {0, -a, b}, {0, -a, -b}, {-b, 0, -a}, {b, 0, -a}};
  for (int k = 0; k < 12; k += 2) robot.rods.push_back({k, k + 1});
  return robot;
}

Net<double> net(const tensegrity::ukf::RangingRobot<double>& robot) {
  const int actuated[12][2] = {{0, 10}, {1, 4},  {2, 6}, {3, 1},  {4, 8},  {5, 2},
                               {6, 5},  {7, 11}, {8, 7}, {10, 9}, {11, 3}, {9, 0}};
  const int passive[12][2] = {{0, 8}, {0, 4}, {10, 1}, {10, 3}, {9, 11}, {9, 7},
                              {2, 4}, {2, 1}, {6, 3},  {6, 11}, {5, 7},  {5, 8}};
  Net<double> result;
  result.nodes = 12;
  result.node_mass = 21.0 / 12;  // kg
  for (const auto& ends : robot.rods) {
    result.rods.push_back({ends[0], ends[1], 1e5, 0.7, robot.rod_length});
  }
  for (const auto& ends : actuated) result.cables.push_back({ends[0], ends[1], 3150, 70, 1.0093});
  for (const auto& ends : passive) result.cables.push_back({ends[0], ends[1], 998, 70, 0.9408});
  return result;
}

}  // namespace

int main() {
  const auto robot = superball();
  Simulator<double> dynamics(net(robot));
  Eigen::VectorXd rest_lengths(24);  // m
  for (int k = 0; k < 24; ++k) rest_lengths[k] = dynamics.net().cables[std::size_t(k)].rest_length;

  // The truth: the robot settles on the face of nodes 5, 7 and 8, a metre from the origin.
  const Eigen::Vector3d down = (robot.nodes[5] + robot.nodes[7] + robot.nodes[8]).normalized();
  const Eigen::Matrix3d turn =
      tensegrity::shortest_rotation<double>(down, -Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d place(1, 0, -(turn * robot.nodes[5]).z());
  Simulator<double>::States truth = Simulator<double>::States::Zero(1, 72);
  for (int i = 0; i < 12; ++i) {
    truth.row(0).segment<3>(3 * i) = (turn * robot.nodes[std::size_t(i)] + place).transpose();
  }
  dynamics.step(truth, rest_lengths, 0.005, 600);

  // Raw ranges are metres too long; a calibration found by how much.
  tensegrity::ukf::RangingAnchors<double> anchors;
  anchors.positions = {{5, 4, 0.4}, {-5, 4, 2.5}, {-5, -4, 0.5}, {5, -4, 3.0}};
  anchors.offsets = Eigen::MatrixXd::Constant(12, 4, 3.9);
  anchors.offset_std = Eigen::MatrixXd::Constant(12, 4, 0.02);
  anchors.internal_offsets = Eigen::MatrixXd::Constant(12, 12, 3.9);

  tensegrity::ukf::RangingEstimator<double, Simulator<double>> estimator(robot, anchors, dynamics,
                                                                         rest_lengths);
  tensegrity::ukf::RangingModel<double> model(robot, anchors, 1);
  const Eigen::VectorXd positions = truth.row(0).head<36>().transpose();
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.05);  // m
  constexpr std::int64_t kPeriod = 100'000'000;     // ns
  for (int k = 0; k < 40; ++k) {
    for (int node = 0; node < 12; ++node) {
      for (int anchor = 0; anchor < 4; ++anchor) {
        const double distance =
            (model.module(positions, node) - anchors.positions[std::size_t(anchor)]).norm();
        estimator.range(k * kPeriod, node, anchor, distance + 3.9 + noise(random));
      }
    }
  }
  estimator.update(40 * kPeriod);

  const auto& state = estimator.state();
  double error = 0;  // m
  for (int i = 0; i < 12; ++i) error += (state.node(i) - positions.segment<3>(3 * i)).norm() / 12;
  std::array<int, 3> face = state.face;
  std::sort(face.begin(), face.end());
  std::printf("standing on nodes %d, %d and %d; their ends are %.3f m off on average\n", face[0],
              face[1], face[2], error);
  std::printf("%lld ranges used, %lld rejected\n", (long long)state.health.ranges_used,
              (long long)state.health.ranges_rejected);
  return state.initialized ? 0 : 1;
}
