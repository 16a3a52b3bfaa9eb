// Feet as measurements: slip and height, and their rows against finite differences.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>

#include "tensegrity/tight/feet.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::hat;
using tensegrity::Packet;
using tensegrity::Prism;
using tensegrity::VectorLanes;
using tensegrity::tight::Feet;
using tensegrity::tight::Foot;
using tensegrity::tight::FootRows;
using tensegrity::tight::Ground;
using M3 = tensegrity::Matrix3<double>;

constexpr int kSeeds = 20;
constexpr double kTolerance = 20 * kDerivativeError;  // norms of vectors of some twenty entries

FootRows<double> rows_of(const Feet<double>& feet, const V3& first, const V3& second, int foot) {
  std::array<FootRows<double>, Feet<double>::kMost> rows;
  feet.rows(VectorLanes<double>::all(first), VectorLanes<double>::all(second), rows.data());
  return rows[std::size_t(foot)];
}

// The four rows, by both of their products.
MatrixXd dense(const FootRows<double>& rows) {
  MatrixXd h(4, B::Dim);
  const B::Covariance unit = B::Covariance::Identity();
  for (int i = 0; i < B::Dim; i += 4) {
    Packet<double> columns[4];
    rows.times(&unit(0, i), columns, B::Dim);
    for (int c = 0; c < 4; ++c) {
      for (int k = 0; k < 4; ++k) h(k, i + c) = columns[c].at(k);
    }
  }
  tensegrity::Matrix<double, B::Dim, 4> cross;
  rows.cross(unit, cross.data());
  CHECK((h.transpose() - cross).norm() < 1e-14);
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

// All endcaps, three at a time. Calls ask(endcap, spin, feet, lane), spins of rods as they are
// given.
template <typename Ask>
void for_each_foot(const B& belief, const Prism<double>& robot, const std::array<double, 6>& spins,
                   const Ask& ask) {
  const Ground<double> ground(belief);
  const auto foot = [&](int i) { return Foot<double>{i, 1, spins[std::size_t(i)]}; };
  for (const std::array<int, 3>& three : {std::array{0, 3, 5}, std::array{4, 1, 2}}) {
    const std::array<Foot<double>, 3> on_ground{{foot(three[0]), foot(three[1]), foot(three[2])}};
    const Feet<double> feet(belief, ground, on_ground.data(), 3, robot.endcap_radius,
                            robot.rod_length);
    for (int k = 0; k < 3; ++k) ask(three[std::size_t(k)], on_ground[std::size_t(k)].spin, feet, k);
  }
}
std::array<double, 6> all_spins(double spin) { return {spin, spin, spin, spin, spin, spin}; }

double height(const B& belief, int endcap, const Prism<double>& robot) {
  const Ground<double> ground(belief);
  const Foot<double> foot{endcap, 1};
  return Feet<double>(belief, ground, &foot, 1, robot.endcap_radius, robot.rod_length)
      .height()
      .at(0);
}

}  // namespace

TEST_CASE("feet: the slip is that of the touching point of a rolling sphere") {
  const Prism<double> robot;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Samples samples(seed);
    const B belief = samples.belief(robot);
    const V3 n = belief.ground_normal();
    for (const double spin : {kUnmeasured, 0.0, 1.7}) {
      for_each_foot(belief, robot, all_spins(spin),
                    [&](int endcap, double, const Feet<double>& feet, int lane) {
                      const V3 expected = touching_velocity(belief, endcap, robot, n, spin);
                      CHECK((vector(feet.slip(), lane) - expected).norm() < 1e-12);
                    });
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
    std::array<double, 6> spins;
    for (double& spin : spins) spin = samples.uniform(0, 1) < 0.5 ? kUnmeasured : samples.normal();
    // Along anything, not only along the ground.
    const V3 first = samples.vector(1), second = samples.vector(1);
    for_each_foot(
        belief, robot, spins, [&](int endcap, double spin, const Feet<double>& feet, int lane) {
          const MatrixXd numeric = derivative(belief, [&](const B& b) {
            return VectorXd(touching_velocity(b, endcap, robot, n, spin));
          });

          V3 omega = base_rate;
          MatrixXd left_out = MatrixXd::Zero(3, B::Dim);
          if (endcap >= 2) {
            const int even = endcap / 2 * 2;
            const V3 span = belief.endcap(even) - belief.endcap(even + 1);
            const V3 u = span.normalized();
            const V3 turn = (belief.endcap_velocity(even) - belief.endcap_velocity(even + 1)) /
                            robot.rod_length;
            const bool measured = !std::isnan(spin);
            const double about_itself = measured ? spin : u.dot(base_rate);
            omega = u.cross(turn) + u * about_itself;
            M3 by_direction = -r * (hat(n) * hat(turn) - about_itself * hat(n));
            if (!measured) by_direction -= r * u.cross(n) * base_rate.transpose();
            const M3 across = (M3::Identity() - u * u.transpose()) / span.norm();
            left_out.middleCols<3>(B::endcap_index(even)) = by_direction * across;
            left_out.middleCols<3>(B::endcap_index(even + 1)) = -by_direction * across;
          }
          left_out.middleCols<3>(B::kRotation) =
              -hat(vector(feet.slip(), lane)) - r * hat(omega) * hat(n);

          const MatrixXd rows = dense(rows_of(feet, first, second, lane));
          const MatrixXd kept = numeric - left_out;
          CHECK((rows.row(0) - first.transpose() * kept).norm() < kTolerance);
          CHECK((rows.row(1) - second.transpose() * kept).norm() < kTolerance);
          CHECK((rows.row(2) - n.transpose() * kept).norm() < kTolerance);
        });
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
    const V3 any = samples.vector(1);
    for_each_foot(
        belief, robot, all_spins(kUnmeasured),
        [&](int endcap, double, const Feet<double>& feet, int lane) {
          const auto height_of = [&](const B& b) {
            return VectorXd(VectorXd::Constant(1, height(b, endcap, robot)));
          };
          MatrixXd expected = derivative(belief, height_of);
          expected.block<1, 2>(0, B::kGround + 1) +=
              robot.endcap_radius * slope.transpose() / std::sqrt(1 + slope.squaredNorm());
          CHECK((dense(rows_of(feet, any, any, lane)).row(3) - expected).norm() < kTolerance);
        });
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
  CHECK(ground.across_y.norm() == doctest::Approx(1));
  CHECK(std::abs(ground.across_y.dot(ground.normal)) < 1e-15);
}
