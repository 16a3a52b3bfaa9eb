// IMUs on the other rods as measurements: against joint updates with rows found by differences.
#include <doctest/doctest.h>

#include <cmath>

#include "tensegrity/tight/rod_imu.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::Prism;
using tensegrity::tight::SequentialUpdate;

constexpr double kGravity = 9.81, kLeastTurn = 0.2;
constexpr tensegrity::tight::RodImuNoise<double> kNoise{0.2, 0.05};

B corrected(const B& belief, int rod, const V3& gyro, const V3& accel, double rod_length) {
  B out = belief;
  SequentialUpdate<double> update(out);
  correct_rod(update, out, rod, gyro, accel, rod_length, kGravity, kLeastTurn, kNoise);
  return out;
}

}  // namespace

TEST_CASE("rod IMUs: turn and inclination correct like an update with differenced rows") {
  const Prism<double> robot;
  const double length = robot.rod_length;
  for (unsigned seed = 0; seed < 20; ++seed) {
    Samples samples(seed);
    const B prior = samples.belief(robot);
    for (const int rod : {1, 2}) {
      const V3 gyro = V3(1, 0, 0) + samples.vector(0.2), accel = samples.vector(5);
      const auto z = [&](const B& b) {
        VectorXd out(2);
        out << (b.endcap_velocity(2 * rod) - b.endcap_velocity(2 * rod + 1)).norm() -
                   length * gyro.head<2>().norm(),
            (b.endcap(2 * rod) - b.endcap(2 * rod + 1)).z() - length * accel.z() / kGravity;
        return out;
      };
      const Eigen::Vector2d stds(length * kNoise.rate, length * kNoise.inclination);
      const B expected = dense_update(prior, derivative(prior, z), z(prior), stds.cwiseAbs2());
      const B belief = corrected(prior, rod, gyro, accel, length);
      CHECK(difference(belief, expected).norm() < 20 * kDerivativeError);
      CHECK(distance(belief.complete_covariance(), expected.complete_covariance()) <
            20 * kDerivativeError);

      // Any mounting about the rod says the same.
      const double angle = samples.uniform(-3, 3), c = std::cos(angle), s = std::sin(angle);
      const auto turned = [&](const V3& v) {
        return V3(c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z());
      };
      const B other = corrected(prior, rod, turned(gyro), turned(accel), length);
      CHECK(difference(other, belief).norm() < 1e-12);
    }
  }
}

TEST_CASE("rod IMUs: a slow turn has no direction, and is not used") {
  const Prism<double> robot;
  Samples samples(3);
  B prior = samples.belief(robot);
  prior.covariance = B::Covariance::Identity();  // nothing is known of rates through directions
  const B belief = corrected(prior, 1, V3(0.1, 0.1, 5), V3(0, 0, 3), robot.rod_length);
  const auto rates = [](const B& b) { return b.covariance.block<12, 12>(B::kRates, B::kRates); };
  CHECK(rates(belief) == rates(prior));
  CHECK(belief.covariance.trace() < prior.covariance.trace());
}
