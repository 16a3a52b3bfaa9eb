// Cables, rods and the fold as measurements: against joint updates with rows found by differences.
#include <doctest/doctest.h>

#include <limits>
#include <vector>

#include "tensegrity/tight/members.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::Cable;
using tensegrity::CableLengths;
using tensegrity::kPrismCables;
using tensegrity::Prism;
using tensegrity::tight::SequentialUpdate;

constexpr int kSeeds = 20;

// Rows and updates that were found by differences, relative to values of order one.
constexpr double kTolerance = 20 * kDerivativeError;

void check_same(const B& belief, const B& expected) {
  CHECK(difference(belief, expected).norm() < kTolerance);
  CHECK(distance(belief.complete_covariance(), expected.complete_covariance()) < kTolerance);
}

CableLengths<double> lengths_of(const B& belief) {
  CableLengths<double> lengths;
  for (int k = 0; k < 9; ++k) {
    const Cable cable = kPrismCables[std::size_t(k)];
    lengths[k] = (belief.endcap(cable.from) - belief.endcap(cable.to)).norm() + belief.offsets[k];
  }
  return lengths;
}

auto cables(B& belief, const CableLengths<double>& measured, double std, double gate) {
  SequentialUpdate<double> update(belief);
  return tensegrity::tight::correct_cables(update, belief, measured, std, gate);
}

}  // namespace

TEST_CASE("cable lengths: any subset corrects like a joint update with differenced rows") {
  const Prism<double> robot;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Samples samples(seed);
    const B prior = samples.belief(robot);
    CableLengths<double> measured = lengths_of(prior) + samples.normal(9, 0.02);
    const MatrixXd all = derivative(prior, [](const B& b) { return lengths_of(b); });
    // No rotation changes a distance.
    CHECK(all.middleCols<3>(B::kRotation).norm() < kDerivativeError);

    std::vector<int> kept;
    for (int k = 0; k < 9; ++k) {
      if (samples.uniform(0, 1) < 0.3) {
        measured[k] = std::numeric_limits<double>::quiet_NaN();
      } else {
        kept.push_back(k);
      }
    }
    const double std = 0.03;
    const int rows = int(kept.size());
    MatrixXd h(rows, B::Dim);
    VectorXd z(rows);
    for (int k = 0; k < rows; ++k) {
      h.row(k) = all.row(kept[std::size_t(k)]);
      z[k] = (lengths_of(prior) - measured)[kept[std::size_t(k)]];
    }
    const B expected = dense_update(prior, h, z, VectorXd::Constant(rows, std * std));
    B belief = prior;
    const auto result = cables(belief, measured, std, 0.0);
    CHECK(result.accepted == rows);
    CHECK(result.rejected == 0);
    check_same(belief, expected);
  }
}

TEST_CASE("a cable beyond the gate is left out, the others are not") {
  const Prism<double> robot;
  Samples samples(3);
  const B prior = samples.belief(robot);
  CableLengths<double> measured = lengths_of(prior);
  measured[4] += 1;  // against a predicted 0.1 m
  CableLengths<double> without = measured;
  without[4] = std::numeric_limits<double>::quiet_NaN();
  B gated = prior, reference = prior;
  const auto result = cables(gated, measured, 0.002, 25.0);
  CHECK(result.rejected == 1);
  CHECK(result.accepted == 8);
  cables(reference, without, 0.002, 0.0);
  CHECK(gated.columns == reference.columns);
  CHECK(gated.complete_covariance() == reference.complete_covariance());
}

TEST_CASE("rods: length and stretch correct like a joint update with differenced rows") {
  const Prism<double> robot;
  const auto rods = [&](const B& b) {
    VectorXd z(4);
    for (int k = 0; k < 2; ++k) {
      const V3 span = b.endcap(2 * k + 2) - b.endcap(2 * k + 3);
      const V3 rate = b.endcap_velocity(2 * k + 2) - b.endcap_velocity(2 * k + 3);
      z.segment<2>(2 * k) << span.norm() - robot.rod_length, rate.dot(span.normalized());
    }
    return z;
  };
  const double length_std = 0.02, stretch_std = 0.05;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Samples samples(seed);
    B prior = samples.belief(robot);
    for (int i = 2; i < 6; ++i) prior.columns.col(i) += samples.vector(0.01);  // bent out
    const Eigen::Vector4d stds(length_std, stretch_std, length_std, stretch_std);
    const B expected = dense_update(prior, derivative(prior, rods), rods(prior), stds.cwiseAbs2());
    B belief = prior;
    {
      SequentialUpdate<double> update(belief);
      tensegrity::tight::hold_rods(update, belief, robot.rod_length, length_std, stretch_std);
    }
    check_same(belief, expected);
  }
}

TEST_CASE("fold: corrects like an update with a differenced row, and only below its threshold") {
  for (const auto chirality :
       {tensegrity::Chirality::kCounterClockwise, tensegrity::Chirality::kClockwise}) {
    Prism<double> robot;
    robot.chirality = chirality;
    const auto fold = [&](const B& b) {
      const tensegrity::shape::Rods<double> rods(robot, b.endcaps_body());
      return VectorXd::Constant(1, tensegrity::shape::fold(rods, robot.moment_sign()));
    };
    for (unsigned seed = 0; seed < kSeeds; ++seed) {
      Samples samples(seed);
      const B prior = samples.belief(robot);
      const double value = fold(prior)[0], threshold = value + 0.1, std = 0.2;
      const MatrixXd h = derivative(prior, fold);
      CHECK(h.middleCols<3>(B::kRotation).norm() < kDerivativeError);  // a shape has no heading
      const B expected = dense_update(prior, h, VectorXd::Constant(1, value - threshold),
                                      VectorXd::Constant(1, std * std));
      B below = prior;
      tensegrity::tight::hold_fold(below, robot, threshold, std);
      check_same(below, expected);

      B above = prior;
      tensegrity::tight::hold_fold(above, robot, value - 1e-9, std);
      CHECK(above.columns == prior.columns);
      CHECK(above.covariance == prior.covariance);
    }
  }
}
