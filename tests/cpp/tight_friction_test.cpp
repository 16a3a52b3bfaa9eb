// Feet that are all pulled at once: friction decides which of them stand still.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tensegrity/tight/friction.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::Prism;
using tensegrity::tight::correct_feet;
using tensegrity::tight::Feet;
using tensegrity::tight::Foot;
using tensegrity::tight::FootNoise;
using tensegrity::tight::FootResult;
using tensegrity::tight::Ground;
using V2 = Eigen::Vector2d;

const Prism<double> kRobot;
constexpr double kDt = 0.005;
// Hardly any creep: friction alone.
constexpr FootNoise<double> kNoise{1e-4, 0.006, 0.03, 0.02, 0.001, 0.7};
constexpr std::array<int, 3> kFeet{0, 3, 5};

// A robot of known shape, known motion of its shape, on a known plane, that moves along the plane
// with any velocity: only that is unknown, with `std` [m/s].
class Sliding {
 public:
  Sliding(Samples& samples, double slope, double std) : belief(samples.belief(kRobot)) {
    belief.ground = V3(0.3, slope, 0);
    belief.columns.leftCols<1>() *= 0.2;
    belief.columns.rightCols<4>() *= 0.2;
    normal = belief.ground_normal();
    plane.col(0) = V3(normal.z(), 0, -normal.x());  // downhill if the slope is negative
    plane.col(1) = V3::UnitY();
    together.setZero(B::Dim, 2);
    for (const int i : {0, 2, 3, 4, 5}) {
      together.block<3, 2>(B::endcap_velocity_index(i), 0) = plane;
    }
    belief.covariance = std * std * together.lazyProduct(together.transpose());
  }

  V2 velocity() const { return plane.transpose() * belief.velocity(); }
  template <typename Ask>
  auto with_foot(int endcap, const Ask& ask) const {
    const Ground<double> ground(belief);
    const Foot<double> foot{endcap, 1};
    return ask(Feet<double>(belief, ground, &foot, 1, kRobot.endcap_radius, kRobot.rod_length));
  }
  V2 slip(int endcap) const {
    return with_foot(
        endcap, [&](const auto& foot) { return V2(plane.transpose() * vector(foot.slip(), 0)); });
  }
  double height(int endcap) const {
    return with_foot(endcap, [&](const auto& foot) { return foot.height().at(0); });
  }
  FootResult<double> correct(int endcap, double share) {
    const Foot<double> foot{endcap, share};
    return correct_feet(belief, &foot, 1, kRobot, kNoise, kDt)[0];
  }
  // Velocity at which a foot would stand.
  V2 standing(int endcap) const { return velocity() - slip(endcap); }
  // Variance along a direction of the plane.
  double variance(const V2& direction) const {
    const V3 d = plane * direction;
    return d.dot(belief.covariance.block<3, 3>(B::kVelocity, B::kVelocity) * d);
  }

  B belief;
  V3 normal;
  Eigen::Matrix<double, 3, 2> plane;  // orthonormal
  MatrixXd together;
};

struct Balance {
  V2 velocity;
  double margin;  // by how much the kind of the answer is decided, in shares of the load
};

// The velocity at which friction, of what share[i] of the load allows, and `downhill`, the weight
// along the plane over the greatest friction, are in balance. On one foot if the others cannot move
// it (Kuhn 1973), else by Weiszfeld's iteration.
Balance balance(const std::array<V2, 3>& standing, const std::array<double, 3>& share,
                const V2& downhill) {
  double margin = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    V2 pull = -downhill;
    for (std::size_t i = 0; i < 3; ++i) {
      if (i != k) pull += share[i] * (standing[k] - standing[i]).normalized();
    }
    const double spare = share[k] - pull.norm();
    if (spare >= 0) return {standing[k], spare};
    margin = std::min(margin, -spare);
  }
  V2 v = (standing[0] + standing[1] + standing[2]) / 3;
  for (int k = 0; k < 10000; ++k) {
    V2 sum = downhill;
    double weights = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double weight = share[i] / (v - standing[i]).norm();
      sum += weight * standing[i];
      weights += weight;
    }
    v = sum / weights;
  }
  return {v, margin};
}

void check_converges(double slope) {
  int on_a_foot = 0, between = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Samples samples(seed);
    Sliding robot(samples, slope, 1.0);
    std::array<double, 3> share;
    for (double& s : share) s = samples.uniform(0.2, 0.6);
    const double load = share[0] + share[1] + share[2];
    std::array<V2, 3> standing;
    for (std::size_t k = 0; k < 3; ++k) {
      share[k] /= load;
      standing[k] = robot.standing(kFeet[k]);
    }
    const V2 downhill(-slope / kNoise.friction, 0);  // tan over mu
    const Balance expected = balance(standing, share, downhill);
    if (expected.margin < 0.05) continue;  // near the border of both kinds it takes for ever
    bool stands = false;
    for (const V2& x : standing) stands = stands || x == expected.velocity;
    (stands ? on_a_foot : between) += 1;

    std::array<Foot<double>, 3> feet;
    for (std::size_t i = 0; i < 3; ++i) feet[i] = {kFeet[i], share[i]};
    // As an IMU would: without it P shrinks, and the mean stops on its way.
    const double unrest = 0.02;  // [m/s] per sample, 4 m/s^2
    for (int k = 0; k < 400; ++k) {
      robot.belief.covariance +=
          unrest * unrest * robot.together.lazyProduct(robot.together.transpose());
      correct_feet(robot.belief, feet.data(), 3, kRobot, kNoise, kDt);
    }
    const double std = std::sqrt(robot.variance(V2::UnitX()) + robot.variance(V2::UnitY()));
    CHECK((robot.velocity() - expected.velocity).norm() < 0.1 * std);
  }
  CHECK(on_a_foot >= 5);
  CHECK(between >= 5);
}

}  // namespace

