// L D L' factors of small symmetric matrices of fixed size.
//
// Eigen's LDLT and LLT go through code for any size; at ten rows that takes several times as long
// as the arithmetic.
#pragma once

#include <cmath>

#include "tensegrity/math/symmetric.hpp"

namespace tensegrity {

// A = L D L' with a unit lower triangular L. Reads the lower triangle of A.
template <typename Scalar, int N>
class Ldlt {
 public:
  // False unless A is positive definite (to rounding) and finite.
  bool factor(const Matrix<Scalar, N>& a) {
    for (int j = 0; j < N; ++j) {  // whole packets from the one on the diagonal on
      for (int i = packet_start(j); i < j; ++i) l_(i, j) = 0;
      for (int i = j; i < N; ++i) l_(i, j) = a(i, j);
      for (int i = N; i < kRows; ++i) l_(i, j) = 0;
    }
    return factor_from<0>();
  }

  // L^-1 b
  Vector<Scalar, N> forward(const Vector<Scalar, N>& b) const {
    Column x = Column::Zero();
    x.template head<N>() = b;
    for (int j = 0; j < N; ++j) {
      const Scalar factor = x[j];
      for (int i = packet_start(j); i < kRows; i += 4) {
        Packet<Scalar> rest(&x[i]);
        rest.subtract(factor, Packet<Scalar>(&l_(i, j)));
        rest.store(&x[i]);
      }
    }
    return x.template head<N>();
  }

  // A^-1 b
  Vector<Scalar, N> solve(const Vector<Scalar, N>& b) const {
    Vector<Scalar, N> x = forward(b).cwiseProduct(inverse_);
    // Unrolled, and what was found last comes last: the chain of dependent operations is short.
#pragma GCC unroll 16
    for (int j = N - 1; j >= 0; --j) {
#pragma GCC unroll 16
      for (int i = N - 1; i > j; --i) x[j] -= l_(i, j) * x[i];
    }
    return x;
  }

  // L without its diagonal.
  Scalar l(int row, int column) const { return l_(row, column); }
  // 1 / D
  const Vector<Scalar, N>& inverse_diagonal() const { return inverse_; }

 private:
  static constexpr int kRows = padded(N);  // whole packets
  using Column = Vector<Scalar, kRows>;

  // Four columns from `First` on, and those after them. A column of A less what the columns before
  // it hold of it is d times that of L.
  template <int First>
  bool factor_from() {
    constexpr int kPackets = (kRows - First) / 4;
    for (int j = First; j < std::min(First + 4, N); ++j) {
      Packet<Scalar> rest[kPackets];
#pragma GCC unroll 5
      for (int i = 0; i < kPackets; ++i) rest[i] = Packet<Scalar>(&l_(First + 4 * i, j));
      for (int k = 0; k < j; ++k) {
        const Scalar factor = l_(j, k) * pivots_[k];
#pragma GCC unroll 5
        for (int i = 0; i < kPackets; ++i) {
          rest[i].subtract(factor, Packet<Scalar>(&l_(First + 4 * i, k)));
        }
      }
      rest[0].store(&l_(First, j));
      const Scalar pivot = l_(j, j);
      if (!(pivot > 0) || !std::isfinite(pivot)) return false;
      pivots_[j] = pivot;
      inverse_[j] = 1 / pivot;
#pragma GCC unroll 5
      for (int i = 0; i < kPackets; ++i) {
        Packet<Scalar> column;
        column.add(inverse_[j], rest[i]);
        column.store(&l_(First + 4 * i, j));
      }
      for (int i = 0; i < 4; ++i) {
        if (First + i <= j) l_(First + i, j) = 0;
      }
    }
    if constexpr (First + 4 < N) return factor_from<First + 4>();
    return true;
  }

  Matrix<Scalar, kRows, N> l_;          // not set above the packets on the diagonal
  Vector<Scalar, N> pivots_, inverse_;  // D, 1 / D
};

}  // namespace tensegrity
