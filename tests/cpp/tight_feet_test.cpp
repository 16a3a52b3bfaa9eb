// Feet as measurements: slip and height, and their rows against finite differences.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "tensegrity/tight/feet.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::hat;
using tensegrity::Prism;
using tensegrity::tight::Foot;
using tensegrity::tight::Row;
using M3 = tensegrity::Matrix3<double>;

constexpr int kSeeds = 20;
constexpr double kTolerance = 20 * kDerivativeError;  // norms of vectors of some twenty entries

VectorXd dense(const Row<double>& row) {
  VectorXd h(B::Dim);
  for (int k = 0; k < B::Dim; ++k) h[k] = row.times(VectorXd(VectorXd::Unit(B::Dim, k)).data());
  return h;
}

constexpr double kUnmeasured = std::numeric_limits<double>::quiet_NaN();

// Velocity of the point of a sphere that touches a plane with normal n, from the definition: the
// angular velocity of its rod is that of its direction, and along the rod the measured spin, or
// else that of the base rod.
V3 touching_velocity(const B& belief, int endcap, const Prism<double>& robot, const V3& n,
                     double spin) {
  V3 omega = belief.rotation * belief.rate;
  if (endcap >= 2) {
    const int even = endcap / 2 * 2;
    const V3 u = (belief.endcap(even) - belief.endcap(even + 1)).normalized();
    const V3 u_rate =
        (belief.endcap_velocity(even) - belief.endcap_velocity(even + 1)) / robot.rod_length;
    omega = u.cross(u_rate) + u * (std::isnan(spin) ? u.dot(omega) : spin);
  }
  return belief.endcap_velocity(endcap) + omega.cross(-robot.endcap_radius * n);
}

}  // namespace

TEST_CASE("feet: the slip is that of the touching point of a rolling sphere") {
  const Prism<double> robot;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Samples samples(seed);
    const B belief = samples.belief(robot);
    const V3 n = belief.ground_normal();
    for (int endcap = 0; endcap < 6; ++endcap) {
      for (const double spin : {kUnmeasured, 0.0, 1.7}) {
        const Foot<double> foot(belief, endcap, robot.endcap_radius, robot.rod_length, n, spin);
        CHECK((foot.slip() - touching_velocity(belief, endcap, robot, n, spin)).norm() < 1e-12);
      }
    }
  }
}

// The row of the slip s = w - r Omega x n leaves out, on purpose, what is of second order for a
// foot that stands still and of order r |Omega| otherwise: that s itself turns with the rotation's
// error while n does not, and that the rod's direction u is uncertain. To first order
//   ds = row + xi_R x s + r Omega x (xi_R x n)
//        - r [(du x turn) x n + (du . Omega_0) u x n + (u . Omega_0) du x n],
// du the part across u of (xi_a - xi_b) / |q_a - q_b|, Omega_0 the base rod's rate. Of a rod whose
// spin is measured that stands for u . Omega_0, and does not depend on du.
TEST_CASE("feet: rows of the slip are its derivative but for rolling's dependence on direction") {
  const Prism<double> robot;
  const double r = robot.endcap_radius;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Samples samples(seed);
    const B belief = samples.belief(robot);
    const V3 n = belief.ground_normal();
    const V3 base_rate = belief.rotation * belief.rate;
    for (int endcap = 0; endcap < 6; ++endcap) {
      const double spin = samples.uniform(0, 1) < 0.5 ? kUnmeasured : samples.normal();
      const Foot<double> foot(belief, endcap, r, robot.rod_length, n, spin);
      const MatrixXd numeric = derivative(belief, [&](const B& b) {
        return VectorXd(touching_velocity(b, endcap, robot, n, spin));
      });

      V3 omega = base_rate;
      MatrixXd left_out = MatrixXd::Zero(3, B::Dim);
      if (endcap >= 2) {
        const int even = endcap / 2 * 2;
        const V3 span = belief.endcap(even) - belief.endcap(even + 1);
        const V3 u = span.normalized();
        const V3 turn =
            (belief.endcap_velocity(even) - belief.endcap_velocity(even + 1)) / robot.rod_length;
        const bool measured = !std::isnan(spin);
        const double about_itself = measured ? spin : u.dot(base_rate);
        omega = u.cross(turn) + u * about_itself;
        M3 by_direction = -r * (hat(n) * hat(turn) - about_itself * hat(n));
        if (!measured) by_direction -= r * u.cross(n) * base_rate.transpose();
        const M3 across = (M3::Identity() - u * u.transpose()) / span.norm();
        left_out.middleCols<3>(B::endcap_index(even)) = by_direction * across;
        left_out.middleCols<3>(B::endcap_index(even + 1)) = -by_direction * across;
      }
      left_out.middleCols<3>(B::kRotation) = -hat(foot.slip()) - r * hat(omega) * hat(n);

      for (int k = 0; k < 3; ++k) {  // along anything, not only along the ground
        const V3 direction = samples.vector(1);
        const VectorXd expected = (numeric - left_out).transpose() * direction;
        CHECK((dense(foot.along(direction)) - expected).norm() < kTolerance);
      }
      CHECK((dense(foot.rise()) - dense(foot.along(n))).norm() < 1e-14);
    }
  }
}

// The row of the height leaves out that a sphere on a slope touches beside its lowest point,
// d(r |up|) = r m . dm / |up|.
TEST_CASE("feet: rows of the height are its derivative") {
  const Prism<double> robot;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Samples samples(seed);
    const B belief = samples.belief(robot);
    const Eigen::Vector2d slope = belief.ground.tail<2>();
    for (int endcap = 0; endcap < 6; ++endcap) {
      const auto height = [&](const B& b) {
        return VectorXd::Constant(1, tensegrity::tight::height(b, endcap, robot.endcap_radius));
      };
      VectorXd expected = derivative(belief, height).transpose();
      expected.segment<2>(B::kGround + 1) +=
          robot.endcap_radius * slope / std::sqrt(1 + slope.squaredNorm());
      CHECK((dense(tensegrity::tight::height_row(belief, endcap)) - expected).norm() < kTolerance);
    }
  }
}

TEST_CASE("feet: a sphere that touches a sloped plane has height zero") {
  const Prism<double> robot;
  Samples samples(1);
  B belief = samples.belief(robot);
  const V3 n = belief.ground_normal();
  for (int endcap = 2; endcap < 6; ++endcap) {
    const V3 foot(0.3 * endcap, -0.2, 0);
    V3 touching = foot;
    touching.z() = belief.ground.dot(V3(1, foot.x(), foot.y()));
    belief.columns.col(endcap) = touching + robot.endcap_radius * n;
    CHECK(std::abs(tensegrity::tight::height(belief, endcap, robot.endcap_radius)) < 1e-12);
  }
}
