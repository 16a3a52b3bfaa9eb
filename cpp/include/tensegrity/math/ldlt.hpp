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
    for (int j = 0; j < N; ++j) {
      for (int i = j; i < N; ++i) l_(i, j) = a(i, j);
    }
    for (int j = 0; j < N; ++j) {
      const Scalar pivot = l_(j, j);
      if (!(pivot > 0) || !std::isfinite(pivot)) return false;
      inverse_[j] = 1 / pivot;
      Column column = inverse_[j] * l_.col(j);
      for (int i = 0; i <= j; ++i) column[i] = 0;
      for (int k = j + 1; k < N; ++k) l_.col(k) -= l_(k, j) * column;
      l_.col(j) = column;
    }
    return true;
  }

  // L^-1 b
  Vector<Scalar, N> forward(const Vector<Scalar, N>& b) const {
    Column x = Column::Zero();
    x.template head<N>() = b;
    for (int j = 0; j < N; ++j) x -= x[j] * l_.col(j);
    return x.template head<N>();
  }

  // A^-1 b
  Vector<Scalar, N> solve(const Vector<Scalar, N>& b) const {
    Vector<Scalar, N> x = forward(b).cwiseProduct(inverse_);
    for (int j = N - 1; j >= 0; --j) {
      for (int i = j + 1; i < N; ++i) x[j] -= l_(i, j) * x[i];
    }
    return x;
  }

  // L without its diagonal.
  Scalar l(int row, int column) const { return l_(row, column); }
  // 1 / D
  const Vector<Scalar, N>& inverse_diagonal() const { return inverse_; }

 private:
  using Column = Vector<Scalar, padded(N)>;

  Matrix<Scalar, padded(N), N> l_ = Matrix<Scalar, padded(N), N>::Zero();  // whole packets
  Vector<Scalar, N> inverse_;
};

}  // namespace tensegrity
