// The unscented filter: against the Kalman filter, between its forms, and with odd input.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <random>

#include "allocations.hpp"
#include "doctest/doctest.h"
#include "tensegrity/ukf/unscented_filter.hpp"

using tensegrity::Status;
using namespace tensegrity::ukf;

namespace {

template <typename Scalar>
MatrixX<Scalar> random_covariance(int n, std::mt19937& random, double scale = 1) {
  std::normal_distribution<double> normal;
  MatrixX<Scalar> a(n, n);
  for (int i = 0; i < a.size(); ++i) a.data()[i] = Scalar(normal(random));
  return Scalar(scale) * (a * a.transpose() / Scalar(n) + MatrixX<Scalar>::Identity(n, n) / 10);
}

template <typename Scalar>
MatrixX<Scalar> random_matrix(int rows, int columns, std::mt19937& random) {
  std::normal_distribution<double> normal;
  MatrixX<Scalar> a(rows, columns);
  for (int i = 0; i < a.size(); ++i) a.data()[i] = Scalar(normal(random));
  return a;
}

template <typename Scalar>
UnscentedSettings<Scalar> settings(Form form, Weights weights = Weights::kScaled,
                                   bool redraw = true) {
  UnscentedSettings<Scalar> s;
  s.form = form;
  s.weights = weights;
  s.redraw = redraw;
  return s;
}

// A process and a measurement that are nonlinear, smooth and mix all coordinates.
const auto kProcess = [](auto points) {
  for (int r = 0; r < points.rows(); ++r) {
    const double first = points(r, 0);
    for (int j = 0; j + 1 < points.cols(); ++j) {
      points(r, j) += 0.1 * std::sin(double(points(r, j + 1)));
    }
    points(r, points.cols() - 1) += 0.1 * first * first;
  }
  return true;
};
const auto kMeasure = [](const auto& points, auto predicted) {
  for (int r = 0; r < points.rows(); ++r) {
    for (int j = 0; j < predicted.cols(); ++j) {
      const double x = points(r, j), y = points(r, (j + 1) % points.cols());
      predicted(r, j) = std::sqrt(9 + x * x + y);
    }
  }
};

double smallest_eigenvalue(const MatrixX<double>& p) {
  return Eigen::SelfAdjointEigenSolver<MatrixX<double>>(p).eigenvalues().minCoeff();
}

}  // namespace

TEST_CASE("a linear problem gives what the Kalman filter gives, in both forms") {
  std::mt19937 random(1);
  const int n = 7, m = 4;
  for (const Form form : {Form::kCovariance, Form::kSquareRoot}) {
    for (const bool redraw : {true, false}) {
      UnscentedFilter<double> filter(n, m, settings<double>(form, Weights::kScaled, redraw));
      VectorX<double> x = random_matrix<double>(n, 1, random);
      MatrixX<double> p = random_covariance<double>(n, random);
      REQUIRE(filter.set(x, p) == Status::kOk);
      for (int k = 0; k < 20; ++k) {
        const MatrixX<double> f = 0.4 * random_matrix<double>(n, n, random);
        const MatrixX<double> h = random_matrix<double>(m, n, random);
        const MatrixX<double> q = random_covariance<double>(n, random, 0.1);
        const VectorX<double> z = random_matrix<double>(m, 1, random);
        const VectorX<double> r = VectorX<double>::Constant(m, 0.3);
        x = f * x;
        const MatrixX<double> propagated = f * p * f.transpose();
        p = propagated + q;
        const auto process = [&](auto points) {
          points = (points * f.transpose()).eval();
          return true;
        };
        REQUIRE(filter.predict(process, q) == Status::kOk);
        CHECK((filter.mean() - x).norm() < 1e-9);
        CHECK((filter.covariance() - p).norm() < 1e-9);
        // Without new points the measurement sees the covariance without the noise.
        const MatrixX<double> seen = redraw ? p : propagated;
        const MatrixX<double> s = h * seen * h.transpose() + MatrixX<double>(r.asDiagonal());
        const MatrixX<double> gain = seen * h.transpose() * s.inverse();
        const VectorX<double> nu = z - h * x;
        x += gain * nu;
        p -= gain * s * gain.transpose();
        const auto measure = [&](const auto& points, auto predicted) {
          predicted = points * h.transpose();
        };
        REQUIRE(filter.correct(measure, z, r) == Status::kOk);
        CHECK((filter.mean() - x).norm() < 1e-8);
        CHECK((filter.covariance() - p).norm() < 1e-8);
        CHECK(filter.squared_distance() == doctest::Approx(nu.dot(s.inverse() * nu)));
        CHECK(filter.innovation_variance(2) == doctest::Approx(s(2, 2)));
      }
    }
  }
}

