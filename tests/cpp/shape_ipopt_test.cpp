// The Ipopt reference: exact derivatives, and agreement with the real-time solver.
#include <doctest/doctest.h>

#include <limits>

#include "shape_samples.hpp"
#include "tensegrity/shape/ipopt_solver.hpp"
#include "tensegrity/shape/solver.hpp"

namespace tensegrity::shape {
namespace {

using test::Samples;

TEST_CASE("Solver and IpoptSolver find the same cost on 1000 random shapes with noisy lengths") {
  const Prism<double> prism;
  Samples samples(40);
  Solver<double> solver(prism);
  IpoptSolver reference(prism);
  double worst = 0;
  for (int n = 0; n < 1000; ++n) {
    const Rods<double> truth = samples.shape(prism, 0.08);
    const CableLengths<double> lengths = cable_lengths(truth.endcaps()) + samples.normal<9>(0.002);
    solver.reset();
    reference.reset();
    REQUIRE(solver.solve(lengths) == Status::kOk);
    REQUIRE(reference.solve(lengths) == Status::kOk);
    worst = std::max(worst, std::abs(solver.cost() - reference.cost()));
  }
  CHECK(worst < 1e-10);  // m^2
}

TEST_CASE("warm solves of the reference follow a moving shape") {
  const Prism<double> prism;
  Samples samples(41);
  IpoptSolver reference(prism);
  Solver<double> solver(prism);
  Rods<double> truth = samples.shape(prism, 0.04);
  for (int n = 0; n < 30; ++n) {
    truth.retract(samples.normal<kTangent>(0.002));
    const CableLengths<double> lengths = cable_lengths(truth.endcaps());
    REQUIRE(reference.solve(lengths) == Status::kOk);
    REQUIRE(solver.solve(lengths) == Status::kOk);
    CHECK(std::abs(reference.cost() - solver.cost()) < 1e-10);
    CHECK(cable_lengths(reference.endcaps()).isApprox(lengths, 1e-5));
    CHECK(std::abs(spin_angle(reference.endcaps(), prism.undeformed())) < 1e-9);
  }
}

TEST_CASE("derivatives given to Ipopt agree with finite differences") {
  const Prism<double> prism;
  Samples samples(42);
  for (const auto set :
       {ConstraintSet::kAsPrinted, ConstraintSet::kCorrected, ConstraintSet::kMutualMoment}) {
    IpoptOptions options;
    options.constraints = set;
    const IpoptSolver solver(prism, options);
    const Endcaps<double> q = samples.shape(prism).endcaps();
    const CableLengths<double> lengths = cable_lengths(samples.shape(prism).endcaps());
    const int constraints = 3 + InequalitySet<double>(set, prism.moment_sign()).size();
    const Eigen::VectorXd multipliers = samples.normal<13>(1).head(constraints);
    const auto at = solver.derivatives(q, lengths, multipliers);
    REQUIRE(at.constraints.size() == constraints);
    CHECK(at.objective == doctest::Approx((cable_lengths(q) - lengths).squaredNorm()));
    const double h = 1e-6;
    for (int k = 0; k < 12; ++k) {
      Endcaps<double> up = q;
      Endcaps<double> down = q;
      up.reshaped()[6 + k] += h;
      down.reshaped()[6 + k] -= h;
      const auto above = solver.derivatives(up, lengths, multipliers);
      const auto below = solver.derivatives(down, lengths, multipliers);
      CHECK(at.gradient[k] ==
            doctest::Approx((above.objective - below.objective) / (2 * h)).epsilon(1e-6).scale(1));
      CHECK((at.jacobian.col(k) - (above.constraints - below.constraints) / (2 * h)).norm() < 1e-7);
      const Eigen::VectorXd lagrangian_above =
          above.gradient + above.jacobian.transpose() * multipliers;
      const Eigen::VectorXd lagrangian_below =
          below.gradient + below.jacobian.transpose() * multipliers;
      CHECK((at.hessian.col(k) - (lagrangian_above - lagrangian_below) / (2 * h)).norm() < 1e-6);
    }
  }
}

TEST_CASE("the printed constraints keep Ipopt from the undeformed robot") {
  const Prism<double> prism;
  const CableLengths<double> lengths = cable_lengths(prism.undeformed());
  IpoptOptions options;
  options.constraints = ConstraintSet::kAsPrinted;
  IpoptSolver printed(prism, options);
  REQUIRE(printed.solve(lengths) == Status::kOk);
  CHECK(printed.cost() > 1e-3);  // more than 10 mm per cable
  IpoptSolver repaired(prism);
  REQUIRE(repaired.solve(lengths) == Status::kOk);
  CHECK(repaired.cost() < 1e-10);
}

TEST_CASE("the reference refuses bad lengths and keeps its shape") {
  const Prism<double> prism;
  IpoptSolver solver(prism);
  CableLengths<double> lengths = cable_lengths(prism.undeformed());
  REQUIRE(solver.solve(lengths) == Status::kOk);
  const Endcaps<double> before = solver.endcaps();
  lengths[4] = std::numeric_limits<double>::quiet_NaN();
  CHECK(solver.solve(lengths) == Status::kNotFinite);
  lengths[4] = -0.1;
  CHECK(solver.solve(lengths) == Status::kOutOfRange);
  CHECK(solver.endcaps() == before);
}

}  // namespace
}  // namespace tensegrity::shape
