// The hand-written parts of covariance arithmetic against Eigen's dense products.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <limits>

#include "tensegrity/math/ldlt.hpp"
#include "tensegrity/math/vector_lanes.hpp"

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
  constexpr int kBelow = 8;
  for (int trial = 0; trial < 50; ++trial) {
    const Matrix<Scalar, N> a = positive_definite<Scalar, N>();
    const Vector<Scalar, N> b = Vector<Scalar, N>::Random();
    const Matrix<Scalar, kBelow, N> below = Matrix<Scalar, kBelow, N>::Random();
    tensegrity::Ldlt<Scalar, N, kBelow> system;
    system.matrix() = a.template triangularView<Eigen::Lower>();
    system.matrix().template triangularView<Eigen::StrictlyUpper>().setConstant(
        std::numeric_limits<Scalar>::quiet_NaN());  // never read
    system.set_right(b);
    system.below() = below;
    REQUIRE(system.factor());
    const Vector<Scalar, N> inverse = system.inverse_diagonal();
    Matrix<Scalar, N> l = Matrix<Scalar, N>::Identity();
    Vector<Scalar, N> y;
    Matrix<Scalar, kBelow, N> w;
    for (int j = 0; j < N; ++j) {
      for (int i = j + 1; i < N; ++i) l(i, j) = system.column(j)[i] * inverse[j];
      y[j] = system.yd(j);
      w.col(j) = Eigen::Map<const Eigen::Matrix<Scalar, kBelow, 1>>(system.wd(j));
    }
    CHECK((l * inverse.cwiseInverse().asDiagonal() * l.transpose() - a).norm() <
          tolerance * a.norm());
    CHECK((l * y - b).norm() < 100 * tolerance * b.norm());
    CHECK((w * l.transpose() - below).norm() < 100 * tolerance * below.norm());
    CHECK((a * system.solve() - b).norm() < 1000 * tolerance * b.norm());
    system.solve_below();
    CHECK((system.below() * a - below).norm() < 1000 * tolerance * below.norm());
  }
}

}  // namespace

TEST_CASE("elimination in small matrices, and below them") {
  check_factors<double, 1>(1e-14);
  check_factors<double, 3>(1e-14);
  check_factors<double, 10>(1e-14);
  check_factors<double, 18>(1e-13);
  check_factors<float, 10>(1e-5F);
}

TEST_CASE("a matrix that is not positive definite, or not finite, has no factors") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const Matrix<double, 3> a = positive_definite<double, 3>();
  for (const double bad : {-1.0, 0.0, nan, infinity}) {
    tensegrity::Ldlt<double, 3> system;
    system.matrix() = a;
    system.set_right(tensegrity::Vector3<double>::Zero());
    system.column(1)[1] = bad;
    CHECK_FALSE(system.factor());
  }
}

TEST_CASE_TEMPLATE("packets: loads, sums and transposes", Scalar, double, float) {
  using tensegrity::Packet;
  Matrix<Scalar, 4> m = Matrix<Scalar, 4>::Random();
  Packet<Scalar> x0(&m(0, 0)), x1(&m(0, 1)), x2(&m(0, 2)), x3(&m(0, 3));
  Packet<Scalar>::transpose(x0, x1, x2, x3);
  Matrix<Scalar, 4> transposed;
  x0.store(&transposed(0, 0));
  x1.store(&transposed(0, 1));
  x2.store(&transposed(0, 2));
  x3.store(&transposed(0, 3));
  CHECK(transposed == m.transpose());
  for (int row = 0; row < 4; ++row) CHECK(x1.at(row) == m(1, row));

  using V3 = tensegrity::Vector3<Scalar>;
  const V3 a = V3::Random(), b = V3::Random();
  V3 across;
  const auto cross = Packet<Scalar>::cross(Packet<Scalar>(a), Packet<Scalar>(b));
  cross.store_vector(across);
  CHECK((across - a.cross(b)).norm() < 4 * std::numeric_limits<Scalar>::epsilon());
  CHECK(cross.at(3) == 0);

  Packet<Scalar> sum(m(0, 0), m(1, 0), m(2, 0), m(3, 0));
  sum.add(Scalar(2), Packet<Scalar>(&m(0, 1)));
  sum.subtract(Scalar(3), Packet<Scalar>(&m(0, 2)));
  Eigen::Matrix<Scalar, 4, 1> out;
  sum.store(&out[0]);
  CHECK((out - (m.col(0) + 2 * m.col(1) - 3 * m.col(2))).norm() <
        10 * std::numeric_limits<Scalar>::epsilon());
}

