// The correction by all feet of one instant together.
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "tensegrity/tight/foot_rows.hpp"
#include "tensegrity/tight/waiting_rows.hpp"

namespace tensegrity::tight {

// Measurements residual = H e + n with var(n) = variance > 0, and the part in [0, 1] of each row's
// downdate of P that is applied, given the rows before it: 1 for a Gaussian measurement, less where
// the mean moves more than the data inform (friction.hpp).
template <typename Scalar>
class FeetUpdate {
 public:
  using B = Belief<Scalar>;
  using P = Packet<Scalar>;
  static constexpr int kFeet = kMostFeet;

  // To be filled: the rows of every foot, and for each of their four rows a number for every foot.
  FootRows<Scalar>* rows() { return rows_; }
  void set_residuals(const P& across, const P& along, const P& rise, const P& height) {
    store_by_foot(across, along, rise, height, right_);
  }
  void set_variances(const P& across, const P& along, const P& rise, const P& height) {
    store_by_foot(across, along, rise, height, variance_);
  }
  void set_information(const P& across, const P& along, const P& rise, const P& height) {
    store_by_foot(across, along, rise, height, waiting_.information);
  }

  // What has been filled in for a foot says nothing.
  void silence(int foot) {
    rows_[foot].clear();
    std::fill(right_ + 4 * foot, right_ + 4 * foot + 4, Scalar(0));
    std::fill(variance_ + 4 * foot, variance_ + 4 * foot + 4, Scalar(1));
  }

  // With the first `count` of the feet; uses up what was filled in. False, and nothing happened, if
  // that or P is not finite. P is symmetric (belief.hpp), and stays so.
  bool apply(B& belief, int count) {
    for (int f = 0; f < count; ++f) rows_[f].cross(belief.covariance, waiting_.cross(4 * f));
    for (int f = 0; f < count; ++f) {
      for (int k = 0; k < 4 * (f + 1); k += 4) {
        P seen[4];
        rows_[f].times(waiting_.cross(k), seen, B::Dim);
        for (int c = 0; c < 4; ++c) seen[c].store(&waiting_.g(4 * f, k + c));
      }
    }
    // What is computed along with rows that are not used: of anything it might take long.
    for (int k = 0; k < 4 * count; ++k) {
      Scalar* column = &waiting_.g(0, k);
      set_zero(column + 4 * count, column + kRows);
    }
    eliminate_from<0>(4 * count);
    P chi_squares;
    for (int f = 0; f < count; ++f) {
      const P y = scale(4 * f);
      chi_squares = chi_squares + y * y;
    }
    if (!std::isfinite(P::dot(chi_squares, P::all(1)) + chi_squares.at(3))) return false;

    typename B::ErrorVector error;
    set_zero(error.data(), error.data() + B::Dim);
    waiting_.whiten(4 * count, error);
    belief.retract(error);
    waiting_.downdate(belief.covariance, 4 * count);
    return true;
  }
  // After `apply`: a row's part of the chi-square, given the rows before it.
  Scalar chi_square(int row) const { return right_[row] * right_[row] * inverse_[row]; }

 private:
  static constexpr int kRows = 4 * kFeet;
  static_assert(kRows == WaitingRows<Scalar>::kCapacity);

  static void store_by_foot(P across, P along, P rise, P height, Scalar* out) {
    static_assert(kFeet == 3);
    P::transpose(across, along, rise, height);
    across.store(out), along.store(out + 4), rise.store(out + 8);
  }

  // S + N = L D L', in G's place: columns of L D for those of S, and in that of the residual
  // L^-1 z. With columns in registers there is code for every column, else, where code has to be
  // small, for all.
  template <int First>
  void eliminate_from(int count) {
    if constexpr (P::kSimd) {
      eliminate<packet_start(First)>(std::integral_constant<int, First>());
      if constexpr (First + 1 < kRows) {
        if (First % 4 < 3 || First + 1 < count) eliminate_from<First + 1>(count);
      }
    } else {
      for (int j = 0; j < count; ++j) eliminate<0>(j);
    }
  }
  // A column, in its rows from `From` on. The chain from pivot to pivot is what takes the time: it
  // is of scalars.
  template <int From, typename Index>
  void eliminate(Index column) {
    const int j = column;
    auto& ld = waiting_.g;
    P rest[(kRows - From) / 4];
#pragma GCC unroll 3
    for (int i = From; i < kRows; i += 4) rest[(i - From) / 4] = P(&ld(i, j));
    Scalar pivot = ld(j, j) + variance_[j], right = right_[j];
    const auto take = [&](int k) {
      const Scalar seen = ld(j, k), factor = seen * inverse_[k];
      pivot -= factor * seen;
      right -= factor * right_[k];
#pragma GCC unroll 3
      for (int i = From; i < kRows; i += 4) {
        rest[(i - From) / 4].subtract(factor, P(&ld(i, k)));
      }
    };
    if constexpr (P::kSimd) {
#pragma GCC unroll 12
      for (int k = 0; k < j; ++k) take(k);
    } else {
#pragma GCC unroll 1
      for (int k = 0; k < j; ++k) take(k);
    }
    inverse_[j] = 1 / std::max(pivot, variance_[j]);  // rounding may have left less
    right_[j] = right;
#pragma GCC unroll 3
    for (int i = From; i < kRows; i += 4) rest[(i - From) / 4].store(&ld(i, j));
  }

  // Of the foot whose rows start at `j`: its columns of G, 1 / the diagonal of G, and y = G^-1 z.
  P scale(int j) {
    const P root = P::sqrt(P(inverse_ + j));
    root.store(waiting_.inverse + j);
    const P y = root * P(right_ + j);
    y.store(waiting_.y + j);
#pragma GCC unroll 4
    for (int k = j; k < j + 4; ++k) {
#pragma GCC unroll 3
      for (int i = 0; i < kRows; i += 4) {
        (waiting_.inverse[k] * P(&waiting_.g(i, k))).store(&waiting_.g(i, k));
      }
    }
    return y;
  }

  FootRows<Scalar> rows_[kFeet];
  WaitingRows<Scalar> waiting_;
  alignas(4 * sizeof(Scalar)) Scalar right_[kRows], variance_[kRows], inverse_[kRows];
};

}  // namespace tensegrity::tight
