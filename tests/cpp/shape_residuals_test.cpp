// Least squares written for the net against the same through the Jacobian of all lengths.
#include <doctest/doctest.h>

#include "shape_samples.hpp"
#include "tensegrity/shape/length_residuals.hpp"

namespace tensegrity::shape {
namespace {

TEST_CASE("cost, gradient and Hessian of the residuals, alone and as equations of a step") {
  const Prism<double> prism;
  test::Samples samples(40);
  for (int n = 0; n < 100; ++n) {
    const Rods<double> rods = samples.shape(prism);
    const CableLengths<double> lengths = cable_lengths(rods.endcaps());
    const CableLengths<double> measured = lengths + samples.normal<9>(0.1);
    const LengthResiduals<double> residuals(rods, measured);
    const CableLengths<double> r = lengths - measured;
    const LengthJacobian<double> jacobian = length_jacobian(rods);
    const Tangent<double> spin = spin_tangent(rods);
    CHECK(residuals.cost() == doctest::Approx(r.squaredNorm()).epsilon(1e-12));
    CHECK((residuals.gradient(rods) - jacobian.transpose() * r).norm() < 1e-12);

    TangentMatrix<double> dense = jacobian.transpose() * jacobian + spin * spin.transpose();
    for (const bool second_order : {false, true}) {
      if (second_order) dense += test::weighted_length_hessian(rods, r);
      Matrix<double, padded(kTangent + 1), kTangent> equations;
      residuals.equations(rods, second_order, columns(equations));
      const TangentMatrix<double> off = equations.topRows<kTangent>() - dense;
      CHECK(TangentMatrix<double>(off.triangularView<Eigen::Lower>()).norm() < 1e-12);
      CHECK(equations.row(kTangent).transpose() == residuals.gradient(rods));
    }
  }
}

}  // namespace
}  // namespace tensegrity::shape
