// Feet as measurements: slip and height, and their rows against finite differences.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "tensegrity/tight/feet.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::hat;
using tensegrity::Packet;
using tensegrity::Prism;
using tensegrity::tight::Foot;
using tensegrity::tight::FootRows;
using tensegrity::tight::Ground;
using M3 = tensegrity::Matrix3<double>;

constexpr int kSeeds = 20;
constexpr double kTolerance = 20 * kDerivativeError;  // norms of vectors of some twenty entries

// The row `k` of them.
VectorXd dense(const FootRows<double>& rows, int k) {
  VectorXd h(B::Dim);
  const B::Covariance unit = B::Covariance::Identity();
  for (int i = 0; i < B::Dim; i += 4) {
    Packet<double> columns[4];
    rows.times(&unit(0, i), columns, B::Dim);
    for (int c = 0; c < 4; ++c) h[i + c] = columns[c].at(k);
  }
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

double height(const B& belief, int endcap, const Prism<double>& robot) {
  const Ground<double> ground(belief);
  return Foot<double>(belief, ground, endcap, robot.endcap_radius, robot.rod_length).height();
}

}  // namespace

TEST_CASE("feet: the slip is that of the touching point of a rolling sphere") {
  const Prism<double> robot;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Samples samples(seed);
    const B belief = samples.belief(robot);
    const V3 n = belief.ground_normal();
    const Ground<double> ground(belief);
    for (int endcap = 0; endcap < 6; ++endcap) {
      for (const double spin : {kUnmeasured, 0.0, 1.7}) {
        const Foot<double> foot(belief, ground, endcap, robot.endcap_radius, robot.rod_length,
                                spin);
        CHECK((vector(foot.slip()) - touching_velocity(belief, endcap, robot, n, spin)).norm() <
              1e-12);
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
    const Ground<double> ground(belief);
    const V3 base_rate = belief.rotation * belief.rate;
    for (int endcap = 0; endcap < 6; ++endcap) {
      const double spin = samples.uniform(0, 1) < 0.5 ? kUnmeasured : samples.normal();
      const Foot<double> foot(belief, ground, endcap, r, robot.rod_length, spin);
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
      left_out.middleCols<3>(B::kRotation) = -hat(vector(foot.slip())) - r * hat(omega) * hat(n);

      // Along anything, not only along the ground.
      const V3 first = samples.vector(1), second = samples.vector(1);
      const FootRows<double> rows = foot.rows(Packet<double>(first), Packet<double>(second));
      const MatrixXd kept = numeric - left_out;
      CHECK((dense(rows, 0) - kept.transpose() * first).norm() < kTolerance);
      CHECK((dense(rows, 1) - kept.transpose() * second).norm() < kTolerance);
      CHECK((dense(rows, 2) - kept.transpose() * n).norm() < kTolerance);
      VectorXd across(B::Dim);  // its columns are fewer
      rows.cross(2, B::Covariance::Identity(), across.data());
      CHECK((across - dense(rows, 2)).norm() < 1e-14);
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
    const Ground<double> ground(belief);
    for (int endcap = 0; endcap < 6; ++endcap) {
      const auto height_of = [&](const B& b) {
        return VectorXd(VectorXd::Constant(1, height(b, endcap, robot)));
      };
      VectorXd expected = derivative(belief, height_of).transpose();
      expected.segment<2>(B::kGround + 1) +=
          robot.endcap_radius * slope / std::sqrt(1 + slope.squaredNorm());
      const Foot<double> foot(belief, ground, endcap, robot.endcap_radius, robot.rod_length);
      const Packet<double> any = ground.across_y;
      CHECK((dense(foot.rows(any, any), 3) - expected).norm() < kTolerance);
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
    CHECK(std::abs(height(belief, endcap, robot)) < 1e-12);
  }
}

TEST_CASE("feet: across y along the ground is a unit vector across the normal") {
  const Prism<double> robot;
  Samples samples(2);
  const Ground<double> ground(samples.belief(robot));
  const V3 along = vector(ground.across_y);
  CHECK(along.norm() == doctest::Approx(1));
  CHECK(std::abs(along.dot(vector(ground.normal))) < 1e-15);
}
