// Corrections one row at a time, and by all feet at once: the result is that of the joint update.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "tensegrity/tight/feet_update.hpp"
#include "tensegrity/tight/sequential_update.hpp"
#include "tight_samples.hpp"

namespace {

using namespace tensegrity::tight::test;
using tensegrity::Packet;
using tensegrity::Prism;
using tensegrity::tight::FeetUpdate;
using tensegrity::tight::FootRows;
using tensegrity::tight::Row;
using tensegrity::tight::SequentialUpdate;
using M3 = tensegrity::Matrix3<double>;

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

// Four rows of each of `count` feet: dense, and as they are taken.
struct FeetMeasurement {
  int count;
  MatrixXd dense;
  VectorXd residual, variance, information;
  std::array<FootRows<double>, FeetUpdate<double>::kFeet> rows{};

  void fill(FeetUpdate<double>& update) const {
    std::copy(rows.begin(), rows.end(), update.rows());
    update.set_residuals(lanes(residual, 0), lanes(residual, 1), lanes(residual, 2),
                         lanes(residual, 3));
    update.set_variances(lanes(variance, 0), lanes(variance, 1), lanes(variance, 2),
                         lanes(variance, 3));
    update.set_information(lanes(information, 0), lanes(information, 1), lanes(information, 2),
                           lanes(information, 3));
  }
  // Row `k` of every foot.
  Packet<double> lanes(const VectorXd& x, int k) const {
    std::array<double, 4> out{};
    for (int f = 0; f < count; ++f) out[std::size_t(f)] = x[4 * f + k];
    return Packet<double>(out.data());
  }
};

FeetMeasurement any_feet(Samples& samples, int count) {
  const int size = 4 * count;
  FeetMeasurement m{count, MatrixXd::Zero(size, B::Dim), 0.1 * samples.normal(size, 1),
                    VectorXd(size), VectorXd::Ones(size)};
  for (int k = 0; k < size; ++k) m.variance[k] = samples.uniform(1e-4, 1e-2);
  for (int f = 0; f < count; ++f) {
    FootRows<double>& rows = m.rows[std::size_t(f)];
    const int slip = int(samples.uniform(1, FootRows<double>::kBlocks + 1));
    const int across = int(samples.uniform(1, slip + 1));
    rows.limit(slip, across);
    for (int k = 0; k < FootRows<double>::kBlocks; ++k) {
      // Feet do not look at the cables' offsets.
      const int at = 3 * int(samples.uniform(0, 4)) + 12 * k;
      M3 h = M3::Zero();  // a row for each of the slip's
      for (int row = 0; row < 3; ++row) {
        if (k < (row < 2 ? slip : across)) h.row(row) = samples.vector(1).transpose();
      }
      rows.set_slip(k, at, Packet<double>(V3(h.col(0))), Packet<double>(V3(h.col(1))),
                    Packet<double>(V3(h.col(2))));
      m.dense.block<3, 3>(4 * f, at) = h;
      const int below = 3 * int(samples.uniform(0, 4)) + 12 * k;
      const V3 height = samples.vector(1);
      rows.set_height(k, below, Packet<double>(height));
      m.dense.block<1, 3>(4 * f + 3, below) = height.transpose();
    }
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
      CHECK(distance(belief.complete_covariance(), expected.covariance) < 1e-12);
      CHECK(symmetric(belief));
      std::reverse(all.begin(), all.end());
    }
  }
}

TEST_CASE("feet: all rows at once are the joint update") {
  const Prism<double> robot;
  for (unsigned seed = 0; seed < 30; ++seed) {
    for (int count = 1; count <= FeetUpdate<double>::kFeet; ++count) {
      Samples samples(seed);
      const B prior = samples.belief(robot);
      const FeetMeasurement m = any_feet(samples, count);
      B belief = prior;
      FeetUpdate<double> update;
      m.fill(update);
      CHECK(update.apply(belief, count));
      const B expected = dense_update(prior, m.dense, m.residual, m.variance);
      CHECK(difference(belief, expected).norm() < 1e-10);
      CHECK(distance(belief.complete_covariance(), expected.covariance) < 1e-12);
      CHECK(symmetric(belief));
      double chi_square = 0;
      for (int k = 0; k < 4 * count; ++k) chi_square += update.chi_square(k);
      const MatrixXd s =
          m.dense * prior.covariance * m.dense.transpose() + MatrixXd(m.variance.asDiagonal());
      CHECK(chi_square ==
            doctest::Approx(m.residual.dot(s.ldlt().solve(m.residual))).epsilon(1e-9));
    }
  }
}

TEST_CASE("feet: each row informs by its own part") {
  const Prism<double> robot;
  Samples samples(7);
  const B prior = samples.belief(robot);
  FeetMeasurement m = any_feet(samples, 3);
  const auto corrected = [&] {
    B belief = prior;
    FeetUpdate<double> update;
    m.fill(update);
    CHECK(update.apply(belief, m.count));
    return belief;
  };
  const B all = corrected();
  m.information << 0.3, 1, 1e-6, 0.8, 1, 0.1, 1, 1, 0.01, 0.5, 0.9, 1;
  MatrixXd expected = prior.covariance;
  B before = prior;
  for (int k = 0; k < 4 * m.count; ++k) {  // one after the other, each given those before it
    const B after =
        dense_update(before, m.dense.row(k), m.residual.segment<1>(k), m.variance.segment<1>(k));
    expected += m.information[k] * (after.covariance - before.covariance);
    before.covariance = after.covariance;
  }
  const B part = corrected();
  CHECK(distance(part.columns, all.columns) < 1e-12);
  CHECK(distance(part.complete_covariance(), expected) < 1e-12);

  m.information[8] = 0;  // not a part
  B belief = prior;
  FeetUpdate<double> update;
  m.fill(update);
  CHECK_FALSE(update.apply(belief, m.count));
  check_unchanged(belief, prior);
}

TEST_CASE("feet: what is not finite changes nothing, a silent foot nothing of the others") {
  const Prism<double> robot;
  Samples samples(8);
  const B prior = samples.belief(robot);
  const FeetMeasurement m = any_feet(samples, 3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  // After the others have corrected without the foot.
  const auto without = [&](const FeetMeasurement& bad, int foot) {
    B belief = prior;
    FeetUpdate<double> update;
    bad.fill(update);
    CHECK_FALSE(update.apply(belief, 3));
    check_unchanged(belief, prior);
    bad.fill(update);
    update.silence(foot);
    CHECK(update.apply(belief, 3));
    return belief;
  };
  for (int k = 0; k < 12; ++k) {
    FeetMeasurement bad = m;
    bad.residual[k] = nan;
    CHECK(difference(without(bad, k / 4), prior).norm() > 1e-6);
  }
  for (int foot = 0; foot < 3; ++foot) {
    FeetMeasurement bad = m;
    bad.rows[std::size_t(foot)].set_height(1, 6, Packet<double>(V3(0, nan, 0)));
    const B belief = without(bad, foot);
    MatrixXd others = m.dense;
    others.middleRows<4>(4 * foot).setZero();
    VectorXd residual = m.residual;
    residual.segment<4>(4 * foot).setZero();
    const B expected = dense_update(prior, others, residual, m.variance);
    CHECK(difference(belief, expected).norm() < 1e-10);
    CHECK(distance(belief.complete_covariance(), expected.covariance) < 1e-12);
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
