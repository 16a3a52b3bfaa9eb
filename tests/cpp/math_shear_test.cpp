// The congruence by a shear against dense products, with nothing but a lower triangle to read.
#include "tensegrity/math/shear.hpp"

#include <doctest/doctest.h>

#include <limits>

namespace {

using tensegrity::Matrix;
using tensegrity::padded;
using tensegrity::Shear;

// P of `size` states, of which `begin` to `end` see three errors from `source` on.
template <typename Scalar>
void check(int source, int begin, int end, int size, Scalar tolerance) {
  constexpr int kRows = 36;
  using Dense = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  const Dense root = Dense::Random(size, size);
  const Dense p = root.lazyProduct(root.transpose());
  const Scalar noise = Scalar(0.7);

  Shear<Scalar, kRows> shear(source, noise);
  Dense b = Dense::Zero(size, 3);
  shear.clear(tensegrity::packet_start(begin), padded(end));
  for (int at = begin; at < end; at += 3) {
    const Dense m = Dense::Random(3, 3);
    b.middleRows(at, 3) = m;
    shear.set(at, tensegrity::to_block(Matrix<Scalar, 3>(m)));
  }
  Dense f = Dense::Identity(size, size);
  f.middleCols(source, 3) += b;
  const Dense expected =
      f.lazyProduct(p).lazyProduct(f.transpose()) + noise * b.lazyProduct(b.transpose());

  Matrix<Scalar, kRows> lower = Matrix<Scalar, kRows>::Zero();
  lower.topLeftCorner(size, size) = p;
  for (int j = 0; j < size; ++j) {
    lower.col(j).head(j).setConstant(std::numeric_limits<Scalar>::quiet_NaN());
  }
  shear.apply(lower, begin, end, padded(size));
  Scalar worst = 0;
  for (int j = 0; j < size; ++j) {
    const Scalar error =
        (lower.col(j).segment(j, size - j) - expected.col(j).tail(size - j)).cwiseAbs().maxCoeff();
    worst = error <= worst ? worst : error;  // NaN stays
  }
  CHECK(worst < tolerance * expected.norm());
  CHECK(lower.bottomRows(kRows - size).isZero(0));
}

}  // namespace

TEST_CASE("shear: F P F' from the lower triangle") {
  for (int trial = 0; trial < 5; ++trial) {
    for (const int source : {0, 3, 4, 6}) {
      for (int begin = source + 3; begin < source + 8; ++begin) {
        for (const int blocks : {1, 2, 3, 5}) {
          for (const int after : {0, 1, 4, 5}) {
            const int end = begin + 3 * blocks;
            if (end + after >= 36) continue;
            check<double>(source, begin, end, end + after, 1e-15);
            check<float>(source, begin, end, end + after, 1e-6F);
          }
        }
      }
    }
  }
}
