// The dynamics in single precision behind the interface of double precision.
#include <doctest/doctest.h>

#include "dynamics_nets.hpp"
#include "tensegrity/dynamics/single_precision.hpp"

namespace {

using dynamics_nets::free_prism;
using tensegrity::Status;
using tensegrity::dynamics::Net;
using tensegrity::dynamics::SinglePrecision;

Eigen::MatrixXd random_states(int simulations, int nodes) {
  Eigen::MatrixXd states = Eigen::MatrixXd::Random(simulations, 6 * nodes);
  states.leftCols(3 * nodes) *= 0.7;
  return states;
}

}  // namespace

TEST_CASE("single precision follows double precision as closely as it is rounded") {
  const Net<double> net = free_prism<double>(2.0);
  const Eigen::VectorXd lengths = dynamics_nets::rest_lengths(net);
  tensegrity::dynamics::Simulator<double> exact(net);
  SinglePrecision rounded(net, 37);
  const Eigen::MatrixXd start = random_states(37, 6);
  Eigen::MatrixXd a = start, b = start;
  REQUIRE(exact.step(a, lengths, 0.005, 20) == Status::kOk);
  REQUIRE(rounded.step(b, lengths, 0.005, 20) == Status::kOk);
  CHECK((a - start).norm() > 1);
  CHECK((a - b).cwiseAbs().maxCoeff() < 1e-3);  // of metres and metres per second, in 0.1 s
  CHECK((a - b).norm() > 0);
}

TEST_CASE("what does not fit is refused and left alone") {
  const Net<double> net = free_prism<double>(2.0);
  const Eigen::VectorXd lengths = dynamics_nets::rest_lengths(net);
  SinglePrecision simulator(net, 4);
  const Eigen::MatrixXd start = random_states(5, 6);
  Eigen::MatrixXd states = start;
  CHECK(simulator.step(states, lengths, 0.005, 1) == Status::kOutOfRange);
  Eigen::MatrixXd fewer = random_states(4, 5);
  CHECK(simulator.step(fewer, lengths, 0.005, 1) == Status::kOutOfRange);
  Eigen::MatrixXd fits = start.topRows(4);
  CHECK(simulator.step(fits, lengths.head(3), 0.005, 1) == Status::kOutOfRange);
  CHECK(fits == start.topRows(4));
  CHECK(states == start);
}
