// Corrections one row at a time: the result is that of the joint update.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tensegrity/tight/sequential_update.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::Prism;
using tensegrity::tight::Row;
using tensegrity::tight::SequentialUpdate;

struct Measurement {
  Row<double> row;
  VectorXd dense;
  double residual, variance;
};

Measurement any_measurement(Samples& samples) {
  Measurement m{{}, VectorXd::Zero(B::Dim), 0.1 * samples.normal(), samples.uniform(1e-4, 1e-2)};
  // Blocks at any place; equal and overlapping ones add up.
  const int blocks = int(samples.uniform(1, Row<double>::kMaxBlocks + 1));
  for (int k = 0; k < blocks; ++k) {
    const int at = 3 * int(samples.uniform(0, kStates / 3));
    const V3 h = samples.vector(1);
    m.row.add(at, h);
    m.dense.segment<3>(at) += h;
  }
  if (samples.uniform(0, 1) < 0.5) {
    const int at = int(samples.uniform(0, kStates));
    const double h = samples.normal();
    m.row.add_single(at, h);
    m.dense[at] += h;
  }
  return m;
}

void check_unchanged(const B& belief, const B& before) {
  CHECK((belief.rotation - before.rotation).norm() < 1e-15);  // made orthonormal once more
  CHECK(belief.columns == before.columns);
  CHECK(belief.offsets == before.offsets);
  CHECK(belief.covariance == before.covariance);
}

}  // namespace

TEST_CASE("rows one by one are the joint update, in any order and number") {
  const Prism<double> robot;
  for (const int rows : {1, 2, 5, 12, 13, 30}) {
    Samples samples{unsigned(rows)};
    const B prior = samples.belief(robot);
    std::vector<Measurement> all;
    MatrixXd h(rows, B::Dim);
    VectorXd z(rows), variances(rows);
    for (int k = 0; k < rows; ++k) {
      all.push_back(any_measurement(samples));
      h.row(k) = all.back().dense;
      z[k] = all.back().residual;
      variances[k] = all.back().variance;
    }
    const B expected = dense_update(prior, h, z, variances);
    for (int order = 0; order < 2; ++order) {
      B belief = prior;
      {
        SequentialUpdate<double> update(belief);
        for (const Measurement& m : all) update.correct(m.row, m.residual, m.variance);
        CHECK(belief.columns == prior.columns);  // the mean moves once, at the end
      }
      CHECK(difference(belief, expected).norm() < 1e-10);
      CHECK(distance(belief.covariance, expected.covariance) < 1e-12);
      CHECK((belief.covariance - belief.covariance.transpose()).norm() == 0);
      std::reverse(all.begin(), all.end());
    }
  }
}

TEST_CASE("the chi-squares of the rows add up to that of the joint innovation") {
  const Prism<double> robot;
  Samples samples(4);
  B belief = samples.belief(robot);
  const MatrixXd p = belief.covariance;
  const Measurement a = any_measurement(samples), b = any_measurement(samples);
  Eigen::Matrix2d s;
  s << a.dense.dot(p * a.dense) + a.variance, a.dense.dot(p * b.dense), b.dense.dot(p * a.dense),
      b.dense.dot(p * b.dense) + b.variance;
  const Eigen::Vector2d z(a.residual, b.residual);
  SequentialUpdate<double> update(belief);
  const double sum =
      update.correct(a.row, a.residual, a.variance) + update.correct(b.row, b.residual, b.variance);
  CHECK(sum == doctest::Approx(z.dot(s.inverse() * z)).epsilon(1e-10));
}

TEST_CASE("a row beyond its gate, or not finite, changes nothing") {
  const Prism<double> robot;
  Samples samples(5);
  const B prior = samples.belief(robot);
  const Measurement m = any_measurement(samples);
  B belief = prior;
  double chi_square;
  {
    SequentialUpdate<double> update(belief);
    chi_square = update.correct(m.row, 10, m.variance, 9.0);
    CHECK(chi_square > 9);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(std::isfinite(update.correct(m.row, nan, m.variance)));
    CHECK_FALSE(
        std::isfinite(update.correct(m.row, std::numeric_limits<double>::infinity(), m.variance)));
    Row<double> bad;
    bad.add(0, V3(0, nan, 0));
    CHECK_FALSE(std::isfinite(update.correct(bad, 0.1, m.variance)));
  }
  check_unchanged(belief, prior);
  {
    SequentialUpdate<double> update(belief);
    CHECK(update.correct(m.row, 10, m.variance, 1.001 * chi_square) == chi_square);
  }
  CHECK((belief.covariance - prior.covariance).norm() > 0);
}

TEST_CASE("information scales the downdate of P, and leaves the mean's step whole") {
  const Prism<double> robot;
  Samples samples(6);
  const B prior = samples.belief(robot);
  const Measurement m = any_measurement(samples);
  const auto corrected = [&](double information) {
    B belief = prior;
    SequentialUpdate<double>(belief).correct(m.row, m.residual, m.variance, 0.0, information);
    return belief;
  };
  const B whole = corrected(1), none = corrected(0), part = corrected(0.3);
  CHECK(difference(whole, prior).norm() > 0);
  CHECK(none.columns == whole.columns);
  CHECK(part.columns == whole.columns);
  CHECK(none.covariance == prior.covariance);
  const MatrixXd expected = prior.covariance + 0.3 * (whole.covariance - prior.covariance);
  CHECK(distance(part.covariance, expected) < 1e-14);
}
