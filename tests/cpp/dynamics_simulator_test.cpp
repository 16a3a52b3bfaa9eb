// Many simulations at once: independent of each other, of the precision, and of bad ones.
#include <doctest/doctest.h>

#include <limits>

#include "allocations.hpp"
#include "dynamics_nets.hpp"

using namespace dynamics_nets;
using tensegrity::Status;
using tensegrity::dynamics::Integrator;
using tensegrity::dynamics::Lanes;
using tensegrity::dynamics::Simulator;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// The prism over the ground, falling onto it.
template <typename Scalar>
Net<Scalar> falling_prism() {
  Net<Scalar> net = free_prism<Scalar>(10);
  net.ground = {};
  net.gravity << 0, 0, Scalar(-9.81);
  return net;
}

template <typename Scalar>
void check_batch_equals_single(Integrator integrator) {
  const Net<Scalar> net = falling_prism<Scalar>();
  Simulator<Scalar> simulator(net);
  for (const int simulations : {1, Lanes<Scalar>::kCount, 2 * Lanes<Scalar>::kCount + 1}) {
    const States<Scalar> start = prism_states<Scalar>(simulations);
    States<Scalar> all = start;
    REQUIRE(simulator.step(all, rest_lengths(net), Scalar(2e-3), 250, integrator) == Status::kOk);
    CHECK((all.col(5).array() < 0).any());  // they fell to the ground
    for (int row = 0; row < simulations; ++row) {
      States<Scalar> one = start.row(row);
      simulator.step(one, rest_lengths(net), Scalar(2e-3), 250, integrator);
      CHECK((one.array() == all.row(row).array()).all());
    }
  }
}

}  // namespace

TEST_CASE("every simulation of a batch is what it is alone, to the last bit") {
  for (const auto integrator : {Integrator::kRungeKutta4, Integrator::kSemiImplicitEuler}) {
    check_batch_equals_single<double>(integrator);
    check_batch_equals_single<float>(integrator);
  }
}

TEST_CASE("single precision follows double") {
  const Net<double> net = falling_prism<double>();
  const Net<float> net_f = falling_prism<float>();
  States<double> states = prism_states<double>(9);
  States<float> states_f = states.cast<float>();
  Simulator<double>(net).step(states, rest_lengths(net), 5e-3, 20);
  Simulator<float>(net_f).step(states_f, rest_lengths(net_f), 5e-3f, 20);
  CHECK((states_f.cast<double>() - states).leftCols(18).cwiseAbs().maxCoeff() < 2e-6);
  CHECK((states_f.cast<double>() - states).rightCols(18).cwiseAbs().maxCoeff() < 2e-4);
}

TEST_CASE("both integrators converge to the same motion") {
  const Net<double> net = free_prism(10.0);
  Simulator<double> simulator(net);
  States<double> a = prism_states<double>(1), b = a;
  simulator.step(a, rest_lengths(net), 1e-3, 100);
  simulator.step(b, rest_lengths(net), 1e-5, 10000, Integrator::kSemiImplicitEuler);
  CHECK((a - b).cwiseAbs().maxCoeff() < 2e-3);
}

TEST_CASE("a simulation that does not stay finite is left as it was, the others go on") {
  const Net<double> net = falling_prism<double>();
  Simulator<double> simulator(net);
  States<double> states = prism_states<double>(11);
  States<double> expected = states;
  simulator.step(expected, rest_lengths(net), 2e-3, 10);
  CHECK(simulator.failures() == 0);
  for (const double bad : {kNaN, std::numeric_limits<double>::infinity(), 1e300}) {
    States<double> damaged = states;
    damaged(4, 7) = bad;
    const States<double> before = damaged;
    CHECK(simulator.step(damaged, rest_lengths(net), 2e-3, 10) == Status::kNotFinite);
    CHECK(simulator.failures() == 1);
    for (int row = 0; row < 11; ++row) {
      const auto& right = row == 4 ? before : expected;
      for (int c = 0; c < 36; ++c) {
        const bool same = damaged(row, c) == right(row, c) ||
                          (std::isnan(damaged(row, c)) && std::isnan(right(row, c)));
        CHECK(same);
      }
    }
  }
}

TEST_CASE("a call that makes no sense changes nothing and says why") {
  const Net<double> net = free_prism(10.0);
  Simulator<double> simulator(net);
  States<double> states = prism_states<double>(3);
  const States<double> before = states;
  const Lengths<double> lengths = rest_lengths(net);
  Lengths<double> bad = lengths;
  bad[2] = kNaN;
  CHECK(simulator.step(states, bad, 1e-3, 1) == Status::kNotFinite);
  bad[2] = -0.1;
  CHECK(simulator.step(states, bad, 1e-3, 1) == Status::kOutOfRange);
  CHECK(simulator.step(states, lengths.head(5), 1e-3, 1) == Status::kOutOfRange);
  CHECK(simulator.step(states, lengths, 0, 1) == Status::kOutOfRange);
  CHECK(simulator.step(states, lengths, kNaN, 1) == Status::kNotFinite);
  CHECK(simulator.step(states, lengths, 1e-3, -1) == Status::kOutOfRange);
  CHECK(simulator.step(states.leftCols(30), lengths, 1e-3, 1) == Status::kOutOfRange);
  States<double> anchors = States<double>::Zero(2, 12);
  CHECK(simulator.step(states, anchors, lengths, 1e-3, 1) == Status::kOutOfRange);
  CHECK(states == before);
  CHECK(simulator.step(states, lengths, 1e-3, 0) == Status::kOk);
  CHECK(states == before);
}

TEST_CASE("a net that is none is never stepped") {
  Net<double> net = free_prism(10.0);
  CHECK(tensegrity::dynamics::valid(net));
  net.cables[3].to = 6;
  CHECK(!tensegrity::dynamics::valid(net));
  States<double> states = prism_states<double>(1);
  CHECK(Simulator<double>(net).step(states, rest_lengths(net), 1e-3, 1) == Status::kNotInitialized);
  net = free_prism(10.0);
  net.node_mass = 0;
  CHECK(!tensegrity::dynamics::valid(net));
  net = free_prism(10.0);
  net.ground.friction_kinetic = 0.7;  // above static
  CHECK(!tensegrity::dynamics::valid(net));
}

TEST_CASE("a step allocates nothing") {
  const Net<double> net = falling_prism<double>();
  Simulator<double> simulator(net);
  States<double> states = prism_states<double>(21), anchors = States<double>::Zero(21, 12);
  const Lengths<double> lengths = rest_lengths(net);
  const long before = tensegrity::testing::allocations();
  simulator.step(states, lengths, 2e-3, 5);
  simulator.step(states, anchors, lengths, 2e-3, 5, Integrator::kSemiImplicitEuler);
  CHECK(tensegrity::testing::allocations() == before);
}
