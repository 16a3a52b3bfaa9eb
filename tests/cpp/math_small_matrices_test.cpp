// The hand-written parts of covariance arithmetic against Eigen's dense products.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "tensegrity/math/ldlt.hpp"

namespace {

using tensegrity::Matrix;
using tensegrity::Vector;

template <typename Scalar, int N>
Matrix<Scalar, N> positive_definite() {
  const Matrix<Scalar, N> a = Matrix<Scalar, N>::Random();
  return a * a.transpose() + Scalar(0.1) * Matrix<Scalar, N>::Identity();
}

template <typename Scalar, int N>
void check_factors(Scalar tolerance) {
  for (int trial = 0; trial < 50; ++trial) {
    const Matrix<Scalar, N> a = positive_definite<Scalar, N>();
    Matrix<Scalar, N> lower = a.template triangularView<Eigen::Lower>();
    lower.template triangularView<Eigen::StrictlyUpper>().setConstant(
        std::numeric_limits<Scalar>::quiet_NaN());  // never read
    tensegrity::Ldlt<Scalar, N> ldlt;
    REQUIRE(ldlt.factor(lower));
    Matrix<Scalar, N> l = Matrix<Scalar, N>::Identity();
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j < i; ++j) l(i, j) = ldlt.l(i, j);
    }
    const Vector<Scalar, N> d = ldlt.inverse_diagonal().cwiseInverse();
    CHECK((l * d.asDiagonal() * l.transpose() - a).norm() < tolerance * a.norm());
    const Vector<Scalar, N> b = Vector<Scalar, N>::Random();
    CHECK((a * ldlt.solve(b) - b).norm() < 1000 * tolerance * b.norm());
    CHECK((l * ldlt.forward(b) - b).norm() < 100 * tolerance * b.norm());
  }
}

}  // namespace

TEST_CASE("L D L' of small matrices") {
  check_factors<double, 1>(1e-14);
  check_factors<double, 3>(1e-14);
  check_factors<double, 10>(1e-14);
  check_factors<double, 18>(1e-13);
  check_factors<float, 10>(1e-5F);
}

TEST_CASE("a matrix that is not positive definite, or not finite, has no factors") {
  tensegrity::Ldlt<double, 3> ldlt;
  Matrix<double, 3> a = positive_definite<double, 3>();
  a(1, 1) = -1;
  CHECK_FALSE(ldlt.factor(a));
  a(1, 1) = 0;
  CHECK_FALSE(ldlt.factor(a));
  a(1, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(ldlt.factor(a));
  a(1, 1) = std::numeric_limits<double>::infinity();
  CHECK_FALSE(ldlt.factor(a));
}

TEST_CASE_TEMPLATE("packets: loads, sums and transposes", Scalar, double, float) {
  using tensegrity::Packet;
  Matrix<Scalar, 4> m = Matrix<Scalar, 4>::Random();
  Packet<Scalar> columns[4];
  for (int c = 0; c < 4; ++c) columns[c] = Packet<Scalar>(&m(0, c));
  Packet<Scalar>::transpose(columns);
  Matrix<Scalar, 4> transposed;
  for (int c = 0; c < 4; ++c) columns[c].store(&transposed(0, c));
  CHECK(transposed == m.transpose());

  Packet<Scalar> sum(m(0, 0), m(1, 0), m(2, 0), m(3, 0));
  sum.add(Scalar(2), Packet<Scalar>(&m(0, 1)));
  sum.subtract(Scalar(3), Packet<Scalar>(&m(0, 2)));
  Eigen::Matrix<Scalar, 4, 1> out;
  sum.store(&out[0]);
  CHECK((out - (m.col(0) + 2 * m.col(1) - 3 * m.col(2))).norm() <
        10 * std::numeric_limits<Scalar>::epsilon());
}

template <int Rows>
void check_sum() {
  const Matrix<double, Rows, 5> columns = Matrix<double, Rows, 5>::Random();
  const Eigen::Matrix<double, 5, 1> factors = Eigen::Matrix<double, 5, 1>::Random();
  tensegrity::Sum<double, Rows, 5> sum;
  for (int k = 0; k < 5; ++k) sum.add(factors[k], &columns(0, k));
  Eigen::Matrix<double, Rows, 1> out;
  sum.store(&out[0]);
  CHECK((out - columns * factors).norm() < 1e-14);
}

TEST_CASE("sums of columns of any number of packets") {
  check_sum<4>();
  check_sum<16>();
  check_sum<28>();
  check_sum<36>();
  check_sum<52>();
}

TEST_CASE("columns, outer products and mirrors of part of a covariance") {
  using P = Matrix<double, 28>;
  for (const int size : {16, 28}) {
    P p = P::Zero();
    p.topLeftCorner(size, size).setRandom();
    P columns = p;
    const tensegrity::Matrix3<double> m = tensegrity::Matrix3<double>::Random();
    tensegrity::add_columns(columns, 0, 9, m, 0, size);
    P expected = p;
    expected.middleCols<3>(0) += p.middleCols<3>(9) * m.transpose();
    CHECK((columns - expected).norm() < 1e-14);

    columns = p;
    tensegrity::add_columns(columns, 3, 9, 0.7, size);
    expected = p;
    expected.middleCols<3>(3) += 0.7 * p.middleCols<3>(9);
    CHECK((columns - expected).norm() < 1e-14);

    tensegrity::mirror(p, size);
    CHECK((p - p.transpose()).norm() == 0);
    for (const int count : {0, 1, 3, 4, 9, 12}) {
      Matrix<double, 28, 12> w = Matrix<double, 28, 12>::Random();
      w.bottomRows(28 - size).setZero();
      P reduced = p;
      tensegrity::subtract_outer(reduced, w, count, size);
      const Eigen::MatrixXd used = w.leftCols(count);
      CHECK((reduced - (p - used * used.transpose())).norm() < 1e-13);
      CHECK((reduced - reduced.transpose()).norm() == 0);
    }
  }
}