TEST_CASE("level ground: the velocity becomes the load-weighted geometric median of the feet's") {
  check_converges(0);
}

TEST_CASE("slope: the velocity becomes that at which friction and weight balance") {
  check_converges(-0.1);
}

TEST_CASE("one foot on level ground pulls with its friction and informs across its slip") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    Samples samples(seed);
    const double prior = samples.uniform(0.01, 2);
    Sliding robot(samples, 0, prior);
    const V2 slip = robot.slip(3), start = robot.velocity();
    const double speed = slip.norm(), share = samples.uniform(0.2, 1);
    const V2 along = slip / speed, across(-along.y(), along.x());
    const double p = prior * prior;
    const double r = (kNoise.creep * kNoise.creep + kNoise.slip_length * speed / share) / kDt;
    CHECK(robot.correct(3, share).speed == doctest::Approx(speed));
    CHECK((robot.velocity() - (start - p / (p + r) * slip)).norm() < 1e-12);
    CHECK(robot.variance(across) == doctest::Approx(p * r / (p + r)));
    const double informed = kNoise.slip_speed / (kNoise.slip_speed + speed);
    CHECK(robot.variance(along) == doctest::Approx(p * (1 - informed * p / (p + r))));
    CHECK(robot.variance(along) > p * (1 - informed));
  }
}

TEST_CASE("a foot that stands still informs in every direction, as far as it creeps") {
  Samples samples(1);
  Sliding robot(samples, 0, 0.1);
  robot.belief.columns.rightCols<4>().setZero();
  robot.belief.columns.col(0).setZero();
  robot.belief.rate.setZero();
  robot.correct(5, 0.4);
  const double p = 0.01, r = kNoise.creep * kNoise.creep / kDt;
  for (const V2& direction : {V2(1, 0), V2(0, 1), V2(0.6, 0.8)}) {
    CHECK(robot.variance(direction) == doctest::Approx(p * r / (p + r)));
  }
  CHECK(robot.velocity().norm() < 1e-12);
}

TEST_CASE("height: a foot that carries a third or more is held on the plane, less by its share") {
  for (const double share : {1.0, 0.5, 1.0 / 3, 0.2, 0.05, 0.001}) {
    Samples samples(2);
    Sliding robot(samples, 0.2, 0);
    const double p = 4e-4;
    for (const int i : {0, 2, 3, 4, 5}) {  // the whole robot's height is unknown
      for (const int j : {0, 2, 3, 4, 5}) {
        robot.belief.covariance(B::endcap_index(i) + 2, B::endcap_index(j) + 2) = p;
      }
    }
    const double above = robot.height(5);
    const FootResult<double> result = robot.correct(5, share);
    CHECK(result.height == above);
    const double chi_square = result.height_chi_square;
    const double touching = std::min(std::max(3 * share, 0.005), 1.0);
    const double r = kNoise.height * kNoise.height / (kDt * touching * touching);
    CHECK(chi_square == doctest::Approx(above * above / (p + r)));
    CHECK(robot.height(5) == doctest::Approx(above * r / (p + r)));
  }
}

TEST_CASE("feet that are not finite are left out, and the others correct") {
  Samples samples(3);
  const B prior = samples.belief(kRobot);
  B alone = prior, with_bad = prior;
  const double infinity = std::numeric_limits<double>::infinity();
  const std::array<Foot<double>, 3> feet{{{0, 0.4}, {3, 0.3, infinity}, {5, 0.3}}};
  const std::array<Foot<double>, 2> good{{feet[0], feet[2]}};
  const auto expected = correct_feet(alone, good.data(), 2, kRobot, kNoise, kDt);
  const auto results = correct_feet(with_bad, feet.data(), 3, kRobot, kNoise, kDt);
  CHECK(with_bad.columns == alone.columns);
  CHECK(with_bad.complete_covariance() == alone.complete_covariance());
  CHECK(results[0].height_chi_square == expected[0].height_chi_square);
  CHECK(std::isnan(results[1].height_chi_square));
  CHECK(results[2].height_chi_square == expected[1].height_chi_square);

  const auto none = correct_feet(with_bad, &feet[1], 1, kRobot, kNoise, kDt);
  CHECK(with_bad.columns == alone.columns);
  CHECK(std::isnan(none[0].height_chi_square));
}
