// What the world's frame may not change, and what no measurement may learn: heading and place.
#include <doctest/doctest.h>

#include "tensegrity/tight/friction.hpp"
#include "tensegrity/tight/members.hpp"
#include "tensegrity/tight/propagate.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::Cable;
using tensegrity::CableLengths;
using tensegrity::hat;
using tensegrity::kPrismCables;
using tensegrity::Prism;
using tensegrity::SO3;
using tensegrity::tight::FootNoise;
using tensegrity::tight::SequentialUpdate;

constexpr FootNoise<double> kFeet{0.01, 0.005, 0.02, 0.02, 0.001, 0.7};
const Prism<double> kRobot;

CableLengths<double> lengths_of(const B& belief) {
  CableLengths<double> lengths;
  for (int k = 0; k < 9; ++k) {
    const Cable cable = kPrismCables[std::size_t(k)];
    lengths[k] = (belief.endcap(cable.from) - belief.endcap(cable.to)).norm();
  }
  return lengths;
}

void correct_by_shape(B& belief, const CableLengths<double>& lengths) {
  SequentialUpdate<double> update(belief);
  tensegrity::tight::correct_cables(update, belief, lengths, 0.002, 36.0);
  tensegrity::tight::hold_rods(update, belief, kRobot.rod_length, 0.0005, 0.002);
}

void correct_by_ground(B& belief) {
  const std::array<tensegrity::tight::Foot<double>, 3> feet{
      {{0, 1.0 / 3}, {3, 1.0 / 3}, {5, 1.0 / 3}}};
  tensegrity::tight::correct_feet(belief, feet.data(), 3, kRobot, kFeet, 0.005);
}

// A world whose frame is turned about the vertical and moved.
struct Frame {
  Eigen::Matrix3d turn;
  V3 shift;

  // The plane z = m0 + m . (x, y) keeps its place in space.
  V3 ground(const V3& m) const {
    const V3 slope = turn * V3(m[1], m[2], 0);
    return {m[0] + shift.z() - slope.dot(shift), slope.x(), slope.y()};
  }
  B operator()(const B& belief) const {
    B out = belief;
    out.rotation = turn * belief.rotation;
    out.columns = turn * belief.columns;
    for (int c = 1; c < 6; ++c) out.columns.col(c) += shift;  // positions
    out.ground = ground(belief.ground);
    const MatrixXd a = errors();
    out.covariance = sandwich(a, belief.complete_covariance(), MatrixXd::Zero(B::Dim, B::Dim));
    return out;
  }
  // The adjoint: errors of the one world in the frame of the other.
  MatrixXd errors() const {
    MatrixXd a = MatrixXd::Identity(B::Dim, B::Dim);
    a.block<3, 3>(B::kRotation, B::kRotation) = turn;
    for (int c = 0; c < B::kColumns; ++c) {
      const int at = B::column_index(c);
      a.block<3, 3>(at, at) = turn;
      if (c >= 1 && c < 6) a.block<3, 3>(at, B::kRotation) = hat(shift) * turn;
    }
    for (int k = 0; k < 3; ++k) {
      a.block<3, 1>(B::kGround, B::kGround + k) = ground(V3::Unit(k)) - ground(V3::Zero());
    }
    return a;
  }
};

}  // namespace

TEST_CASE("a world turned about the vertical and moved gives the same estimate in its frame") {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Samples samples(seed);
    const Frame frame{SO3<double>::Exp(V3(0, 0, samples.uniform(-3, 3))).matrix(),
                      V3(4, -7, 0.5).cwiseProduct(samples.vector(1))};
    B here = samples.belief(kRobot);
    const tensegrity::tight::ProcessNoise<double> noise{0.02, 0.4, 0.001, 0.01, 2, 0.005, 0.02};
    // Step by step from the same belief: 50 violent steps in a row amplify rounding a millionfold.
    double worst_state = 0, worst_covariance = 0;
    for (int k = 0; k < 50; ++k) {
      B there = frame(here);
      const tensegrity::inekf::ImuSample<double> imu{samples.vector(0.5), samples.vector(9)};
      const CableLengths<double> lengths = lengths_of(here) + samples.normal(9, 0.002);
      for (B* belief : {&here, &there}) {
        propagate(*belief, imu, 0.005, 9.81, noise);
        correct_by_shape(*belief, lengths);
        correct_by_ground(*belief);
      }
      const B expected = frame(here);
      worst_state = std::max(worst_state, difference(there, expected).norm());
      worst_covariance = std::max(
          worst_covariance, distance(there.complete_covariance(), expected.complete_covariance()));
    }
    CHECK(worst_state < 1e-7);
    CHECK(worst_covariance < 1e-7);
  }
}

TEST_CASE("cables and rods learn nothing of place and orientation") {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Samples samples(seed);
    B belief = samples.belief(kRobot);
    // Turning the world about its origin, and moving it.
    MatrixXd gauge = MatrixXd::Zero(kStates, 6);
    gauge.block<3, 3>(B::kRotation, 0).setIdentity();
    for (const int i : {0, 2, 3, 4, 5}) gauge.block<3, 3>(B::endcap_index(i), 3).setIdentity();
    const MatrixXd before = information(belief) * gauge;
    const MatrixXd prior = belief.covariance;
    // Noise moves the mean, and with it every linearisation.
    for (int k = 0; k < 10; ++k) {
      correct_by_shape(belief, lengths_of(belief) + samples.normal(9, 0.01));
    }
    const MatrixXd after = information(belief) * gauge;
    CHECK((after - before).norm() < 1e-6 * before.norm());
    CHECK(belief.covariance.trace() < 0.8 * prior.trace());  // but of the shape
  }
}

TEST_CASE("feet on the ground learn nothing of heading and horizontal place") {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Samples samples(seed);
    B belief = samples.belief(kRobot);
    const MatrixXd prior = belief.covariance;
    for (int k = 0; k < 5; ++k) {
      // The plane turns and moves with the world.
      const double m1 = belief.ground[1], m2 = belief.ground[2];
      MatrixXd gauge = MatrixXd::Zero(kStates, 3);
      gauge(B::kRotation + 2, 0) = 1;
      gauge.block<3, 1>(B::kGround, 0) = V3(0, -m2, m1);
      for (const int i : {0, 2, 3, 4, 5}) {
        gauge.block<2, 2>(B::endcap_index(i), 1).setIdentity();
      }
      gauge.block<1, 2>(B::kGround, 1) << -m1, -m2;
      const MatrixXd before = information(belief) * gauge;
      correct_by_ground(belief);
      const MatrixXd after = information(belief) * gauge;
      CHECK((after - before).norm() < 1e-6 * before.norm());
    }
    CHECK(belief.covariance.trace() < 0.9 * prior.trace());  // but of height and velocity
  }
}
