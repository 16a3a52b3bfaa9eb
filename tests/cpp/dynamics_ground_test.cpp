// The ground: how deep a node stands, when it slides, how it slows down and what it remembers.
#include <doctest/doctest.h>

#include "dynamics_nets.hpp"

using namespace dynamics_nets;
using tensegrity::Status;
using tensegrity::dynamics::Integrator;
using tensegrity::dynamics::Simulator;

namespace {

constexpr double kGravity = 9.81;

// A node on ground that is tilted by `slope` (rise per run) about y, at rest at its depth.
struct OnSlope {
  Net<double> net = node_on_ground<double>();
  States<double> state = States<double>::Zero(1, 6), anchors = States<double>::Zero(1, 2);

  explicit OnSlope(double slope) {
    const double angle = std::atan(slope);
    net.gravity << kGravity * std::sin(angle), 0, -kGravity * std::cos(angle);
    state(0, 2) = net.node_mass * net.gravity.z() / net.ground.stiffness;
  }

  void run(double seconds, Integrator integrator = Integrator::kRungeKutta4) {
    Simulator<double> simulator(net);
    const double dt = 1e-3;
    REQUIRE(simulator.step(state, anchors, Lengths<double>(0), dt, int(std::lround(seconds / dt)),
                           integrator) == Status::kOk);
  }
};

}  // namespace

TEST_CASE("a dropped node comes to rest at the depth that carries its weight") {
  for (const auto integrator : {Integrator::kRungeKutta4, Integrator::kSemiImplicitEuler}) {
    OnSlope node(0);
    node.net.ground.damping = 2e4;  // the bounce dies out sooner
    node.state(0, 2) = 0.05;
    node.run(20, integrator);
    CHECK(node.state(0, 2) == doctest::Approx(-2 * kGravity / 1e4).epsilon(1e-3));
    CHECK(std::abs(node.state(0, 5)) < 1e-3);
  }
}

TEST_CASE("the ground never pulls: a node that leaves it flies") {
  OnSlope node(0);
  node.state(0, 2) = -1e-3;
  node.state(0, 5) = 8;  // the normal force's damping alone would pull with d (k - c v) < 0
  node.run(0.5);
  CHECK(node.state(0, 5) == doctest::Approx(8 - kGravity * 0.5).epsilon(1e-3));
}

TEST_CASE("below the cone of static friction a node stands, displaced as the spring yields") {
  OnSlope node(0.5);
  node.run(4);
  const double yields =
      node.net.node_mass * node.net.gravity.x() / node.net.ground.friction_stiffness;
  CHECK(node.state(0, 0) == doctest::Approx(yields).epsilon(1e-3));
  CHECK(std::abs(node.state(0, 3)) < 1e-6);
  const double there = node.state(0, 0);
  node.run(4);
  CHECK(std::abs(node.state(0, 0) - there) < 1e-6);  // it does not creep
}

TEST_CASE("a standing node bears more than a sliding one") {
  OnSlope standing(0.6);  // between 0.54 and 0.64
  standing.anchors(0, 0) =
      -standing.net.node_mass * standing.net.gravity.x() / standing.net.ground.friction_stiffness;
  OnSlope sliding = standing;
  sliding.state(0, 3) = 0.2;
  standing.run(2);
  CHECK(std::abs(standing.state(0, 0)) < 1e-5);
  sliding.run(2);
  CHECK(sliding.state(0, 3) > 0.2);
}

TEST_CASE("above it slides, and speeds up by what kinetic friction leaves") {
  OnSlope node(0.7);
  node.run(1);
  const double early = node.state(0, 3);
  node.run(1);
  const Eigen::Vector3d g = node.net.gravity;
  CHECK(node.state(0, 3) - early == doctest::Approx(g.x() + 0.54 * g.z()).epsilon(1e-3));
}

TEST_CASE("a sliding node slows down by mu g in the direction of its motion, stops and stays") {
  OnSlope node(0);
  node.state(0, 3) = 1.8;
  node.state(0, 4) = 2.4;
  const double deceleration = 0.54 * kGravity;
  node.run(0.3);
  CHECK(node.state(0, 3) == doctest::Approx(1.8 - 0.6 * deceleration * 0.3).epsilon(2e-3));
  CHECK(node.state(0, 4) == doctest::Approx(2.4 - 0.8 * deceleration * 0.3).epsilon(2e-3));
  node.run(3);
  CHECK(std::hypot(node.state(0, 3), node.state(0, 4)) < 1e-6);
  const double way = 9 / (2 * deceleration);
  // Up to what the spring springs back, mu N / k_t = 1 mm.
  CHECK(std::hypot(node.state(0, 0), node.state(0, 1)) == doctest::Approx(way).epsilon(3e-3));
}

TEST_CASE("a node dragged slowly feels friction between kinetic and static") {
  // It hangs on a spring whose other end moves at constant speed.
  const double speed = 0.005, stiffness = 1000, dt = 1e-3;
  OnSlope node(0);
  Simulator<double> simulator(node.net);
  double work = 0, way = 0;
  for (int k = 0; k < 20000; ++k) {
    const double pull = stiffness * (speed * k * dt - node.state(0, 0));
    node.state(0, 3) += pull / node.net.node_mass * dt;
    const double before = node.state(0, 0);
    simulator.step(node.state, node.anchors, Lengths<double>(0), dt, 1);
    if (k < 10000) continue;  // the spring has been loaded
    work += pull * (node.state(0, 0) - before);
    way += node.state(0, 0) - before;
  }
  const double weight = node.net.node_mass * kGravity;
  CHECK(way == doctest::Approx(speed * 10).epsilon(0.05));
  CHECK(work / way > 0.53 * weight);
  CHECK(work / way < 0.64 * weight);
}

TEST_CASE("without anchors friction remembers for one call: a loaded node yields once per call") {
  OnSlope node(0.3);
  Simulator<double> simulator(node.net);
  const double yields = node.net.node_mass * node.net.gravity.x() / 1e4;
  for (int k = 0; k < 20; ++k) {
    simulator.step(node.state, Lengths<double>(0), 5e-3, 20);
  }
  CHECK(node.state(0, 0) > yields);
  CHECK(node.state(0, 0) < 25 * yields);
}

TEST_CASE("steps of 5 ms do not chatter: a sliding node comes to rest") {
  OnSlope node(0);
  node.state(0, 3) = 1;
  Simulator<double> simulator(node.net);
  simulator.step(node.state, node.anchors, Lengths<double>(0), 5e-3, 400);
  CHECK(std::abs(node.state(0, 3)) < 1e-6);
}

TEST_CASE("friction never adds energy") {
  OnSlope node(0);
  node.state(0, 3) = 1;
  double before = 0.5 * node.net.node_mass;
  for (int k = 0; k < 1000; ++k) {
    node.run(1e-3);
    const double speed = node.state(0, 3);
    const double weight = node.net.node_mass * kGravity, stiffness = 1e4, damping = 200;
    double stretch = node.state(0, 0) - node.anchors(0, 0);
    // The anchor of a sliding node catches up at the begin of the next step.
    const bool slides = stiffness * stretch + damping * speed > 0.64 * weight;
    if (slides) stretch = std::min(stretch, 0.54 * weight / stiffness);
    const double after =
        0.5 * node.net.node_mass * speed * speed + 0.5 * stiffness * stretch * stretch;
    CHECK(after <= before + 1e-9);
    before = after;
  }
}
