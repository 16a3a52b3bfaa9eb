#include <doctest/doctest.h>

#include <random>

#include "tensegrity/math/sek3.hpp"

namespace {

using tensegrity::SEk3;
using tensegrity::SO3;

// A uniform wrapper so that one set of properties is checked for every group.
template <typename Group, typename Scalar>
void check_group(Scalar tolerance, Scalar largest_angle) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> log_scale(-6, 0);
  using Tangent = typename Group::Tangent;
  for (int trial = 0; trial < 300; ++trial) {
    const auto draw = [&](Scalar rotation_size) {
      Tangent x;
      for (int i = 0; i < Group::Dof; ++i) x[i] = Scalar(normal(random));
      x.template head<3>() *= rotation_size / x.template head<3>().norm();
      return x;
    };
    const Scalar angle = largest_angle * Scalar(std::pow(10.0, log_scale(random)));
    const Tangent x = draw(angle);
    const Group g = Group::Exp(x);

    CHECK((g.Log() - x).norm() < tolerance * (1 + x.norm()));
    CHECK(((g * g.inverse()).matrix() - Group().matrix()).norm() < tolerance);

    // Adjoint: g Exp(y) g^-1 = Exp(Ad_g y).
    const Tangent y = draw(Scalar(0.5));
    CHECK(((g * Group::Exp(y) * g.inverse()).matrix() - Group::Exp(Tangent(g.Adj() * y)).matrix())
              .norm() < 20 * tolerance);

    // Left Jacobian against central differences of Log(Exp(x + h e) Exp(x)^-1).
    const tensegrity::Matrix<Scalar, Group::Dof> jacobian = Group::left_jacobian(x);
    const Scalar h = std::cbrt(std::numeric_limits<Scalar>::epsilon());
    for (int i = 0; i < Group::Dof; ++i) {
      Tangent plus = x, minus = x;
      plus[i] += h;
      minus[i] -= h;
      const Tangent numeric =
          ((Group::Exp(plus) * g.inverse()).Log() - (Group::Exp(minus) * g.inverse()).Log()) /
          (2 * h);
      CHECK((numeric - jacobian.col(i)).norm() < 50 * h * h * (1 + x.norm()));
    }
    const tensegrity::Matrix<Scalar, Group::Dof> product =
        jacobian * Group::left_jacobian_inverse(x);
    CHECK((product - tensegrity::Matrix<Scalar, Group::Dof>::Identity()).norm() <
          20 * tolerance * (1 + x.norm()));
  }
}

}  // namespace

TEST_CASE("SO(3) and SE_k(3): Exp, Log, Adjoint, Jacobians (double)") {
  check_group<SO3<double>>(1e-11, 3.0);
  check_group<SEk3<double, 1>>(1e-11, 3.0);
  check_group<SEk3<double, 2>>(1e-11, 3.0);
  check_group<SEk3<double, 8>>(1e-11, 3.0);
}

TEST_CASE("SO(3) and SE_k(3): Exp, Log, Adjoint, Jacobians (float)") {
  check_group<SO3<float>>(1e-5f, 3.0f);
  check_group<SEk3<float, 2>>(1e-5f, 3.0f);
}

TEST_CASE("Log near half a turn") {
  for (const double angle : {3.0, 3.14, 3.14159, 3.1415926}) {
    for (int k = 0; k < 3; ++k) {
      tensegrity::Vector3<double> x(0.3, -0.2, 0.1);
      x[k] += 1;
      x *= angle / x.norm();
      CHECK((SO3<double>::Exp(x).Log() - x).norm() < 1e-7);
    }
  }
}

TEST_CASE("Gamma_2 is the integral of s Exp(s x)") {
  const tensegrity::Vector3<double> x(0.4, -1.1, 0.7);
  // Gamma_2(x) = integral over 0..1 of (1 - s) Exp(s x); midpoint rule with many nodes.
  tensegrity::Matrix3<double> integral = tensegrity::Matrix3<double>::Zero();
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const double s = (i + 0.5) / n;
    integral += (1 - s) * SO3<double>::Exp(s * x).matrix() / n;
  }
  CHECK((integral - tensegrity::Gamma<double>(x).g2).norm() < 1e-8);
}

TEST_CASE("orthonormalized removes rounding drift") {
  tensegrity::Matrix3<double> r = SO3<double>::Exp({0.3, 0.2, -0.9}).matrix();
  r += 1e-6 * tensegrity::Matrix3<double>::Ones();
  tensegrity::store_block(tensegrity::orthonormalized(tensegrity::to_block(r)), r);
  CHECK((r * r.transpose() - tensegrity::Matrix3<double>::Identity()).norm() < 1e-10);
}

TEST_CASE_TEMPLATE("slopes of the series of rotations", Scalar, double, float) {
  using Series = tensegrity::RotationSeries<Scalar>;
  const Scalar h = std::cbrt(std::numeric_limits<Scalar>::epsilon());
  for (const double value : {0.003, 0.05, 0.2, 0.3, 0.33, 0.8, 2.5}) {
    const Scalar angle = Scalar(value);
    const auto slopes = Series(angle * angle).slopes();
    const Series plus((angle + h) * (angle + h)), minus((angle - h) * (angle - h));
    CHECK(std::abs(slopes.c2 * angle - (plus.c2 - minus.c2) / (2 * h)) < 20 * h * h);
    CHECK(std::abs(slopes.c3 * angle - (plus.c3 - minus.c3) / (2 * h)) < 20 * h * h);
    CHECK(std::abs(slopes.c4 * angle - (plus.c4 - minus.c4) / (2 * h)) < 20 * h * h);
  }
}

TEST_CASE_TEMPLATE("shortest_rotation takes one vector to the other and spins about neither",
                   Scalar, double, float) {
  using V3 = tensegrity::Vector3<Scalar>;
  using M3 = tensegrity::Matrix3<Scalar>;
  const Scalar tolerance = 20 * std::numeric_limits<Scalar>::epsilon();
  const V3 from = V3(Scalar(0.3), Scalar(-0.7), Scalar(0.5)).normalized();
  const V3 across = from.unitOrthogonal();
  for (const double angle : {0.0, 1e-9, 1e-4, 0.3, 1.6, 3.0, 3.1415926535897931}) {
    const V3 to = (std::cos(Scalar(angle)) * from + std::sin(Scalar(angle)) * across).normalized();
    const M3 r = tensegrity::shortest_rotation<Scalar>(from, to);
    // Below its smallest angle it is the identity, so much is left.
    CHECK((r * from - to).norm() < tolerance + Scalar(1.1e-6));
    CHECK((r * r.transpose() - M3::Identity()).norm() < tolerance);
    CHECK(r.determinant() > 0);
    CHECK((r.trace() - 1) / 2 == doctest::Approx(std::cos(angle)).epsilon(1e-5));
  }
}
