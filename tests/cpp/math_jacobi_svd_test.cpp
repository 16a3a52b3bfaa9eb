// One-sided Jacobi against Eigen's two-sided one, of regular, singular and badly scaled matrices.
#include "tensegrity/math/jacobi_svd.hpp"

#include <doctest/doctest.h>

#include <Eigen/LU>
#include <Eigen/SVD>

namespace {

using tensegrity::JacobiSvd;
using tensegrity::Matrix;
using tensegrity::Vector;

template <typename Scalar, int N>
void check_decomposition(const Matrix<Scalar, N>& a, Scalar tolerance) {
  const JacobiSvd<Scalar, N> svd(a);
  const Vector<Scalar, N>& s = svd.singular_values();
  CHECK((svd.u().transpose() * svd.u()).isIdentity(tolerance));
  CHECK((svd.v().transpose() * svd.v()).isIdentity(tolerance));
  CHECK((svd.u() * s.asDiagonal() * svd.v().transpose() - a).norm() <= tolerance * a.norm());
  CHECK(s.minCoeff() >= 0);
  for (int k = 1; k < N; ++k) CHECK(s[k] <= s[k - 1]);
  // Of dynamic size, which compiles faster.
  const Eigen::MatrixXd plain = a.template cast<double>();
  const Eigen::VectorXd expected = Eigen::JacobiSVD<Eigen::MatrixXd>(plain).singularValues();
  CHECK((s.template cast<double>() - expected).norm() <= double(tolerance * a.norm()));
}

template <typename Scalar, int N>
void check_random(Scalar tolerance) {
  for (int trial = 0; trial < 50; ++trial) {
    Matrix<Scalar, N> a = Matrix<Scalar, N>::Random();
    check_decomposition(a, tolerance);
    a.row(0) = a.row(N - 1);  // one singular value is zero
    check_decomposition(a, tolerance);
    a.col(0).setZero();  // and another, exactly
    check_decomposition(a, tolerance);
  }
}

}  // namespace

TEST_CASE("singular value decomposition of random matrices") {
  check_random<double, 2>(1e-14);
  check_random<double, 3>(1e-14);
  check_random<double, 10>(1e-13);
  check_random<float, 10>(1e-5F);
}

TEST_CASE("singular value decomposition of matrices that are special") {
  check_decomposition<double, 4>(Matrix<double, 4>::Zero(), 1e-15);
  check_decomposition<double, 4>(Matrix<double, 4>::Identity(), 1e-15);
  check_decomposition<double, 4>(Matrix<double, 4>::Ones(), 1e-15);
  check_decomposition<double, 4>(1e-200 * Matrix<double, 4>::Identity(), 1e-15);
}

TEST_CASE("small singular values keep their digits when columns are small") {
  for (int trial = 0; trial < 50; ++trial) {
    const Matrix<double, 6> regular =
        Matrix<double, 6>::Random() + 3 * Matrix<double, 6>::Identity();
    Vector<double, 6> scale;
    scale << 1e12, 1e8, 1e4, 1, 1e-4, 1e-8;
    const JacobiSvd<double, 6> svd(regular * scale.asDiagonal());
    double product = 1, expected = std::abs(regular.determinant());
    for (int k = 0; k < 6; ++k) {
      product *= svd.singular_values()[k];
      expected *= scale[k];
    }
    CHECK(product == doctest::Approx(expected).epsilon(1e-12));
  }
}

TEST_CASE("a matrix that is not finite comes to an end") {
  Matrix<double, 3> a = Matrix<double, 3>::Random();
  a(1, 2) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(JacobiSvd<double, 3>(a).singular_values().allFinite());
}
