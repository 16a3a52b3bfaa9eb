// Derivatives, gauge, fold and constraints: the mathematics under the solvers.
#include <doctest/doctest.h>

#include "shape_samples.hpp"
#include "tensegrity/shape/fold.hpp"

namespace tensegrity::shape {
namespace {

using test::Samples;

constexpr double kStep = 1e-5;  // central differences: error about 1e-10 of the third derivative

Rods<double> moved(Rods<double> rods, const Tangent<double>& delta) {
  rods.retract(delta);
  return rods;
}

template <int Rows, typename Function>
Matrix<double, Rows, kTangent> differences(const Rods<double>& rods, Function&& f) {
  Matrix<double, Rows, kTangent> out;
  for (int i = 0; i < kTangent; ++i) {
    const Tangent<double> delta = kStep * Tangent<double>::Unit(i);
    out.col(i) = (f(moved(rods, delta)) - f(moved(rods, -delta))) / (2 * kStep);
  }
  return out;
}

Endcaps<double> mirrored(Endcaps<double> q) {
  q.row(1) *= -1;
  return q;
}

TEST_CASE("rods keep their length, stay in the body frame and reproduce endcaps") {
  const Prism<double> prism;
  Samples samples(1);
  for (int n = 0; n < 50; ++n) {
    const Rods<double> rods = samples.shape(prism);
    const Endcaps<double> q = rods.endcaps();
    for (int rod = 0; rod < 3; ++rod) {
      CHECK((q.col(2 * rod) - q.col(2 * rod + 1)).norm() == doctest::Approx(prism.rod_length));
    }
    CHECK(q.col(0) == prism.endcap0());
    CHECK((Rods<double>(prism, q).endcaps() - q).norm() < 1e-14);
    for (int k = 0; k < 2; ++k) {
      CHECK((rods.rod(k).frame.transpose() * rods.rod(k).frame).isIdentity(1e-12));
      CHECK(rods.rod(k).frame.determinant() == doctest::Approx(1));
    }
  }
}

TEST_CASE("first and second derivatives agree with finite differences") {
  const Prism<double> prism;
  Samples samples(2);
  for (int n = 0; n < 20; ++n) {
    const Rods<double> rods = samples.shape(prism);
    const auto stacked = [](const Rods<double>& r) -> Vector<double, 18> {
      return r.endcaps().reshaped();
    };
    const auto lengths = [](const Rods<double>& r) { return cable_lengths(r.endcaps()); };
    CHECK((rods.endcap_jacobian() - differences<18>(rods, stacked)).norm() < 1e-8);
    CHECK((length_jacobian(rods) - differences<9>(rods, lengths)).norm() < 1e-8);

    const Vector<double, 9> weights = samples.normal<9>(1);
    const TangentMatrix<double> hessian = test::weighted_length_hessian(rods, weights);
    // Second derivatives along straight tangent lines from `rods`, not from the moved shape.
    const double h = 1e-4;
    for (int i = 0; i < kTangent; ++i) {
      for (int j = 0; j <= i; ++j) {
        const auto at = [&](double a, double b) {
          const Tangent<double> delta =
              a * h * Tangent<double>::Unit(i) + b * h * Tangent<double>::Unit(j);
          return weights.dot(lengths(moved(rods, delta)));
        };
        const double expected = (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / (4 * h * h);
        CHECK(hessian(i, j) == doctest::Approx(expected).epsilon(1e-5).scale(1));
        CHECK(hessian(j, i) == doctest::Approx(hessian(i, j)).epsilon(1e-9).scale(1));
      }
    }
    Matrix<double, kTangent, 9> vectors;
    Tangent<double> sum = Tangent<double>::Zero();
    for (int k = 0; k < 9; ++k) {
      vectors.col(k) = samples.normal<kTangent>(1);
      sum += test::weighted_length_hessian(rods, Vector<double, 9>::Unit(k)) * vectors.col(k);
    }
    CHECK((length_hessian_products(rods, vectors) - sum).norm() < 1e-12);
    const auto distance = [](const Rods<double>& r) { return Vector<double, 1>(fold(r, -1.0)); };
    CHECK((fold_gradient(rods, -1.0).transpose() - differences<1>(rods, distance)).norm() < 1e-5);
  }
}

TEST_CASE("the spin about z changes no length and is the null vector of the length Jacobian") {
  const Prism<double> prism;
  Samples samples(3);
  for (int n = 0; n < 50; ++n) {
    Rods<double> rods = samples.shape(prism);
    const CableLengths<double> before = cable_lengths(rods.endcaps());
    CHECK((length_jacobian(rods) * spin_tangent(rods)).norm() < 1e-12);
    CHECK(spin_tangent(rods).norm() == doctest::Approx(1));
    rods.rotate_about_z(1.3);
    CHECK((cable_lengths(rods.endcaps()) - before).norm() < 1e-14);
  }
}

TEST_CASE("the Procrustes gauge is the best fit and does not depend on the spin") {
  const Prism<double> prism;
  const Endcaps<double> reference = prism.undeformed();
  Samples samples(4);
  for (int n = 0; n < 50; ++n) {
    const Endcaps<double> q = samples.shape(prism).endcaps();
    CHECK(std::abs(spin_angle(q, reference)) < 1e-12);
    CHECK(spin_angle(rotate_about_z(q, 2.0), reference) == doctest::Approx(2.0));
    CHECK((in_procrustes_gauge(rotate_about_z(q, -1.1), reference) - q).norm() < 1e-12);
    for (const double angle : {-0.1, 0.1}) {
      CHECK((rotate_about_z(q, angle) - reference).norm() > (q - reference).norm());
    }
  }
}

TEST_CASE("the gauge of a covariance is the derivative of the gauge of a shape") {
  const Prism<double> prism;
  const Endcaps<double> reference = prism.undeformed();
  Samples samples(5);
  for (int n = 0; n < 20; ++n) {
    const Rods<double> rods = samples.shape(prism);
    const Endcaps<double> q = rods.endcaps();
    const auto gauged = [&](const Rods<double>& r) -> Vector<double, 18> {
      return in_procrustes_gauge(r.endcaps(), reference).reshaped();
    };
    const Matrix<double, 18, kTangent> expected = differences<18>(rods, gauged);
    CHECK((rods.endcap_jacobian() * gauge_projection(rods, reference) - expected).norm() < 1e-8);

    const EndcapJacobian<double> d = rods.endcap_jacobian();
    const Matrix<double, 18> any_gauge = d * d.transpose();
    const Matrix<double, 18> mapped = to_procrustes_gauge(any_gauge, q, reference);
    CHECK((mapped - expected * expected.transpose()).norm() < 1e-7);
    CHECK((to_procrustes_gauge(mapped, q, reference) - mapped).norm() < 1e-10);
    CHECK((mapped * spin_gradient(q, reference)).norm() < 1e-10);
  }
}

TEST_CASE("moving rods to the gauge carries their covariance along") {
  const Prism<double> prism;
  const Endcaps<double> reference = prism.undeformed();
  Samples samples(6);
  Rods<double> rods = samples.shape(prism);
  TangentMatrix<double> covariance = TangentMatrix<double>::Zero();
  for (int i = 0; i < kTangent; ++i) {
    const Tangent<double> v = samples.normal<kTangent>(0.01);
    covariance += v * v.transpose();
  }
  const Matrix<double, 18> expected = endcap_covariance(rods, covariance, reference);
  rods.rotate_about_z(0.7);  // the same shape, with the same uncertainty in turned axes
  TangentMatrix<double> turn = TangentMatrix<double>::Identity();
  turn.block<3, 3>(0, 0) = Rods<double>::rotation_about_z(0.7);
  turn.block<3, 3>(5, 5) = turn.block<3, 3>(0, 0);
  covariance = (turn * covariance * turn.transpose()).eval();
  move_to_procrustes_gauge(rods, reference, covariance);
  CHECK((endcap_covariance(rods, covariance, reference) - expected).norm() < 1e-12);
}

TEST_CASE("an unloaded symmetric prism stands on the fold") {
  // Its self-stress is a left null vector of the length Jacobian. 1.46 /m: curvature of T's robot.
  const Prism<double> prism;
  const FoldAnalysis<double> analysis = analyse_fold(Rods<double>(prism, prism.undeformed()));
  CHECK(analysis.smallest() < 1e-12);
  CHECK(analysis.singular_values[7] > 0.46);
  CHECK(std::abs(analysis.curvature) == doctest::Approx(1.46).epsilon(0.01));
  // A self-stress of tensions only: all of one sign.
  CHECK(std::abs(analysis.self_stress.array().sign().sum()) == 9);
}

TEST_CASE("singular vectors across the spin diagonalise the length Jacobian") {
  const Prism<double> prism;
  Samples samples(7);
  const Rods<double> rods = samples.shape(prism);
  const LengthJacobian<double> jacobian = length_jacobian(rods);
  const FoldAnalysis<double> analysis = analyse_fold(rods);
  CHECK((analysis.motions.transpose() * spin_tangent(rods)).norm() < 1e-10);
  const Matrix<double, 9> gram =
      (jacobian * analysis.motions).transpose() * jacobian * analysis.motions;
  CHECK((gram - Matrix<double, 9>(analysis.singular_values.cwiseAbs2().asDiagonal())).norm() <
        1e-10);
  CHECK((jacobian.transpose() * analysis.self_stress).norm() ==
        doctest::Approx(analysis.smallest()).epsilon(1e-6));
}

TEST_CASE("the gradient of fold is exact on the fold") {
  const Prism<double> prism;
  const Rods<double> rods(prism, prism.undeformed());
  const Fold<double> on_fold(rods, -1.0);
  CHECK(std::abs(on_fold.value()) < 1e-12);
  const auto distance = [](const Rods<double>& r) { return Vector<double, 1>(fold(r, -1.0)); };
  CHECK((on_fold.gradient().transpose() - differences<1>(rods, distance)).norm() < 1e-6);
  CHECK(on_fold.gradient().norm() > 1);
}

TEST_CASE("fold has one sign for a robot and its mirror image, and changes it across the fold") {
  const Prism<double> prism;
  const Rods<double> start(prism, prism.undeformed());
  const Tangent<double> mechanism = analyse_fold(start).mechanism();
  Rods<double> one = moved(start, 0.02 * mechanism);
  const Rods<double> other = moved(start, -0.02 * mechanism);
  CHECK(fold(one, -1.0) * fold(other, -1.0) < 0);
  const double value = fold(one, -1.0);
  one.reflect();
  CHECK(fold(one, 1.0) == doctest::Approx(value));
}

TEST_CASE("derivatives of every inequality agree with finite differences") {
  const Prism<double> prism;
  Samples samples(8);
  for (const auto set :
       {ConstraintSet::kAsPrinted, ConstraintSet::kCorrected, ConstraintSet::kMutualMoment}) {
    const InequalitySet<double> inequalities(set, prism.moment_sign());
    const Endcaps<double> q = samples.shape(prism).endcaps();
    for (int i = 0; i < inequalities.size(); ++i) {
      const Vector<double, 18> gradient = inequalities[i].gradient(q).reshaped();
      const Matrix<double, 18> hessian = inequalities[i].hessian(q);
      for (int k = 0; k < 18; ++k) {
        Endcaps<double> up = q;
        Endcaps<double> down = q;
        up.reshaped()[k] += kStep;
        down.reshaped()[k] -= kStep;
        const double slope =
            (inequalities[i].value(up) - inequalities[i].value(down)) / (2 * kStep);
        CHECK(gradient[k] == doctest::Approx(slope).epsilon(1e-7).scale(1));
        const Vector<double, 18> column =
            (inequalities[i].gradient(up) - inequalities[i].gradient(down)).reshaped() /
            (2 * kStep);
        CHECK((hessian.col(k) - column).norm() < 1e-8);
      }
    }
  }
}

TEST_CASE("every undeformed robot violates the constraints as printed, through (15i) in any case") {
  for (const double side : {0.7, 0.98, 1.1}) {
    for (const auto chirality : {Chirality::kCounterClockwise, Chirality::kClockwise}) {
      Prism<double> prism;
      prism.side_length = side;
      prism.chirality = chirality;
      const Endcaps<double> q = prism.undeformed();
      const InequalitySet<double> printed(ConstraintSet::kAsPrinted, prism.moment_sign());
      const InequalitySet<double> corrected(ConstraintSet::kCorrected, prism.moment_sign());
      const int circulation = 6;  // 15i, after four heights, 15g and 15h
      CHECK_FALSE(printed.satisfied(q));
      CHECK(printed[circulation].value(q) < 0);
      CHECK(corrected[circulation].value(q) == doctest::Approx(-printed[circulation].value(q)));
      // By symmetry 15g-i say the same about the undeformed robot once the sign is repaired.
      CHECK(corrected[circulation].value(q) == doctest::Approx(corrected[4].value(q)));
      CHECK(InequalitySet<double>(ConstraintSet::kMutualMoment, prism.moment_sign()).satisfied(q));
    }
  }
}

TEST_CASE("(15j-l) cannot tell a robot from its mirror image, mutual moments can") {
  const Prism<double> prism;
  const InequalitySet<double> printed(ConstraintSet::kAsPrinted, prism.moment_sign());
  Samples samples(9);
  for (int n = 0; n < 100; ++n) {
    const Endcaps<double> q = samples.shape(prism).endcaps();
    for (int i = 7; i < 10; ++i) {
      CHECK(printed[i].value(mirrored(q)) == doctest::Approx(printed[i].value(q)));
    }
    CHECK((mutual_moments(mirrored(q)) + mutual_moments(q)).norm() < 1e-12);
    CHECK(handedness(q, -1.0) == Handedness::kRight);
    CHECK(handedness(mirrored(q), -1.0) == Handedness::kMirrored);
  }
}

TEST_CASE("(15d,e) reject valid deformed shapes") {
  const Prism<double> prism;
  const InequalitySet<double> corrected(ConstraintSet::kCorrected, prism.moment_sign());
  Samples samples(10);
  int rejected = 0;
  for (int n = 0; n < 1000; ++n) {
    const Endcaps<double> q = samples.shape(prism).endcaps();
    bool heights = true;
    for (int i = 0; i < 4; ++i) heights = heights && corrected[i].value(q) > 0;
    rejected += heights ? 0 : 1;
  }
  CHECK(rejected > 60);
}

TEST_CASE("a mutual moment is zero exactly where two rod axes cross, and changes sign there") {
  const Prism<double> prism;
  Samples samples(11);
  for (int n = 0; n < 50; ++n) {
    Endcaps<double> q = samples.shape(prism).endcaps();
    // Slide rod 23 along the common perpendicular of its axis and that of rod 01.
    const Vector3<double> z = Vector3<double>::UnitZ();
    const Vector3<double> u = (q.col(2) - q.col(3)).normalized();
    const Vector3<double> perpendicular = z.cross(u);
    const double distance = (q.col(2) - q.col(0)).dot(perpendicular.normalized());
    CHECK(mutual_moments(q)[0] == doctest::Approx(distance * perpendicular.norm()));
    const auto slid = [&](double by) {
      Endcaps<double> out = q;
      out.middleCols<2>(2).colwise() += by * perpendicular.normalized();
      return mutual_moments(out)[0];
    };
    CHECK(std::abs(slid(-distance)) < 1e-12);
    CHECK(slid(-distance + 1e-3) > 0);
    CHECK(slid(-distance - 1e-3) < 0);
  }
}

TEST_CASE("reflecting y repairs a mirrored shape and changes no length") {
  const Prism<double> prism;
  Samples samples(12);
  for (int n = 0; n < 50; ++n) {
    Rods<double> rods = samples.shape(prism);
    const Endcaps<double> q = rods.endcaps();
    rods.reflect();
    CHECK((rods.endcaps() - mirrored(q)).norm() < 1e-14);
    CHECK((cable_lengths(rods.endcaps()) - cable_lengths(q)).norm() < 1e-14);
    CHECK(handedness(rods.endcaps(), -1.0) == Handedness::kMirrored);
    rods.reflect();
    CHECK((rods.endcaps() - q).norm() < 1e-14);
  }
}

}  // namespace
}  // namespace tensegrity::shape
