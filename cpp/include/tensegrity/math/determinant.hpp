// Determinant of small matrices of fixed size with its derivative, singular matrices included.
//
// Eigen's decompositions go through code for any size, which takes several times as long as the
// arithmetic and refers to the heap.
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include "tensegrity/math/symmetric.hpp"

namespace tensegrity {

// Gauss-Jordan elimination in place with complete pivoting, all but the last pivot: with rows and
// columns in the order of their pivots,
//   A = [A1 b; c' d]  becomes  [A1^-1, -A1^-1 b; c' A1^-1, p],  p = d - c' A1^-1 b,
// and det(A) = +-det(A1) p. Of a matrix whose rank deficiency is one only p vanishes: A1 is as
// regular as can be. Precondition: A is finite.
template <typename Scalar, int N>
class Determinant {
 public:
  explicit Determinant(const Matrix<Scalar, N>& a) {
    tableau_.template topRows<N>() = a;
    for (int k = 0; k < N; ++k) rows_[index(k)] = columns_[index(k)] = k;
    for (int k = 0; k < N - 1; ++k) {
      choose_pivot(k);
      const Scalar pivot = at(k, k);
      leading_ *= pivot;
      if (pivot == 0) return;  // nothing is left but zeros
      exchange(rows_[index(k)], columns_[index(k)], 1 / pivot);
    }
  }

  Scalar value() const { return leading_ * last(); }

  // Matrix of cofactors, d det(A) / dA: det(A1) (p [A1^-T 0; 0 0] + y z') in the order of the
  // pivots, with y = (-A1^-T c, 1) and z = (-A1^-1 b, 1), the null vectors when p is zero. Zero
  // when the rank deficiency is more than one.
  Matrix<Scalar, N> cofactors() const {
    constexpr int n = N - 1;
    Matrix<Scalar, N> out = Matrix<Scalar, N>::Zero();
    if (leading_ == 0) return out;
    const Scalar scaled = leading_ * last();
    for (int i = 0; i < N; ++i) {
      const Scalar y = i < n ? -leading_ * at(n, i) : leading_;
      for (int j = 0; j < n; ++j) {
        Scalar& element = out(rows_[index(i)], columns_[index(j)]);
        element = y * at(j, n);
        if (i < n) element += scaled * at(j, i);
      }
      out(rows_[index(i)], columns_[index(n)]) = y;
    }
    return out;
  }

 private:
  using Column = Vector<Scalar, padded(N)>;  // whole packets

  static constexpr std::size_t index(int k) { return static_cast<std::size_t>(k); }

  // Elements in the order of the pivots.
  Scalar at(int row, int column) const {
    return tableau_(rows_[index(row)], columns_[index(column)]);
  }
  Scalar last() const { return at(N - 1, N - 1); }

  // Puts the row and the column of the largest element that is left next.
  void choose_pivot(int k) {
    Column largest = Column::Zero();  // of each row
    for (int j = k; j < N; ++j) {
      largest = largest.cwiseMax(tableau_.col(columns_[index(j)]).cwiseAbs());
    }
    int row = k, column = k;
    for (int i = k + 1; i < N; ++i) {
      if (largest[rows_[index(i)]] > largest[rows_[index(row)]]) row = i;
    }
    for (int j = k + 1; j < N; ++j) {
      if (std::abs(at(row, j)) > std::abs(at(row, column))) column = j;
    }
    if (row != k) leading_ = -leading_;
    if (column != k) leading_ = -leading_;
    std::swap(rows_[index(row)], rows_[index(k)]);
    std::swap(columns_[index(column)], columns_[index(k)]);
  }

  // With y = T x: solves row `row` for the unknown of `column` and puts it into the other rows.
  void exchange(int row, int column, Scalar inverse) {
    Column multipliers = tableau_.col(column);
    multipliers[row] = 0;
    for (int j = 0; j < N; ++j) {
      const Scalar share = inverse * tableau_(row, j);
      tableau_.col(j) -= share * multipliers;
      tableau_(row, j) = -share;
    }
    tableau_.col(column) = inverse * multipliers;
    tableau_(row, column) = inverse;
  }

  Matrix<Scalar, padded(N), N> tableau_ = Matrix<Scalar, padded(N), N>::Zero();
  std::array<int, N> rows_, columns_;  // in the order of their pivots
  Scalar leading_ = 1;                 // det(A1), with the sign of both orders
};

}  // namespace tensegrity
