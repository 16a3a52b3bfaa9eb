// The correction by all feet of one instant together.
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "tensegrity/tight/foot_rows.hpp"
#include "tensegrity/tight/waiting_rows.hpp"

namespace tensegrity::tight {

// Measurements residual = H e + n with var(n) = variance > 0, and the part in (0, 1] of each row's
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
    store_by_foot(across, along, rise, height, information_);
  }

  // What has been filled in for a foot says nothing.
  void silence(int foot) {
    rows_[foot].clear();
    std::fill(right_ + 4 * foot, right_ + 4 * foot + 4, Scalar(0));
    std::fill(variance_ + 4 * foot, variance_ + 4 * foot + 4, Scalar(1));
    std::fill(information_ + 4 * foot, information_ + 4 * foot + 4, Scalar(1));
  }

  // With the first `count` of the feet; uses up what was filled in. False, and nothing happened, if
  // that or P is not finite, or a part is zero. P is symmetric (belief.hpp), and stays so.
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
    if (count < kFeet) {
      for (int k = 0; k < 4 * count; ++k) {
        Scalar* column = &waiting_.g(0, k);
        set_zero(column + 4 * count, column + kRows);
      }
    }
    eliminate_from<0>(4 * count);
    P squares;
    for (int f = 0; f < count; ++f) {
      const P y = wait(4 * f);
      squares = squares + y * y;
    }
    if (!std::isfinite(P::dot(squares, P::all(1)) + squares.at(3))) return false;

    typename B::ErrorVector error;
    set_zero(error.data(), error.data() + B::Dim);
    waiting_.whiten(4 * count, error);
    belief.retract(error);
    waiting_.downdate(belief.covariance, 4 * count);
    return true;
  }
  // After `apply`: a row's part of the chi-square, given the rows before it.
  Scalar chi_square(int row) const { return reduced_[row] * reduced_[row] * inverse_[row]; }

 private:
  static constexpr int kRows = 4 * kFeet;
  static_assert(kRows == WaitingRows<Scalar>::kCapacity);

  static void store_by_foot(P across, P along, P rise, P height, Scalar* out) {
    static_assert(kFeet == 3);
    P::transpose(across, along, rise, height);
    across.store(out), along.store(out + 4), rise.store(out + 8);
  }

  // S + N = L D L' and L^-1 z: columns of L D take the place of those of S, those of L stand beside
  // them. With columns in registers there is code for every column, else, where code has to be
  // small, for all.
  template <int First>
  void eliminate_from(int count) {
    if constexpr (P::kSimd) {
      eliminate(std::integral_constant<int, First>());
      if constexpr (First + 1 < kRows) {
        if (First % 4 < 3 || First + 1 < count) eliminate_from<First + 1>(count);
      }
    } else {
      for (int j = 0; j < count; ++j) eliminate(j);
    }
  }
  // What takes the time is the chain from pivot to pivot. It is of scalars, and of each pivot it
  // has the last subtraction only.
  template <typename Index>
  TENSEGRITY_INLINE void eliminate(Index column) {
    const int j = column;
    const int from = packet_start(j);
    auto& ld = waiting_.g;
    P rest[kRows / 4];
    const auto each = [&](const auto& packet) {
#pragma GCC unroll 3
      for (int i = from; i < kRows; i += 4) packet(rest[i / 4], i);
    };
    const auto take = [&](int k) {
      const Scalar seen = ld(j, k);
      each([&](P& x, int i) { x.subtract(seen, P(&l_(i, k))); });
    };
    each([&](P& x, int i) { x = P(&ld(i, j)); });
    if constexpr (P::kSimd) {
#pragma GCC unroll 12
      for (int k = 0; k < j - 1; ++k) take(k);
    } else {
#pragma GCC unroll 1
      for (int k = 0; k < j - 1; ++k) take(k);
    }
    Scalar pivot = rest[j / 4].at(j % 4) + variance_[j];
    if (j > 0) {
      const Scalar seen = ld(j, j - 1);
      pivot -= seen * seen * inverse_[j - 1];
      take(j - 1);
    }
    inverse_[j] = 1 / std::max(pivot, variance_[j]);  // rounding may have left less
    reduced_[j] = right_[j];
    each([&](P& x, int i) {
      x.store(&ld(i, j));
      x = inverse_[j] * x;
      x.store(&l_(i, j));
      P right(right_ + i);  // up to row j no longer used
      right.subtract(reduced_[j], x);
      right.store(right_ + i);
    });
  }

  // Of the foot whose rows start at `j`: its columns of G, 1 / the diagonal of G, and y = G^-1 z.
  // Where a part s^2 of the downdate is applied, the columns of C shall be s times as long: those
  // of G, and y, are divided by s. Returns y, which is not finite where s is zero.
  P wait(int j) {
    const P inverse(inverse_ + j), reduced(reduced_ + j);
    const P root = P::sqrt(inverse * P(information_ + j));
    const P by_root = inverse * (1 / root);
    root.store(waiting_.inverse + j);
    const P y = by_root * reduced;
    y.store(waiting_.y + j);
    alignas(4 * sizeof(Scalar)) Scalar factors[4];
    by_root.store(factors);
#pragma GCC unroll 4
    for (int k = j; k < j + 4; ++k) {
#pragma GCC unroll 3
      for (int i = j; i < kRows; i += 4) {
        (factors[k - j] * P(&waiting_.g(i, k))).store(&waiting_.g(i, k));
      }
    }
    return y;
  }

  FootRows<Scalar> rows_[kFeet];
  WaitingRows<Scalar> waiting_;
  Matrix<Scalar, kRows> l_;
  // By row: z, and less and less of it; var(n); the part that is applied; 1 / D; L^-1 z.
  alignas(4 * sizeof(Scalar)) Scalar right_[kRows], variance_[kRows],
      information_[kRows], inverse_[kRows], reduced_[kRows];
};

}  // namespace tensegrity::tight
