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
using tensegrity::Packet;
using tensegrity::Prism;
using tensegrity::tight::FootRows;
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

struct FootMeasurement {
  FootRows<double> rows;
  MatrixXd dense;
  Eigen::Vector4d residual, variance;
};

Packet<double> packet(const Eigen::Vector4d& x) { return {x[0], x[1], x[2], x[3]}; }

FootMeasurement any_foot(Samples& samples) {
  FootMeasurement m{{}, MatrixXd::Zero(4, B::Dim), 0.1 * samples.normal(4, 1), {}};
  for (int k = 0; k < 4; ++k) m.variance[k] = samples.uniform(1e-4, 1e-2);
  const int slip = int(samples.uniform(1, FootRows<double>::kBlocks + 1));
  const int across = int(samples.uniform(1, slip + 1));
  for (int k = 0; k < slip; ++k) {
    const int at = 3 * int(samples.uniform(0, 5)) + 15 * k;
    const V3 a = samples.vector(1), b = samples.vector(1),
             c = k < across ? samples.vector(1) : V3(V3::Zero());
    m.rows.add_slip(at, Packet<double>(a), Packet<double>(b), Packet<double>(c));
    m.dense.block<1, 3>(0, at) = a.transpose();
    m.dense.block<1, 3>(1, at) = b.transpose();
    m.dense.block<1, 3>(2, at) = c.transpose();
  }
  m.rows.limit_across(across);
  for (int k = 0; k < FootRows<double>::kBlocks; ++k) {
    const int at = 3 * int(samples.uniform(0, 5)) + 15 * k;
    const V3 h = samples.vector(1);
    m.rows.set_height(k, at, Packet<double>(h));
    m.dense.block<1, 3>(3, at) = h.transpose();
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

TEST_CASE("the rows of feet are rows like others, before, after and between them") {
  const Prism<double> robot;
  for (unsigned seed = 0; seed < 30; ++seed) {
    Samples samples(seed);
    const B prior = samples.belief(robot);
    // Up to six feet, and a few single rows: batches get full, and begin anywhere.
    MatrixXd h(0, B::Dim);
    VectorXd z(0), variances(0);
    double chi_square = 0;
    B belief = prior;
    const auto stack = [&](const MatrixXd& rows, const VectorXd& residual, const VectorXd& var) {
      const Eigen::Index n = z.size() + residual.size();
      h.conservativeResize(n, Eigen::NoChange);
      h.bottomRows(rows.rows()) = rows;
      z.conservativeResize(n);
      z.tail(residual.size()) = residual;
      variances.conservativeResize(n);
      variances.tail(var.size()) = var;
    };
    {
      SequentialUpdate<double> update(belief);
      const int steps = int(samples.uniform(1, 9));
      for (int step = 0; step < steps; ++step) {
        if (samples.uniform(0, 1) < 0.6) {
          const FootMeasurement m = any_foot(samples);
          const Packet<double> parts =
              update.correct(m.rows, packet(m.residual), packet(m.variance), {1.0, 1.0, 1.0, 1.0});
          for (int k = 0; k < 4; ++k) chi_square += parts.at(k);
          stack(m.dense, m.residual, m.variance);
        } else {
          const Measurement m = any_measurement(samples);
          chi_square += update.correct(m.row, m.residual, m.variance);
          stack(m.dense.transpose(), VectorXd::Constant(1, m.residual),
                VectorXd::Constant(1, m.variance));
        }
      }
    }
    const B expected = dense_update(prior, h, z, variances);
    CHECK(difference(belief, expected).norm() < 1e-10);
    CHECK(distance(belief.covariance, expected.covariance) < 1e-12);
    const MatrixXd s = h * prior.covariance * h.transpose() + MatrixXd(variances.asDiagonal());
    CHECK(chi_square == doctest::Approx(z.dot(s.ldlt().solve(z))).epsilon(1e-9));
  }
}

TEST_CASE("of a foot each row informs by its own part") {
  const Prism<double> robot;
  Samples samples(7);
  const B prior = samples.belief(robot);
  const FootMeasurement m = any_foot(samples);
  const auto corrected = [&](const Eigen::Vector4d& information) {
    B belief = prior;
    SequentialUpdate<double>(belief).correct(m.rows, packet(m.residual), packet(m.variance),
                                             packet(information));
    return belief;
  };
  const B whole = corrected(Eigen::Vector4d::Ones());
  MatrixXd expected = prior.covariance;
  const Eigen::Vector4d parts(0.3, 1, 0, 0.8);
  B before = prior;
  for (int k = 0; k < 4; ++k) {  // one after the other, each given those before it
    const B after =
        dense_update(before, m.dense.row(k), m.residual.segment<1>(k), m.variance.segment<1>(k));
    expected += parts[k] * (after.covariance - before.covariance);
    before.covariance = after.covariance;
  }
  const B part = corrected(parts);
  CHECK(part.columns == whole.columns);
  CHECK(distance(part.covariance, expected) < 1e-12);
}

TEST_CASE("a foot with a row that is not finite changes nothing") {
  const Prism<double> robot;
  Samples samples(8);
  const B prior = samples.belief(robot);
  const FootMeasurement m = any_foot(samples), bad = any_foot(samples);
  const Packet<double> whole(1.0, 1.0, 1.0, 1.0);
  const auto correct_both = [&](B& belief) {
    SequentialUpdate<double> update(belief);
    for (int k = 0; k < 4; ++k) {
      Eigen::Vector4d residual = bad.residual;
      residual[k] = std::numeric_limits<double>::quiet_NaN();
      update.correct(bad.rows, packet(residual), packet(bad.variance), whole);
    }
    FootRows<double> infinite = bad.rows;
    infinite.set_height(1, 0, Packet<double>(V3(0, std::numeric_limits<double>::infinity(), 0)));
    update.correct(infinite, packet(bad.residual), packet(bad.variance), whole);
    update.correct(m.rows, packet(m.residual), packet(m.variance), whole);
  };
  B belief = prior, alone = prior;
  correct_both(belief);
  SequentialUpdate<double>(alone).correct(m.rows, packet(m.residual), packet(m.variance), whole);
  CHECK(belief.columns == alone.columns);
  CHECK(belief.covariance == alone.covariance);
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