TEST_CASE("both forms agree on a nonlinear problem, with every kind of weights and points") {
  const int n = 9, m = 6;
  for (const Weights weights : {Weights::kScaled, Weights::kUniform}) {
    for (const bool redraw : {true, false}) {
      for (const double alpha : {0.0139, 0.5}) {
        for (const double beta : {2.0, 0.0}) {
          std::mt19937 random(2);
          auto s = settings<double>(Form::kCovariance, weights, redraw);
          s.alpha = alpha;
          s.beta = beta;
          UnscentedFilter<double> plain(n, m, s);
          s.form = Form::kSquareRoot;
          UnscentedFilter<double> root(n, m, s);
          const VectorX<double> x = random_matrix<double>(n, 1, random);
          const MatrixX<double> p = random_covariance<double>(n, random);
          const MatrixX<double> q = random_covariance<double>(n, random, 0.05);
          plain.set(x, p);
          root.set(x, p);
          for (int k = 0; k < 10; ++k) {
            const VectorX<double> z =
                VectorX<double>::Constant(m, 3) + 0.3 * random_matrix<double>(m, 1, random);
            const VectorX<double> r = VectorX<double>::Constant(m, 0.04);
            CHECK(plain.predict(kProcess, q) == Status::kOk);
            CHECK(root.predict(kProcess, q) == Status::kOk);
            CHECK(plain.correct(kMeasure, z, r, 9.0) == root.correct(kMeasure, z, r, 9.0));
            REQUIRE((plain.mean() - root.mean()).norm() < 1e-7);
            REQUIRE((plain.covariance() - root.covariance()).norm() < 1e-7);
            REQUIRE(plain.squared_distance() == doctest::Approx(root.squared_distance()));
            REQUIRE(plain.covariance(3, 1) == doctest::Approx(root.covariance(1, 3)));
          }
        }
      }
    }
  }
}

TEST_CASE("the gate leaves out a wrong row and nothing else") {
  for (const Form form : {Form::kCovariance, Form::kSquareRoot}) {
    std::mt19937 random(3);
    const int n = 6;
    const VectorX<double> x = random_matrix<double>(n, 1, random);
    const MatrixX<double> p = random_covariance<double>(n, random, 0.01);
    UnscentedFilter<double> with(n, 4, settings<double>(form)),
        without(n, 4, settings<double>(form));
    with.set(x, p);
    without.set(x, p);
    VectorX<double> z = x.head(4), r = VectorX<double>::Constant(4, 0.01);
    z[1] += 5;
    z[2] = std::numeric_limits<double>::quiet_NaN();
    const auto direct = [](const auto& points, auto predicted) {
      predicted = points.leftCols(predicted.cols());
    };
    CHECK(with.correct(direct, z, r, 12.0) == Status::kOk);
    CHECK(with.used() == 2);
    CHECK(with.accepted(0));
    CHECK_FALSE(with.accepted(1));
    CHECK_FALSE(with.accepted(2));
    CHECK(with.accepted(3));
    CHECK(with.innovation(1) == doctest::Approx(5));
    const auto two = [](const auto& points, auto predicted) {
      predicted.col(0) = points.col(0);
      predicted.col(1) = points.col(3);
    };
    const VectorX<double> two_z = (VectorX<double>(2) << z[0], z[3]).finished();
    CHECK(without.correct(two, two_z, r.head(2)) == Status::kOk);
    CHECK((with.mean() - without.mean()).norm() == doctest::Approx(0));
    CHECK((with.covariance() - without.covariance()).norm() < 1e-12);

    z.setConstant(100);
    const VectorX<double> before = with.mean();
    CHECK(with.correct(direct, z, r, 12.0) == Status::kRejected);
    CHECK(with.mean() == before);
    CHECK(with.correct(direct, VectorX<double>(0), VectorX<double>(0)) == Status::kOk);
    CHECK(with.correct(direct, VectorX<double>::Zero(5), VectorX<double>::Ones(5)) ==
          Status::kOutOfRange);
    CHECK(with.mean() == before);
  }
}