TEST_CASE_TEMPLATE("packets: number by number", Scalar, double, float) {
  using P = tensegrity::Packet<Scalar>;
  using Four = Eigen::Array<Scalar, 4, 1>;
  const Four a(4, 2, 9, 1), b(-1, 3, 0.5, 7);
  const auto check = [](const P& x, const Four& expected) {
    for (int k = 0; k < 4; ++k) CHECK(x.at(k) == doctest::Approx(expected[k]));
  };
  const P x(a.data()), y(b.data());
  check(P::all(3), Four::Constant(3));
  check(P::sqrt(x), a.sqrt());
  check(Scalar(2) / x, 2 / a);
  P sum = y;
  sum.add(x, y);
  check(sum, b + a * b);
  sum.subtract(x, x);
  check(sum, b + a * b - a * a);
  check(P::where_greater(x, Scalar(2), x, y), Four(a[0], b[1], a[2], b[3]));
  check(P::template first<1>(x, y), Four(a[0], b[1], b[2], b[3]));
  check(P::template first<3>(x, y), Four(a[0], a[1], a[2], b[3]));
}

TEST_CASE_TEMPLATE("vectors in lanes: what is done to all is done to each", Scalar, double, float) {
  using tensegrity::Packet;
  using V = tensegrity::VectorLanes<Scalar>;
  using V3 = tensegrity::Vector3<Scalar>;
  const Scalar tolerance = 10 * std::numeric_limits<Scalar>::epsilon();
  std::array<V3, 4> a, b;
  for (V3& v : a) v.setRandom();
  for (V3& v : b) v.setRandom();
  const tensegrity::Matrix3<Scalar> m = tensegrity::Matrix3<Scalar>::Random();
  const Scalar factors[] = {1, -2, 3, 0.5};
  const Packet<Scalar> s(factors);
  const auto lanes = [](const std::array<V3, 4>& v) {
    return V::of(Packet<Scalar>(v[0]), Packet<Scalar>(v[1]), Packet<Scalar>(v[2]),
                 Packet<Scalar>(v[3]));
  };
  const V u = lanes(a), v = lanes(b);
  V more = u, less = u;
  more.add(s, v);
  less.subtract(s, v);
  const V3 any(1, 2, 3);
  for (int k = 0; k < 4; ++k) {
    const V3& x = a[std::size_t(k)];
    const V3& y = b[std::size_t(k)];
    const auto at = [k](const V& w) { return V3(w.x.at(k), w.y.at(k), w.z.at(k)); };
    CHECK(at(u) == x);
    CHECK(at(V::all(any)) == any);
    CHECK(at(u - v) == x - y);
    CHECK((at(s * u) - s.at(k) * x).norm() < tolerance);
    CHECK((at(more) - (x + s.at(k) * y)).norm() < tolerance);
    CHECK((at(less) - (x - s.at(k) * y)).norm() < tolerance);
    CHECK(std::abs(V::dot(u, v).at(k) - x.dot(y)) < tolerance);
    CHECK((at(V::cross(u, v)) - x.cross(y)).norm() < tolerance);
    CHECK((at(V::transposed_times(m, u)) - m.transpose() * x).norm() < tolerance);
    CHECK(at(V::where_greater(s, Scalar(0.7), u, v)) == (s.at(k) > Scalar(0.7) ? x : y));
  }
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
    tensegrity::add_columns(columns, 3, 9, 5, 0.7, 8);
    P expected = p;
    expected.block<20, 5>(8, 3) += 0.7 * p.block<20, 5>(8, 9);
    CHECK((columns - expected).norm() < 1e-14);

    tensegrity::mirror(p, 0, size);
    CHECK((p - p.transpose()).norm() == 0);
    for (const int count : {0, 1, 3, 4, 9, 12}) {
      Matrix<double, 28, 12> w = Matrix<double, 28, 12>::Random();
      w.bottomRows(28 - size).setZero();
      P reduced = p;
      tensegrity::subtract_outer(reduced, w, count, size);
      const Eigen::MatrixXd used = w.leftCols(count);
      tensegrity::mirror(reduced, 0, 8);
      CHECK(reduced.topLeftCorner<8, 8>() == reduced.topLeftCorner<8, 8>().transpose());
      tensegrity::mirror(reduced, 8, size);
      CHECK((reduced - (p - used * used.transpose())).norm() < 1e-13);
    }
  }
}
