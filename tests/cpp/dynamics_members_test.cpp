// Rods and cables: what a net of them conserves and loses, and when a cable has no force.
#include <doctest/doctest.h>

#include "dynamics_nets.hpp"

using namespace dynamics_nets;
using tensegrity::Status;
using tensegrity::dynamics::Integrator;
using tensegrity::dynamics::Simulator;

namespace {

// Relative growth of the energy over 0.4 s.
double energy_growth(Integrator integrator, double cable_damping, double dt) {
  const Net<double> net = free_prism(cable_damping);
  Simulator<double> simulator(net);
  States<double> states = prism_states<double>(1);
  const double before = energy(net, states);
  REQUIRE(simulator.step(states, rest_lengths(net), dt, int(std::lround(0.4 / dt)), integrator) ==
          Status::kOk);
  return energy(net, states) / before - 1;
}

// Force on node 1 of a pair, `length` apart along x, that separates with `rate`.
double pull(bool cable, double length, double rate) {
  Net<double> net = free_nodes<double>(2);
  (cable ? net.cables : net.rods).push_back({0, 1, 100, 5, 1});
  Simulator<double> simulator(net);
  States<double> states = States<double>::Zero(1, 12);
  states(0, 3) = length;
  states(0, 9) = rate;
  const double dt = 1e-3;
  simulator.step(states, rest_lengths(net), dt, 1, Integrator::kSemiImplicitEuler);
  CHECK(states.rightCols(6).sum() == doctest::Approx(rate));  // the other node has the opposite
  return net.node_mass * (states(0, 9) - rate) / dt;
}

}  // namespace

TEST_CASE("a member pulls with K (L - L0) + c dL/dt; a cable never pushes, whatever its damping") {
  for (const bool cable : {false, true}) {
    CHECK(pull(cable, 1.2, 0) == doctest::Approx(-20));
    CHECK(pull(cable, 1.2, 0.5) == doctest::Approx(-22.5));
    CHECK(pull(cable, 1.2, -2) == doctest::Approx(-10));
  }
  CHECK(pull(false, 1.2, -6) == doctest::Approx(10));
  CHECK(pull(true, 1.2, -6) == 0);
  CHECK(pull(false, 0.8, 0) == doctest::Approx(20));
  CHECK(pull(true, 0.8, 0) == 0);
  CHECK(pull(true, 0.8, 6) == 0);  // slack, however fast it lengthens
}

TEST_CASE("ends that meet have no direction: no force, no division by zero") {
  CHECK(pull(false, 0, 0) == 0);
  CHECK(pull(false, 0, 1) == 0);
}

TEST_CASE("without damping energy is conserved to the order of the integrator") {
  const double coarse = std::abs(energy_growth(Integrator::kRungeKutta4, 0, 4e-3));
  const double fine = std::abs(energy_growth(Integrator::kRungeKutta4, 0, 2e-3));
  CHECK(fine > 1e-12);        // above rounding, so that the order can be seen
  CHECK(coarse > 15 * fine);  // fourth order or better
  CHECK(coarse < 1e-3);
  CHECK(std::abs(energy_growth(Integrator::kSemiImplicitEuler, 0, 5e-4)) < 2e-2);
}

TEST_CASE("damping takes energy in every step") {
  for (const auto integrator : {Integrator::kRungeKutta4, Integrator::kSemiImplicitEuler}) {
    Net<double> net = free_prism(10.0);
    net.rods[0].damping = net.rods[1].damping = net.rods[2].damping = 10;
    Simulator<double> simulator(net);
    States<double> states = prism_states<double>(1);
    const double start = energy(net, states);
    double before = start;
    for (int k = 0; k < 400; ++k) {
      simulator.step(states, rest_lengths(net), 2e-4, 1, integrator);
      const double after = energy(net, states);
      // Semi-implicit steps conserve a slightly different energy: allow for its ripple.
      CHECK(after < before + (integrator == Integrator::kRungeKutta4 ? 0 : 1e-3 * start));
      before = after;
    }
    CHECK(before < 0.9 * start);
  }
}

TEST_CASE("members conserve momentum and, to the order of the step, angular momentum") {
  const Net<double> net = free_prism(10.0);
  Simulator<double> simulator(net);
  States<double> states = prism_states<double>(1);
  const auto momentum = [&] {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < 6; ++i) sum += states.row(0).segment<3>(18 + 3 * i).transpose();
    return sum;
  };
  const auto angular = [&] {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d x = states.row(0).segment<3>(3 * i).transpose();
      const Eigen::Vector3d v = states.row(0).segment<3>(18 + 3 * i).transpose();
      sum += x.cross(v);
    }
    return sum;
  };
  const Eigen::Vector3d p = momentum(), l = angular();
  simulator.step(states, rest_lengths(net), 1e-3, 500);
  CHECK((momentum() - p).norm() < 1e-12);
  CHECK((angular() - l).norm() < 1e-7);
}