TEST_CASE("what cannot be computed leaves a finite, semidefinite state") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Form form : {Form::kCovariance, Form::kSquareRoot}) {
    std::mt19937 random(4);
    const int n = 5;
    UnscentedFilter<double> filter(n, 3, settings<double>(form));
    const VectorX<double> x = random_matrix<double>(n, 1, random);
    const MatrixX<double> p = random_covariance<double>(n, random);
    CHECK(filter.set(VectorX<double>::Constant(n, nan), p) == Status::kNotFinite);
    CHECK(filter.set(x, -p) == Status::kOutOfRange);
    CHECK(filter.set(x.head(3), p) == Status::kOutOfRange);
    REQUIRE(filter.set(x, p) == Status::kOk);
    const MatrixX<double> q = MatrixX<double>::Identity(n, n);

    const auto to_nan = [&](auto points) {
      points(3, 2) = nan;
      return true;
    };
    const auto overflow = [&](auto points) {
      points.array() = points.array() * 1e200 * 1e107;
      return true;
    };
    const auto fails = [](auto) { return false; };
    CHECK(filter.predict(to_nan, q) == Status::kNotFinite);
    CHECK(filter.predict(overflow, q) == Status::kNotFinite);
    CHECK(filter.predict(fails, q) == Status::kNotFinite);
    CHECK(filter.predict(fails, MatrixX<double>::Constant(n, n, nan)) == Status::kNotFinite);
    CHECK(filter.mean() == x);
    CHECK((filter.covariance() - p - 3 * q).norm() < 1e-10);  // time has passed three times

    const auto bad = [&](const auto&, auto predicted) { predicted.setConstant(nan); };
    CHECK(filter.correct(bad, VectorX<double>::Zero(3), VectorX<double>::Ones(3)) ==
          Status::kRejected);
    const auto first = [&](const auto& points, auto predicted) {
      for (int r = 0; r < predicted.cols(); ++r) predicted.col(r) = points.col(0);
    };
    CHECK(filter.correct(first, VectorX<double>::Zero(3), VectorX<double>::Zero(3)) ==
          Status::kRejected);
    CHECK(filter.mean() == x);
    // The same coordinate again and again, with next to no noise.
    for (int k = 0; k < 50; ++k) {
      filter.correct(first, VectorX<double>::Constant(3, 1), VectorX<double>::Constant(3, 1e-14));
      REQUIRE(filter.mean().allFinite());
      REQUIRE(smallest_eigenvalue(filter.covariance()) > -1e-12);
    }
    CHECK(filter.mean()[0] == doctest::Approx(1).epsilon(1e-5));
  }
}

TEST_CASE("a singular covariance has no spread where it has no variance") {
  for (const Form form : {Form::kCovariance, Form::kSquareRoot}) {
    std::mt19937 random(5);
    const int n = 6;
    const MatrixX<double> a = random_matrix<double>(n, 2, random);
    UnscentedFilter<double> filter(n, 1, settings<double>(form));
    REQUIRE(filter.set(VectorX<double>::Zero(n), a * a.transpose()) == Status::kOk);
    CHECK((filter.covariance() - a * a.transpose()).norm() < 1e-10);
    const auto stay = [](auto) { return true; };
    CHECK(filter.predict(stay, MatrixX<double>::Zero(n, n)) == Status::kOk);
    CHECK((filter.covariance() - a * a.transpose()).norm() < 1e-10);
  }
}

