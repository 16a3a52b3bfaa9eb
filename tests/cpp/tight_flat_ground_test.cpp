// Ground that is declared flat: nothing is believed before the slope is known, a level plane is
// measured to be level then, a sloping one is left alone.
#include <doctest/doctest.h>

#include <cmath>

#include "tensegrity/tight/flat_ground.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::Prism;
using tensegrity::tight::Flatness;
using tensegrity::tight::judge_flatness;
using tensegrity::tight::kFlatSlopeStd;

// The correlations of `samples.belief`, with the standard deviations `major` and `minor` of the
// slope along and across the direction `angle` [rad], in which the ground slopes by `slope`.
B sloping(unsigned seed, double angle, double slope, double major, double minor) {
  Samples samples(seed);
  B belief = samples.belief(Prism<double>());
  const Eigen::Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
  belief.ground.tail<2>() = slope * along;
  const Eigen::Matrix2d wanted =
      major * major * along * along.transpose() + minor * minor * across * across.transpose();
  const Eigen::Matrix2d root = wanted.llt().matrixL();
  const Eigen::Matrix2d before =
      belief.covariance.block<2, 2>(B::kGround + 1, B::kGround + 1).llt().matrixL();
  MatrixXd scale = MatrixXd::Identity(B::Dim, B::Dim);
  scale.block<2, 2>(B::kGround + 1, B::kGround + 1) = root * before.inverse();
  belief.covariance = scale * belief.covariance.eval() * scale.transpose();
  return belief;
}

void check_unchanged(const B& belief, const B& before) {
  CHECK(belief.rotation == before.rotation);
  CHECK(belief.columns == before.columns);
  CHECK(belief.ground == before.ground);
  CHECK(belief.covariance == before.covariance);
}

constexpr double kKnown = 3 * kFlatSlopeStd;

}  // namespace

TEST_CASE("a slope that is known in one direction only says nothing of flatness") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    const double angle = 0.7 * seed;
    const B before = sloping(seed, angle, 0.1, 1.01 * kKnown, 0.1 * kKnown);
    B after = before;
    CHECK(judge_flatness(after) == Flatness::kUndecided);
    check_unchanged(after, before);
  }
}

TEST_CASE("flatness that fits is a measurement of both slopes") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    const double major = 0.99 * kKnown;
    const double slope = 3.6 * std::hypot(major, kFlatSlopeStd);
    const B before = sloping(seed, 0.7 * seed, slope, major, 0.5 * major);
    B after = before;
    CHECK(judge_flatness(after) == Flatness::kBelieved);
    MatrixXd h = MatrixXd::Zero(2, B::Dim);
    h(0, B::kGround + 1) = h(1, B::kGround + 2) = 1;
    const B joint = dense_update(before, h, before.ground.tail<2>(),
                                 Eigen::Vector2d::Constant(kFlatSlopeStd * kFlatSlopeStd));
    CHECK(difference(after, joint).norm() < 1e-10);
    CHECK(distance(after.complete_covariance(), joint.complete_covariance()) < 1e-12);
  }
}

TEST_CASE("a slope that does not fit is refuted, in any direction, and nothing changes") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    const double minor = 0.4 * kKnown;
    // Less than what the test above accepts, but where the slope is known better.
    const double slope = 3.8 * std::hypot(minor, kFlatSlopeStd);
    const B before = sloping(seed, 0.7 * seed, slope, minor, 0.99 * kKnown);
    B after = before;
    CHECK(judge_flatness(after) == Flatness::kRefuted);
    check_unchanged(after, before);
  }
}
