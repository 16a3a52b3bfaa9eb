// One prediction of an unscented filter: every sigma point through 20 Runge-Kutta steps of 5 ms,
// for SUPERball and for prisms of 3 to 48 rods, in double and single precision.
//
// Each call starts from the same sigma points; the copy is a thousandth of it.
#include "tensegrity/dynamics/simulator.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "runner.hpp"
#include "tensegrity/math/so3.hpp"

namespace {

using tensegrity::benchmarks::Program;
using tensegrity::dynamics::Net;
using tensegrity::dynamics::Simulator;
using Positions = Eigen::Matrix<double, 3, Eigen::Dynamic>;

constexpr double kRodLength = 1.7;     // [m]
constexpr double kCableTension = 100;  // [N]

template <typename Scalar>
struct Robot {
  Net<Scalar> net;
  Positions positions;  // standing on the ground

  explicit Robot(int rods) {
    net.nodes = 2 * rods;
    net.node_mass = Scalar(1.75);
    positions.resize(3, net.nodes);
    for (int i = 0; i < net.nodes; i += 2) {
      net.rods.push_back({i, i + 1, Scalar(1e5), Scalar(0.7), Scalar(kRodLength)});
    }
  }

  void join(int a, int b, double stiffness) {
    const double length = (positions.col(a) - positions.col(b)).norm();
    net.cables.push_back(
        {a, b, Scalar(stiffness), Scalar(70), Scalar(length - kCableTension / stiffness)});
  }
};

// The six-rod robot: three pairs of parallel rods; every node is joined to the four nearest nodes
// of other rods.
template <typename Scalar>
Robot<Scalar> superball() {
  Robot<Scalar> robot(6);
  const double half = kRodLength / 2, quarter = kRodLength / 4;
  for (int i = 0; i < 12; ++i) {
    Eigen::Vector3d p;
    const int axis = i / 4;
    p[axis] = i % 2 ? -half : half;
    p[(axis + 1) % 3] = i / 2 % 2 ? -quarter : quarter;
    p[(axis + 2) % 3] = 0;
    robot.positions.col(i) = p;
  }
  const double cable = kRodLength * std::sqrt(6.0) / 4;
  for (int a = 0; a < 12; ++a) {
    for (int b = a + 1; b < 12; ++b) {
      const double distance = (robot.positions.col(a) - robot.positions.col(b)).norm();
      if (std::abs(distance - cable) < 1e-9)
        robot.join(a, b, robot.net.cables.size() % 2 ? 998 : 3150);
    }
  }
  // Onto the face whose outward normal is (-1, -1, -1).
  const Eigen::Vector3d down = Eigen::Vector3d(-1, -1, -1).normalized();
  robot.positions =
      tensegrity::shortest_rotation<double>(down, -Eigen::Vector3d::UnitZ()) * robot.positions;
  robot.positions.row(2).array() -= robot.positions.row(2).minCoeff();
  return robot;
}

// A prism: the rods' lower ends on a circle on the ground, the upper ones on another, turned by the
// angle at which it is prestressed; both circles and the gaps between them closed by cables.
template <typename Scalar>
Robot<Scalar> prism(int rods) {
  Robot<Scalar> robot(rods);
  const double pi = std::acos(-1.0), twist = pi / 2 - pi / rods, radius = kRodLength / 2.5;
  const double height =
      std::sqrt(kRodLength * kRodLength - std::pow(2 * radius * std::cos(twist / 2), 2));
  for (int k = 0; k < rods; ++k) {
    const double lower = 2 * pi * k / rods, upper = lower + pi - twist;
    robot.positions.col(2 * k) << radius * std::cos(upper), radius * std::sin(upper), height;
    robot.positions.col(2 * k + 1) << radius * std::cos(lower), radius * std::sin(lower), 0;
  }
  for (int k = 0; k < rods; ++k) {
    const int next = (k + 1) % rods;
    robot.join(2 * k, 2 * next, 3150);
    robot.join(2 * k + 1, 2 * next + 1, 3150);
    robot.join(2 * k, 2 * ((k + rods / 2) % rods) + 1, 998);
  }
  return robot;
}

template <typename Scalar>
void add_case(Program& program, const std::string& name, const Robot<Scalar>& robot) {
  const int rods = int(robot.net.rods.size());
  program.add("dynamics/" + name + "/" + std::to_string(rods) + "/" +
                  (sizeof(Scalar) == 4 ? "float" : "double"),
              [robot, name] {
                const Eigen::Index n3 = robot.positions.size();
                // Sigma points: the mean, and pairs with one coordinate displaced.
                typename Simulator<Scalar>::States start(4 * n3 + 1, 2 * n3);
                start.leftCols(n3).rowwise() =
                    Eigen::Map<const Eigen::RowVectorXd>(robot.positions.data(), n3).cast<Scalar>();
                start.rightCols(n3).setZero();
                for (Eigen::Index c = 0; c < 2 * n3; ++c) {
                  start(1 + c, c) += Scalar(0.02);
                  start(1 + 2 * n3 + c, c) -= Scalar(0.02);
                }
                typename Simulator<Scalar>::Vector rest(Eigen::Index(robot.net.cables.size()));
                for (Eigen::Index k = 0; k < rest.size(); ++k) {
                  rest[k] = robot.net.cables[std::size_t(k)].rest_length;
                }
                return [simulator = Simulator<Scalar>(robot.net), start, states = start, rest,
                        name]() mutable {
                  states = start;
                  const auto status = simulator.step(states, rest, Scalar(0.005), 20);
                  if (status != tensegrity::Status::kOk) {
                    std::fprintf(stderr, "%s: %s\n", name.c_str(), tensegrity::to_string(status));
                    std::exit(1);
                  }
                };
              },
              {1, rods > 12 ? 0 : 2});
}

}  // namespace

int main(int argc, char** argv) {
  Program program(argc, argv);
  add_case(program, "superball", superball<double>());
  add_case(program, "superball", superball<float>());
  for (const int rods : {3, 6, 12, 24, 48}) {
    add_case(program, "prism", prism<double>(rods));
    add_case(program, "prism", prism<float>(rods));
  }
  return program.run();
}