TEST_CASE("errors are as large as the covariance says") {
  // A point circles on a spring, two ranges are measured: 300 runs of 20 steps.
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  const MatrixX<double> q = (VectorX<double>(4) << 1e-4, 1e-4, 4e-4, 4e-4).finished().asDiagonal();
  const MatrixX<double> p0 = 0.01 * MatrixX<double>::Identity(4, 4);
  const VectorX<double> r = VectorX<double>::Constant(2, 0.0025);
  const auto step = [](auto points) {
    for (int k = 0; k < points.rows(); ++k) {
      const double x = points(k, 0), y = points(k, 1), pull = 0.1 / std::hypot(x, y);
      points(k, 0) += 0.1 * points(k, 2);
      points(k, 1) += 0.1 * points(k, 3);
      points(k, 2) -= pull * x;
      points(k, 3) -= pull * y;
    }
    return true;
  };
  const auto ranges = [](const auto& points, auto predicted) {
    for (int k = 0; k < points.rows(); ++k) {
      predicted(k, 0) = std::hypot(points(k, 0) + 2, points(k, 1) - 3);
      predicted(k, 1) = std::hypot(points(k, 0) - 3, points(k, 1) - 2);
    }
  };
  double nees = 0, nis = 0;
  const int runs = 300;
  for (int run = 0; run < runs; ++run) {
    VectorX<double> start(4);
    start << 1, 0, 0, 1;
    MatrixX<double> truth = start.transpose();
    for (int i = 0; i < 4; ++i) truth(0, i) += 0.1 * normal(random);
    UnscentedFilter<double> filter(4, 2);
    filter.set(start, p0);
    for (int k = 0; k < 20; ++k) {
      step(MatrixRef<double>(truth));
      for (int i = 0; i < 4; ++i) truth(0, i) += std::sqrt(q(i, i)) * normal(random);
      MatrixX<double> z(1, 2);
      ranges(truth, MatrixRef<double>(z));
      const VectorX<double> noisy =
          z.transpose() + 0.05 * (VectorX<double>(2) << normal(random), normal(random)).finished();
      filter.predict(step, q);
      filter.correct(ranges, noisy, r);
      nis += filter.squared_distance() / (runs * 20);
    }
    const VectorX<double> error = filter.mean() - truth.transpose();
    nees += error.dot(filter.covariance().llt().solve(error)) / runs;
  }
  // Means of 300 chi-square(4) and 6000 chi-square(2): standard deviations 0.16 and 0.026.
  CHECK(nees == doctest::Approx(4).epsilon(0.13));
  CHECK(nis == doctest::Approx(2).epsilon(0.06));
}

TEST_CASE("single precision follows double precision") {
  std::mt19937 random(7);
  const int n = 12, m = 6;
  const MatrixX<double> p = random_covariance<double>(n, random, 0.01);
  const MatrixX<double> q = random_covariance<double>(n, random, 0.001);
  const VectorX<double> x = random_matrix<double>(n, 1, random);
  for (const Form form : {Form::kCovariance, Form::kSquareRoot}) {
    UnscentedFilter<double> wide(n, m, settings<double>(form));
    UnscentedFilter<float> narrow(n, m, settings<float>(form));
    wide.set(x, p);
    narrow.set(x.cast<float>(), p.cast<float>());
    const MatrixX<float> narrow_q = q.cast<float>();
    for (int k = 0; k < 20; ++k) {
      VectorX<double> z(m);
      for (int j = 0; j < m; ++j) z[j] = 3.2 + 0.02 * j;
      const VectorX<double> r = VectorX<double>::Constant(m, 0.01);
      wide.predict(kProcess, q);
      narrow.predict(kProcess, narrow_q);
      wide.correct(kMeasure, z, r);
      narrow.correct(kMeasure, z.cast<float>(), r.cast<float>());
    }
    CHECK((wide.mean() - narrow.mean().cast<double>()).norm() < 2e-3);
    CHECK((wide.covariance() - narrow.covariance().cast<double>()).norm() <
          0.01 * wide.covariance().norm());
  }
}

TEST_CASE("nothing is allocated after construction") {
  std::mt19937 random(8);
  for (const int n : {72, 144}) {
    const int m = 30;
    const MatrixX<double> p = random_covariance<double>(n, random, 0.01);
    const MatrixX<double> q = random_covariance<double>(n, random, 0.001);
    const VectorX<double> x = random_matrix<double>(n, 1, random);
    const VectorX<double> z = VectorX<double>::Constant(m, 3.1);
    const VectorX<double> r = VectorX<double>::Constant(m, 0.01);
    for (const Form form : {Form::kCovariance, Form::kSquareRoot}) {
      for (const bool redraw : {true, false}) {
        UnscentedFilter<double> filter(n, m, settings<double>(form, Weights::kScaled, redraw));
        const long before = tensegrity::testing::allocations();
        filter.set(x, p);
        for (int k = 0; k < 2; ++k) {
          CHECK(filter.predict(kProcess, q) == Status::kOk);
          CHECK(filter.correct(kMeasure, z, r, 100.0) == Status::kOk);
        }
        CHECK(tensegrity::testing::allocations() == before);
      }
    }
  }
}
