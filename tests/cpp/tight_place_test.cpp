// Placing endcaps at a shape: mean and covariance against finite differences of the mean.
#include <doctest/doctest.h>

#include "tensegrity/estimator/spin_start.hpp"
#include "tensegrity/tight/place.hpp"
#include "tight_samples.hpp"

using namespace tensegrity::tight::test;
using tensegrity::Endcaps;
using tensegrity::Prism;
using tensegrity::tight::place_endcaps;

TEST_CASE("endcaps take the base rod's errors, and those of the shape besides") {
  const Prism<double> robot;
  const Endcaps<double> h = robot.undeformed();
  const double position_std = 0.02, spin_std = 0.3, rate_std = 0.1;
  for (unsigned seed = 0; seed < 10; ++seed) {
    Samples samples(seed);
    const B before = samples.belief(robot);
    const auto placed = [&](B belief, double spin) {
      place_endcaps(belief, tensegrity::spun(h, spin), position_std, spin_std, rate_std);
      return belief;
    };
    const B after = placed(before, 0);

    CHECK((after.endcaps_body() - h).norm() < 1e-12);
    // A rigid body: no distance changes.
    for (int i = 2; i < 6; ++i) {
      for (int j = 0; j < i; ++j) {
        const V3 apart = after.endcap(i) - after.endcap(j);
        CHECK(std::abs(apart.dot(after.endcap_velocity(i) - after.endcap_velocity(j))) < 1e-12);
      }
    }

    const MatrixXd map =
        derivative(before, [&](const B& b) { return difference(placed(b, 0), after); });
    MatrixXd own = MatrixXd::Zero(B::Dim, B::Dim);
    own.diagonal().segment<12>(B::kEndcaps).setConstant(position_std * position_std);
    own.diagonal().segment<12>(B::kRates).setConstant(rate_std * rate_std);
    // The rates' share of the spin is left to rate_std.
    const double step = 1e-5;
    VectorXd turn = (difference(placed(before, step), placed(before, -step))) / (2 * step);
    turn.segment<12>(B::kRates).setZero();
    own += spin_std * spin_std * turn.lazyProduct(turn.transpose());
    CHECK(distance(after.complete_covariance(), sandwich(map, before.complete_covariance(), own)) <
          100 * kDerivativeError);
    CHECK((after.complete_covariance() - after.covariance).norm() <
          1e-15 * after.covariance.norm());
  }
}
