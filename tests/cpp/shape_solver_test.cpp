// The real-time solver: that it finds the shape, on which branch, with which covariance.
#include "tensegrity/shape/solver.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <type_traits>
#include <utility>

#include "shape_samples.hpp"

namespace tensegrity::shape {
namespace {

using test::Samples;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Of residuals a hundredth of the tolerance: what the last step may leave [m^2].
double exact_cost() {
  const double residual = SolverOptions<double>().tolerance / 100;
  return 9 * residual * residual;
}

TEST_CASE_TEMPLATE("exact lengths are met from a cold start", Scalar, double, float) {
  const Prism<double> prism;
  const Prism<Scalar> same;
  Solver<Scalar> solver(same);
  Samples samples(20);
  for (int n = 0; n < 300; ++n) {
    const CableLengths<double> lengths = cable_lengths(samples.shape(prism).endcaps());
    solver.reset();
    REQUIRE(solver.solve(lengths.cast<Scalar>()) == Status::kOk);
    const bool is_double = std::is_same_v<Scalar, double>;
    CHECK(solver.cost() < (is_double ? exact_cost() : 1e-10));
    CHECK(handedness(solver.endcaps(), Scalar(-1)) == Handedness::kRight);
    CHECK(std::abs(spin_angle(solver.endcaps(), same.undeformed())) <
          100 * std::numeric_limits<Scalar>::epsilon());
  }
}

TEST_CASE("a mirror-image robot is solved as well as the robot") {
  Prism<double> prism;
  prism.chirality = Chirality::kClockwise;
  Solver<double> solver(prism);
  Samples samples(21);
  for (int n = 0; n < 50; ++n) {
    solver.reset();
    REQUIRE(solver.solve(cable_lengths(samples.shape(prism).endcaps())) == Status::kOk);
    CHECK(handedness(solver.endcaps(), 1.0) == Handedness::kRight);
    CHECK(solver.cost() < exact_cost());
  }
}

TEST_CASE("a cold start takes the branch of positive fold where the lengths have one") {
  const Prism<double> prism;
  Solver<double> solver(prism);
  Samples samples(22);
  int shapes = 0;
  int positive = 0;
  for (int n = 0; n < 300; ++n) {
    const Rods<double> truth = samples.shape(prism, 0.04);
    if (fold(truth, -1.0) < 0.1) continue;
    ++shapes;
    solver.reset();
    REQUIRE(solver.solve(cable_lengths(truth.endcaps())) == Status::kOk);
    positive += fold(solver.rods(), -1.0) > 0 ? 1 : 0;
  }
  REQUIRE(shapes > 50);
  CHECK(positive == shapes);
}

TEST_CASE("a warm start stays on its branch") {
  const Prism<double> prism;
  Samples samples(23);
  for (int n = 0; n < 20; ++n) {
    Rods<double> truth = samples.shape(prism, 0.04);
    if (fold(truth, -1.0) < 0.5) continue;
    Solver<double> solver(prism);
    REQUIRE(solver.solve(cable_lengths(truth.endcaps())) == Status::kOk);
    truth = solver.rods();  // whichever solution it is, the next ones are close to it
    for (int k = 0; k < 50; ++k) {
      Rods<double> next = truth;
      next.retract(samples.normal<kTangent>(1e-3));
      if (fold(next, -1.0) < 0.3) continue;
      truth = next;
      REQUIRE(solver.solve(cable_lengths(truth.endcaps())) == Status::kOk);
      const Endcaps<double> expected = in_procrustes_gauge(truth.endcaps(), prism.undeformed());
      CHECK((solver.endcaps() - expected).norm() < 1e-6);
    }
  }
}

TEST_CASE("the endcap Jacobian without noise limit agrees with finite differences") {
  // J_p = dq/dl: for tiny errors away from the fold the covariance is sigma^2 J_p J_p'.
  const Prism<double> prism;
  Samples samples(24);
  Solver<double> solver(prism);
  int checked = 0;
  while (checked < 5) {
    const Rods<double> truth = samples.shape(prism, 0.04);
    if (fold(truth, -1.0) < 0.5) continue;
    const CableLengths<double> lengths = cable_lengths(truth.endcaps());
    solver.reset();
    REQUIRE(solver.solve(lengths) == Status::kOk);
    const double sigma = 1e-9;
    Matrix<double, 18> covariance;
    REQUIRE(solver.covariance(sigma, covariance) == Status::kOk);
    Matrix<double, 18, 9> jacobian;
    const double step = 1e-5;
    for (int k = 0; k < 9; ++k) {
      const CableLengths<double> change = step * CableLengths<double>::Unit(k);
      Solver<double> up = solver;
      Solver<double> down = solver;
      REQUIRE(up.solve(lengths + change) == Status::kOk);
      REQUIRE(down.solve(lengths - change) == Status::kOk);
      jacobian.col(k) = (up.endcaps() - down.endcaps()).reshaped() / (2 * step);
    }
    const Matrix<double, 18> expected = jacobian * jacobian.transpose();
    CHECK((covariance / (sigma * sigma) - expected).norm() < 1e-3 * expected.norm());
    ++checked;
  }
}

TEST_CASE("with a 20 mm prior the predicted covariance is that of a Monte Carlo experiment") {
  const Prism<double> prism;
  const Endcaps<double> reference = prism.undeformed();
  const double cable_std = 0.002;
  const double prior_std = 0.02;
  Samples samples(25);
  for (int n = 0; n < 8; ++n) {
    Solver<double> solver(prism);
    REQUIRE(solver.solve(cable_lengths(samples.shape(prism, 0.06).endcaps())) == Status::kOk);
    const Rods<double> truth = solver.rods();
    const CableLengths<double> lengths = cable_lengths(truth.endcaps());
    Matrix<double, 18> predicted;
    REQUIRE(solver.covariance(cable_std, prior_std, predicted) == Status::kOk);

    const int draws = 1500;
    double squared = 0;
    for (int k = 0; k < draws; ++k) {
      // Most probable shape given a noisy prior and noisy lengths, by Gauss-Newton.
      const Tangent<double> prior = samples.normal<kTangent>(prior_std);
      const CableLengths<double> measured = lengths + samples.normal<9>(cable_std);
      Tangent<double> delta = prior;
      Rods<double> rods = truth;
      for (int iteration = 0; iteration < 8; ++iteration) {
        rods = truth;
        rods.retract(delta);
        const LengthJacobian<double> j = length_jacobian(rods) / cable_std;
        const Vector<double, 9> r = (measured - cable_lengths(rods.endcaps())) / cable_std;
        TangentMatrix<double> information = j.transpose() * j;
        information.diagonal().array() += 1 / (prior_std * prior_std);
        delta +=
            information.llt().solve(j.transpose() * r - (delta - prior) / (prior_std * prior_std));
      }
      squared += (in_procrustes_gauge(rods.endcaps(), reference) - truth.endcaps()).squaredNorm();
    }
    CHECK(predicted.trace() == doctest::Approx(squared / draws).epsilon(0.15));
  }
}

TEST_CASE("on the fold the covariance without prior stays finite and true") {
  // The plain formula has no limit here: the smallest singular value is zero.
  const Prism<double> prism;
  const Endcaps<double> truth = prism.undeformed();
  const CableLengths<double> lengths = cable_lengths(truth);
  const double cable_std = 0.002;
  Solver<double> solver(prism);
  REQUIRE(solver.solve(lengths) == Status::kOk);
  Matrix<double, 18> predicted;
  REQUIRE(solver.covariance(cable_std, predicted) == Status::kOk);
  Samples samples(26);
  const int draws = 3000;
  double squared = 0;
  int unfinished = 0;  // one in 7000 creeps along the mechanism until its iterations are used up
  for (int k = 0; k < draws; ++k) {
    solver.reset();
    const Status status = solver.solve(lengths + samples.normal<9>(cable_std));
    if (status == Status::kNotConverged) {
      ++unfinished;
    } else {
      REQUIRE(status == Status::kOk);
    }
    squared += (solver.endcaps() - truth).squaredNorm();
  }
  CHECK(unfinished <= 3);
  CHECK(predicted.trace() == doctest::Approx(squared / draws).epsilon(0.15));
}

TEST_CASE("covariances are symmetric, positive semi-definite and blind to the spin") {
  const Prism<double> prism;
  Solver<double> solver(prism);
  Matrix<double, 18> covariance;
  CHECK(solver.covariance(0.002, covariance) == Status::kNotInitialized);
  CHECK(solver.covariance(0.002, 0.02, covariance) == Status::kNotInitialized);
  Samples samples(27);
  REQUIRE(solver.solve(cable_lengths(samples.shape(prism).endcaps())) == Status::kOk);
  for (const bool prior : {false, true}) {
    REQUIRE((prior ? solver.covariance(0.002, 0.02, covariance)
                   : solver.covariance(0.002, covariance)) == Status::kOk);
    CHECK(covariance == covariance.transpose());
    CHECK(covariance.topRows<6>().isZero());
    const Vector<double, 18> w = spin_gradient(solver.endcaps(), prism.undeformed());
    CHECK((covariance * w).norm() < 1e-12);
    for (int k = 0; k < 100; ++k) {
      const Vector<double, 18> v = samples.normal<18>(1);
      CHECK(v.dot(covariance * v) > -1e-15);
    }
  }
  CHECK(solver.covariance(-1, covariance) == Status::kOutOfRange);
  CHECK(solver.covariance(0.002, 0, covariance) == Status::kOutOfRange);
  CHECK(solver.covariance(1e-200, 0.02, covariance) == Status::kOutOfRange);  // its square is 0
  CHECK(solver.covariance(kNaN, covariance) == Status::kNotFinite);
}

TEST_CASE("bad lengths are refused and change nothing") {
  const Prism<double> prism;
  Solver<double> solver(prism);
  Samples samples(28);
  const CableLengths<double> good = cable_lengths(samples.shape(prism).endcaps());
  REQUIRE(solver.solve(good) == Status::kOk);
  const Endcaps<double> before = solver.endcaps();
  for (const auto& [bad, expected] :
       {std::pair{kNaN, Status::kNotFinite},
        std::pair{std::numeric_limits<double>::infinity(), Status::kNotFinite},
        std::pair{0.0, Status::kOutOfRange}, std::pair{-1.0, Status::kOutOfRange},
        std::pair{3.01 * prism.rod_length, Status::kOutOfRange}}) {
    for (int k = 0; k < 9; ++k) {
      CableLengths<double> lengths = good;
      lengths[k] = bad;
      CHECK(solver.solve(lengths) == expected);
      CHECK(solver.endcaps() == before);
    }
  }
}

TEST_CASE_TEMPLATE("whatever the lengths, the shape stays finite and valid", Scalar, double,
                   float) {
  const Prism<Scalar> prism;
  Solver<Scalar> solver(prism);
  Samples samples(29);
  for (int n = 0; n < 200; ++n) {
    const CableLengths<double> lengths =
        (samples.normal<9>(1).cwiseAbs().array() + 0.01).min(4.3).matrix();
    solver.solve(lengths.cast<Scalar>());
    CHECK(solver.endcaps().allFinite());
    CHECK(handedness(solver.endcaps(), prism.moment_sign()) == Handedness::kRight);
  }
}

}  // namespace
}  // namespace tensegrity::shape
