// Propagation of the tightly coupled filter: transition against finite differences of the mean,
// noise against many noisy runs, the base rod against the loosely coupled filter.
#include <doctest/doctest.h>

#include <cmath>

#include "tensegrity/inekf/propagate.hpp"
#include "tensegrity/tight/propagate.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::Prism;
using tensegrity::inekf::ImuSample;
using tensegrity::tight::ProcessNoise;
using tensegrity::tight::propagate;

constexpr double kGravity = 9.81;
constexpr ProcessNoise<double> kNoNoise{0, 0, 0, 0, 0, 0, 0};

ImuSample<double> any_motion(Samples& samples) {
  return {samples.vector(3), samples.vector(8) + V3(0, 0, kGravity)};
}

// States that propagation moves: neither cable offsets nor what P has beyond the states.
VectorXd moving(const VectorXd& e) { return e.head<B::kOffsets>(); }

}  // namespace

TEST_CASE("transition: P becomes F P F', F by finite differences of the mean") {
  const Prism<double> robot;
  for (unsigned seed = 0; seed < 20; ++seed) {
    Samples samples(seed);
    const B start = samples.belief(robot);
    const ImuSample<double> imu = any_motion(samples);
    const double dt = samples.uniform(0.001, 0.1);
    const auto step = [&](B belief, const ProcessNoise<double>& noise) {
      propagate(belief, imu, dt, kGravity, noise);
      return belief;
    };
    const B end = step(start, kNoNoise);
    const MatrixXd f =
        derivative(start, [&](const B& b) { return difference(step(b, kNoNoise), end); });
    const MatrixXd expected = sandwich(f, start.covariance, MatrixXd::Zero(B::Dim, B::Dim));
    CHECK(distance(end.complete_covariance(), expected) < 100 * kDerivativeError);
    CHECK(symmetric(end));
    CHECK((end.rate - (imu.gyro - start.gyro_bias)).norm() == 0);

    const B noisy = step(start, {0.3, 2, 0.1, 0.1, 3, 0.1, 0.1});
    CHECK(symmetric(noisy));
    CHECK(noisy.columns == end.columns);  // noise moves no mean
  }
}

TEST_CASE("noise: P is the covariance of many noisy runs") {
  // Each noise alone would explain only some states; together P has full rank. White noise comes
  // once per sample, walks and the endcaps' white acceleration are integrated over it exactly.
  const Prism<double> robot;
  const ProcessNoise<double> noise{0.05, 0.6, 0.02, 0.1, 0.5, 0.02, 0.03};
  const double dt = 0.005;
  constexpr int kSteps = 40, kRuns = 3000;
  Samples samples(1);
  B start = samples.belief(robot);
  start.covariance.setZero();
  const ImuSample<double> imu{V3(1.5, -1, 0.5) + start.gyro_bias, V3(2, -3, 9) + start.accel_bias};

  B reference = start;
  for (int k = 0; k < kSteps; ++k) propagate(reference, imu, dt, kGravity, noise);

  MatrixXd sum = MatrixXd::Zero(B::kOffsets, B::kOffsets);
  for (int run = 0; run < kRuns; ++run) {
    B belief = start;
    for (int k = 0; k < kSteps; ++k) {
      const ImuSample<double> measured{imu.gyro + samples.vector(noise.gyro),
                                       imu.accel + samples.vector(noise.accel)};
      propagate(belief, measured, dt, kGravity, kNoNoise);
      for (int i = 2; i < 6; ++i) {
        // Integrals of white noise w and of (dt - t) w over the step: variances dt and dt^3 / 3,
        // correlation sqrt(3) / 2.
        const V3 once = samples.vector(1), rest = samples.vector(1);
        const double scale = noise.endcap_acceleration * std::sqrt(dt);
        belief.columns.col(i + 4) += scale * once;
        belief.columns.col(i) += scale * dt * (once / 2 + rest / std::sqrt(12.0));
      }
      belief.gyro_bias += samples.vector(noise.gyro_bias * std::sqrt(dt));
      belief.accel_bias += samples.vector(noise.accel_bias * std::sqrt(dt));
      belief.ground[0] += noise.ground_height * std::sqrt(dt) * samples.normal();
      // The slope turns about the point below the robot.
      const Eigen::Vector2d turned = samples.normal(2, noise.ground_slope * std::sqrt(dt));
      belief.ground.tail<2>() += turned;
      belief.ground[0] -= turned.dot(belief.position().head<2>());
    }
    const VectorXd e = moving(difference(belief, reference));
    sum += e.lazyProduct(e.transpose());
  }
  const MatrixXd sampled = sum / kRuns;
  // A covariance of n samples scatters by sqrt((p_ij^2 + p_ii p_jj) / n).
  double worst = 0;
  for (int i = 0; i < sampled.rows(); ++i) {
    for (int j = 0; j <= i; ++j) {
      const double p = reference.covariance(i, j);
      const double scatter =
          std::sqrt((p * p + reference.covariance(i, i) * reference.covariance(j, j)) / kRuns);
      worst = std::max(worst, std::abs(sampled(i, j) - p) / scatter);
    }
  }
  CHECK(worst < 5);  // the largest of 900 normal numbers is beyond 5 once in 2000 seeds
}

TEST_CASE("base rod: the same as in the loosely coupled filter") {
  using Loose = tensegrity::inekf::Belief<double, 1, 1>;
  const Prism<double> robot;
  Samples samples(2);
  const B start = samples.belief(robot);
  const ImuSample<double> imu = any_motion(samples);
  const ProcessNoise<double> noise{0.02, 0.1, 0.03, 0.1, 0, 0, 0};
  const double dt = 0.005;

  B tight = start;
  Loose loose;
  loose.rotation = start.rotation;
  loose.velocity = start.velocity();
  loose.position = start.position();
  loose.gyro_bias = start.gyro_bias;
  loose.accel_bias = start.accel_bias;
  loose.covariance.topLeftCorner<B::kBodyEnd, B::kBodyEnd>() =
      start.covariance.topLeftCorner<B::kBodyEnd, B::kBodyEnd>();
  for (int k = 0; k < 20; ++k) {
    propagate(tight, imu, dt, kGravity, noise);
    tensegrity::inekf::propagate(loose, imu, dt, kGravity,
                                 {noise.gyro, noise.accel, noise.gyro_bias, noise.accel_bias, 0.0},
                                 {}, tensegrity::Vector<double, 1>(0));
  }
  CHECK((tight.rotation - loose.rotation).norm() < 1e-12);
  CHECK((tight.velocity() - loose.velocity).norm() < 1e-12);
  CHECK((tight.position() - loose.position).norm() < 1e-12);
  const MatrixXd p = loose.complete_covariance().topLeftCorner<B::kBodyEnd, B::kBodyEnd>();
  CHECK((tight.covariance.topLeftCorner<B::kBodyEnd, B::kBodyEnd>() - p).norm() < 1e-12 * p.norm());
}
