// Determinant and cofactors against Eigen's and against minors, of regular and singular matrices.
#include "tensegrity/math/determinant.hpp"

#include <doctest/doctest.h>

#include <Eigen/LU>

namespace {

using tensegrity::Determinant;
using tensegrity::Matrix;
using tensegrity::Vector;

// Of dynamic size, which compiles faster.
Eigen::MatrixXd minors(const Eigen::MatrixXd& a) {
  const Eigen::Index n = a.rows();
  Eigen::MatrixXd out(n, n), minor(n - 1, n - 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index r = 0; r < n - 1; ++r) {
        for (Eigen::Index c = 0; c < n - 1; ++c) minor(r, c) = a(r + (r >= i), c + (c >= j));
      }
      out(i, j) = ((i + j) % 2 == 0 ? 1 : -1) * minor.determinant();
    }
  }
  return out;
}

template <typename Scalar, int N>
Matrix<Scalar, N> of_rank(int rank) {
  Matrix<Scalar, N> a = Matrix<Scalar, N>::Zero();
  for (int k = 0; k < rank; ++k) {
    a += Vector<Scalar, N>::Random() * Vector<Scalar, N>::Random().transpose();
  }
  return a;
}

template <typename Scalar, int N>
void check(int rank, double tolerance) {
  for (int trial = 0; trial < 50; ++trial) {
    const Matrix<Scalar, N> a = of_rank<Scalar, N>(rank);
    const Eigen::MatrixXd plain = a.template cast<double>();
    const Eigen::MatrixXd expected = minors(plain);
    const Determinant<Scalar, N> determinant(a);
    // What rounding of the elements does to the determinant goes with its derivative.
    CHECK(std::abs(double(determinant.value()) - plain.determinant()) <
          tolerance * (1 + expected.norm() * plain.norm()));
    CHECK((determinant.cofactors().template cast<double>() - expected).norm() <
          tolerance * (1 + expected.norm()));
  }
}

}  // namespace

TEST_CASE("determinant and cofactors of regular matrices") {
  check<double, 2>(2, 1e-13);
  check<double, 3>(3, 1e-12);
  check<double, 10>(10, 1e-11);
  check<float, 10>(10, 1e-3);
}

TEST_CASE("cofactors of singular matrices") {
  check<double, 3>(2, 1e-12);
  check<double, 10>(9, 1e-11);
  check<double, 10>(8, 1e-11);  // all zero
  check<float, 10>(9, 1e-3);
}

TEST_CASE("a row and a column of zeros leave one cofactor, zeros alone none") {
  Matrix<double, 4> a = Matrix<double, 4>::Random();
  a.row(1).setZero();
  a.col(2).setZero();
  Matrix<double, 4> expected = Matrix<double, 4>::Zero();
  expected(1, 2) = minors(a)(1, 2);
  REQUIRE(std::abs(expected(1, 2)) > 1e-3);
  CHECK(Determinant<double, 4>(a).value() == 0);
  CHECK((Determinant<double, 4>(a).cofactors() - expected).norm() < 1e-14);

  a.setZero();
  CHECK(Determinant<double, 4>(a).value() == 0);
  CHECK(Determinant<double, 4>(a).cofactors() == a);
}

TEST_CASE("orders of the pivots: the determinant of a permutation is its sign") {
  Matrix<double, 4> a = Matrix<double, 4>::Zero();
  a(0, 2) = a(1, 0) = a(2, 1) = a(3, 3) = 1;  // a cycle of three: even
  CHECK(Determinant<double, 4>(a).value() == 1);
  a.row(0).swap(a.row(3));
  CHECK(Determinant<double, 4>(a).value() == -1);
}
