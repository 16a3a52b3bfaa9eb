// One whole update of SUPERball's estimator: 145 sigma points through 20 RK4 steps of 5 ms, then 24
// ranges and 6 inclinations. "mixed": the filter in double, the dynamics in single precision.
#include <algorithm>
#include <cmath>
#include <memory>

#include "runner.hpp"
#include "tensegrity/dynamics/single_precision.hpp"
#include "tensegrity/math/so3.hpp"
#include "tensegrity/ukf/ranging_estimator.hpp"

namespace {

using namespace tensegrity;
using benchmarks::Program;

constexpr int kNodes[12][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {8, 9}, {10, 11}};
// Index pairs of the cables: 12 actuated, 12 passive.
constexpr int kCables[24][2] = {{0, 10}, {1, 4},  {2, 6},  {3, 1},  {4, 8},  {5, 2},
                                {6, 5},  {7, 11}, {8, 7},  {10, 9}, {11, 3}, {9, 0},
                                {0, 8},  {0, 4},  {10, 1}, {10, 3}, {9, 11}, {9, 7},
                                {2, 4},  {2, 1},  {6, 3},  {6, 11}, {5, 7},  {5, 8}};

template <typename Scalar>
ukf::RangingRobot<Scalar> robot() {
  const Scalar a = Scalar(0.425), b = Scalar(0.85), o = 0;
  ukf::RangingRobot<Scalar> r;
  r.nodes = {{-a, -b, o}, {-a, b, o}, {o, a, b},  {o, a, -b},  {-b, o, a},  {b, o, a},
             {a, b, o},   {a, -b, o}, {o, -a, b}, {o, -a, -b}, {-b, o, -a}, {b, o, -a}};
  for (int k = 0; k < 6; ++k) r.rods.push_back({kNodes[k][0], kNodes[k][1]});
  return r;
}

template <typename Scalar>
dynamics::Net<Scalar> net() {
  dynamics::Net<Scalar> n;
  n.nodes = 12;
  n.node_mass = Scalar(1.75);
  for (int k = 0; k < 6; ++k) {
    n.rods.push_back({kNodes[k][0], kNodes[k][1], Scalar(1e5), Scalar(0.7), Scalar(1.7)});
  }
  for (int k = 0; k < 24; ++k) {
    n.cables.push_back({kCables[k][0], kCables[k][1], Scalar(k < 12 ? 3150 : 998), Scalar(70),
                        Scalar(k < 12 ? 1.0093 : 0.9408)});
  }
  return n;
}

template <typename Scalar, typename Dynamics>
class Superball {
 public:
  explicit Superball(Dynamics simulator)
      : body_(robot<Scalar>()),
        anchors_(anchors()),
        estimator_(body_, anchors_, std::move(simulator), rest_lengths(), config()) {
    // The robot stands, level enough: on a face, its axis (1, 1, 1) upright.
    turn_ = shortest_rotation<Scalar>(V3(1, 1, 1).normalized(), V3::UnitZ());
    for (const V3& node : body_.nodes) up_.z() = std::max(up_.z(), -(turn_ * node).z());
    // Until the search for the start is over.
    while (estimator_.state().health.updates == 0) update();
  }

  // 0.1 s: the measurements, which cost next to nothing, and the update.
  void update() {
    const std::int64_t t = step_ * 100000000LL;
    for (int j = 0; j < 24; ++j) {
      const int node = (j + int(step_)) % 12, anchor = (j / 12 * 2 + int(step_)) % 5;
      const V3 end = turn_ * body_.nodes[std::size_t(node)] + up_;
      const V3 far = turn_ * body_.nodes[std::size_t(node ^ 1)] + up_;
      const V3 module = end + body_.module_inset * (far - end).normalized();
      estimator_.range(t, node, anchor,
                       (module - anchors_.positions[std::size_t(anchor)]).norm() +
                           Scalar(0.05) * std::sin(Scalar(17 * j + 3 * int(step_))));
    }
    for (int rod = 0; rod < 6; ++rod) {
      const V3 axis =
          turn_ * (body_.nodes[std::size_t(2 * rod)] - body_.nodes[std::size_t(2 * rod + 1)]);
      estimator_.inclination(t, rod, axis.normalized().z());
    }
    estimator_.update(t);
    ++step_;
  }

 private:
  using V3 = Vector3<Scalar>;

  static ukf::RangingAnchors<Scalar> anchors() {
    ukf::RangingAnchors<Scalar> a;
    a.positions = {V3(5, 5, 1), V3(-5, 5, 2), V3(-5, -5, 3), V3(5, -5, 2), V3(0, 6, 4)};
    a.offsets = ukf::MatrixX<Scalar>::Zero(12, 5);
    a.offset_std = ukf::MatrixX<Scalar>::Constant(12, 5, Scalar(0.05));
    a.internal_offsets = ukf::MatrixX<Scalar>::Zero(12, 12);
    return a;
  }
  static ukf::VectorX<Scalar> rest_lengths() {
    const dynamics::Net<Scalar> springs = net<Scalar>();
    ukf::VectorX<Scalar> lengths(24);
    for (int k = 0; k < 24; ++k) lengths[k] = springs.cables[std::size_t(k)].rest_length;
    return lengths;
  }
  static ukf::RangingConfig<Scalar> config() {
    ukf::RangingConfig<Scalar> c;
    c.max_latency = 0;
    return c;
  }

  ukf::RangingRobot<Scalar> body_;
  ukf::RangingAnchors<Scalar> anchors_;
  ukf::RangingEstimator<Scalar, Dynamics> estimator_;
  Matrix3<Scalar> turn_;
  V3 up_ = V3::Zero();
  std::int64_t step_ = 0;
};

template <typename Scalar, typename Make>
void add_superball(Program& program, const std::string& name, const Make& make) {
  program.add("ukf/superball/" + name,
              [make] {
                using Dynamics = decltype(make());
                return [robot = std::make_unique<Superball<Scalar, Dynamics>>(make())] {
                  robot->update();
                };
              },
              {1, 4});
}

}  // namespace

int main(int argc, char** argv) {
  Program program(argc, argv);
  using dynamics::Simulator, dynamics::SinglePrecision;
  add_superball<double>(program, "double", [] { return Simulator<double>(net<double>()); });
  add_superball<double>(program, "mixed",
                        [] { return SinglePrecision(net<double>(), 12 * 12 + 1); });
  add_superball<float>(program, "float", [] { return Simulator<float>(net<float>()); });
  return program.run();
}
