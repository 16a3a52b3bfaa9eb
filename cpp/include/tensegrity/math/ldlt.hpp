// Elimination in small symmetric systems of fixed size: A = L D L' together with what stands below.
//
// Eigen's LDLT and LLT go through code for any size; at ten rows that takes several times as long
// as the arithmetic. What a filter or a solver needs of A are products with L^-1, and those are the
// same elimination continued below A:
//
//   [ A  ]        [ L  ]
//   [ b' ]   ->   [ y' ] D,   y = (L D)^-1 b,   W = B (L D)^-T.
//   [ B  ]        [ W  ]
#pragma once

#include <algorithm>
#include <cmath>

#include "tensegrity/math/symmetric.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity {

template <typename Scalar, int N, int Below = 0>
class Ldlt {
 public:
  // Where a column holds b and B. B has `Below` rows, a multiple of four.
  static constexpr int kRight = N;
  static constexpr int kBelow = padded(N + 1);
  static constexpr int kRows = kBelow + Below;

  // To be filled before `factor`: of A the lower triangle, b if `solve` or `y` is to be called.
  // What is above the diagonal does not matter.
  Scalar* column(int j) { return &columns_(0, j); }
  Columns<Scalar, kRows> columns() { return {column(0)}; }
  auto matrix() { return columns_.template topRows<N>(); }
  auto below() { return columns_.template bottomRows<Below>(); }
  void set_right(const Vector<Scalar, N>& b) {
    for (int j = 0; j < N; ++j) {
      columns_(kRight, j) = b[j];
      for (int i = kRight + 1; i < kBelow; ++i) columns_(i, j) = 0;
    }
  }

  // False unless A is positive definite (to rounding) and finite.
  bool factor() { return factor_from<0>(); }

  // After `factor`; columns hold L D, y D and W D of the head of this file.
  const Vector<Scalar, N>& inverse_diagonal() const { return inverse_; }
  Scalar yd(int j) const { return columns_(kRight, j); }          // L^-1 b
  const Scalar* wd(int j) const { return &columns_(kBelow, j); }  // B L^-T, column j

  // A^-1 b
  Vector<Scalar, N> solve() const {
    Vector<Scalar, N> x;
    // Unrolled, and what was found last comes last: the chain of dependent operations is short.
#pragma GCC unroll 16
    for (int j = N - 1; j >= 0; --j) {
      Scalar rest = yd(j);
#pragma GCC unroll 16
      for (int i = N - 1; i > j; --i) rest -= columns_(i, j) * x[i];
      x[j] = rest * inverse_[j];
    }
    return x;
  }

  // The same for another b, with the factors there are.
  Vector<Scalar, N> solve(const Vector<Scalar, N>& b) {
#pragma GCC unroll 16
    for (int j = 0; j < N; ++j) {
      Scalar rest = b[j];
#pragma GCC unroll 16
      for (int k = 0; k < j; ++k) rest -= columns_(j, k) * (yd(k) * inverse_[k]);
      columns_(kRight, j) = rest;
    }
    return solve();
  }

  // B becomes B A^-1.
  void solve_below() {
    for (int j = N - 1; j >= 0; --j) {
      for (int r = kBelow; r < kRows; r += 4) {
        Packet<Scalar> rest(&columns_(r, j));
        for (int i = j + 1; i < N; ++i) {
          rest.subtract(columns_(i, j), Packet<Scalar>(&columns_(r, i)));
        }
        Packet<Scalar> solved;
        solved.add(inverse_[j], rest);
        solved.store(&columns_(r, j));
      }
    }
  }

 private:
  static_assert(Below % 4 == 0, "whole packets");

  // With columns in registers there is code for every column, in small systems for every step of
  // it, else, where code has to be small, for four together.
  static constexpr int kTogether = Packet<Scalar>::kSimd ? 1 : 4;
  static constexpr bool kUnrolled = Packet<Scalar>::kSimd && kRows <= 12;

  // Columns from `First` on.
  template <int First>
  bool factor_from() {
    for (int j = First; j < std::min(First + kTogether, N); ++j) {
      const Scalar pivot = reduce<First / 4>(j);
      if (!(pivot > 0) || !std::isfinite(pivot)) return false;
      inverse_[j] = 1 / pivot;
    }
    if constexpr (First + kTogether < N) return factor_from<First + kTogether>();
    return true;
  }

  // Column j less what the columns before it hold of it, from packet `From` on; returns its pivot.
  // The chain from pivot to pivot is what takes the time; all that is below fits into its pauses.
  template <int From>
  Scalar reduce(int j) {
    constexpr int kHere = std::min(kRows / 4 - From, Packet<Scalar>::kHeld);
    Scalar* column = &columns_(4 * From, j);
    Packet<Scalar> rest[kHere];
#pragma GCC unroll 12
    for (int i = 0; i < kHere; ++i) rest[i] = Packet<Scalar>(column + 4 * i);
    // By itself: the next division would wait longer for its place in a packet.
    Scalar pivot = columns_(j, j);
    const auto take = [&](int k) {
      const Scalar factor = columns_(j, k) * inverse_[k];
      pivot -= factor * columns_(j, k);
      const Scalar* before = &columns_(4 * From, k);
#pragma GCC unroll 12
      for (int i = 0; i < kHere; ++i) rest[i].subtract(factor, Packet<Scalar>(before + 4 * i));
    };
    if constexpr (kUnrolled) {
#pragma GCC unroll 12
      for (int k = 0; k < j; ++k) take(k);
    } else {
#pragma GCC unroll 1
      for (int k = 0; k < j; ++k) take(k);
    }
#pragma GCC unroll 12
    for (int i = 0; i < kHere; ++i) rest[i].store(column + 4 * i);
    if constexpr (From + kHere < kRows / 4) reduce<From + kHere>(j);
    return pivot;
  }

  Matrix<Scalar, kRows, N> columns_;
  Vector<Scalar, N> inverse_;  // 1 / D
};

}  // namespace tensegrity
