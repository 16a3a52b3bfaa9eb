// Time of one whole update of SUPERball's estimator: 145 sigma points through 20 RK4 steps of 5 ms,
// then 24 ranges and 6 inclinations. "mixed": the filter in double, the dynamics in single
// precision.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "tensegrity/dynamics/single_precision.hpp"
#include "tensegrity/ukf/ranging_estimator.hpp"

using namespace tensegrity;

namespace {

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
void measure(const char* name, Dynamics simulator) {
  using V3 = Vector3<Scalar>;
  const ukf::RangingRobot<Scalar> body = robot<Scalar>();
  const dynamics::Net<Scalar> springs = net<Scalar>();
  ukf::VectorX<Scalar> lengths(24);
  for (int k = 0; k < 24; ++k) lengths[k] = springs.cables[std::size_t(k)].rest_length;
  ukf::RangingAnchors<Scalar> anchors;
  anchors.positions = {V3(5, 5, 1), V3(-5, 5, 2), V3(-5, -5, 3), V3(5, -5, 2), V3(0, 6, 4)};
  anchors.offsets = ukf::MatrixX<Scalar>::Zero(12, 5);
  anchors.offset_std = ukf::MatrixX<Scalar>::Constant(12, 5, Scalar(0.05));
  anchors.internal_offsets = ukf::MatrixX<Scalar>::Zero(12, 12);
  ukf::RangingConfig<Scalar> config;
  config.max_latency = 0;
  ukf::RangingEstimator<Scalar, Dynamics> estimator(body, anchors, std::move(simulator), lengths,
                                                    config);

  // The robot stands, level enough: on a face, its axis (1, 1, 1) upright.
  const Matrix3<Scalar> turn =
      Eigen::Quaternion<Scalar>::FromTwoVectors(V3(1, 1, 1), V3::UnitZ()).toRotationMatrix();
  Scalar lowest = 0;
  for (const V3& node : body.nodes) lowest = std::min(lowest, (turn * node).z());
  const V3 up(0, 0, -lowest);
  std::vector<double> times;
  for (int k = 0; k < 300; ++k) {
    const std::int64_t t = k * 100000000LL;
    for (int j = 0; j < 24; ++j) {
      const int node = (j + k) % 12, anchor = (j / 12 * 2 + k) % 5;
      const V3 end = turn * body.nodes[std::size_t(node)] + up;
      const V3 far = turn * body.nodes[std::size_t(node ^ 1)] + up;
      const V3 module = end + body.module_inset * (far - end).normalized();
      estimator.range(t, node, anchor,
                      (module - anchors.positions[std::size_t(anchor)]).norm() +
                          Scalar(0.05) * std::sin(Scalar(17 * j + 3 * k)));
    }
    for (int rod = 0; rod < 6; ++rod) {
      const V3 axis =
          turn * (body.nodes[std::size_t(2 * rod)] - body.nodes[std::size_t(2 * rod + 1)]);
      estimator.inclination(t, rod, axis.normalized().z());
    }
    const auto begin = std::chrono::steady_clock::now();
    const Status status = estimator.update(t);
    const auto end = std::chrono::steady_clock::now();
    if (status == Status::kOk && estimator.state().health.updates > 0) {
      times.push_back(std::chrono::duration<double, std::milli>(end - begin).count());
    }
  }
  std::sort(times.begin(), times.end());
  std::printf(
      "%-8s median %.3f ms   90 %% %.3f ms   ranges %lld   inclinations %lld   updates %zu\n", name,
      times[times.size() / 2], times[times.size() * 9 / 10],
      static_cast<long long>(estimator.state().health.ranges_used),
      static_cast<long long>(estimator.state().health.inclinations_used), times.size());
}

}  // namespace

int main() {
  using dynamics::Simulator, dynamics::SinglePrecision;
  measure<double>("double", Simulator<double>(net<double>()));
  measure<double>("mixed", SinglePrecision(net<double>(), 12 * 12 + 1));
  measure<float>("float", Simulator<float>(net<float>()));
}
