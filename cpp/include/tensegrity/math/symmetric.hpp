// What a filter does to its covariance all day, written for the columns of a matrix in memory.
//
// A covariance is stored in full, so that any of its columns can be read at once. Loops run over
// whole packets of four rows: matrices here have a multiple of four rows (`padded`), and are zero
// beyond their active size.
#pragma once

#include "tensegrity/types.hpp"

namespace tensegrity {

// The next multiple of four.
constexpr int padded(int size) { return (size + 3) / 4 * 4; }
// The packet of four that `row` is in starts here.
constexpr int packet_start(int row) { return row / 4 * 4; }

// Four rows of a column.
template <typename Scalar>
using Packet = Eigen::Array<Scalar, 4, 1>;
template <typename Scalar>
auto packet(Scalar* rows) {
  return Eigen::Map<Packet<Scalar>>(rows);
}
template <typename Scalar>
Packet<Scalar> packet(const Scalar* rows) {
  return Eigen::Map<const Packet<Scalar>>(rows);
}

// Columns `to` .. `to + 2` of P get those of `from` times m': P <- P (I + m at rows `to`, columns
// `from`)'. The first `rows` rows.
template <typename Derived>
void add_columns(Eigen::MatrixBase<Derived>& p, int to, int from,
                 const Matrix3<typename Derived::Scalar>& m, int rows) {
  using Scalar = typename Derived::Scalar;
  constexpr int kStride = Derived::RowsAtCompileTime;
  Scalar* target = &p.derived().coeffRef(0, to);
  const Scalar* source = &p.derived().coeffRef(0, from);
  const Matrix3<Scalar> c = m;         // not in memory that the loop may write to
  for (int i = 0; i < rows; i += 4) {  // what is loaded is used thrice
    const Packet<Scalar> a0 = packet(source + i), a1 = packet(source + i + kStride),
                         a2 = packet(source + i + 2 * kStride);
    packet(target + i) += c(0, 0) * a0 + c(0, 1) * a1 + c(0, 2) * a2;
    packet(target + i + kStride) += c(1, 0) * a0 + c(1, 1) * a1 + c(1, 2) * a2;
    packet(target + i + 2 * kStride) += c(2, 0) * a0 + c(2, 1) * a1 + c(2, 2) * a2;
  }
}

// Copies the lower triangle of the first `size` rows and columns to the upper one.
template <typename Derived>
void mirror(Eigen::MatrixBase<Derived>& p, int size) {
  static_assert(Derived::RowsAtCompileTime % 4 == 0, "whole packets");
  for (int j = 0; j < size; j += 4) {
    for (int c = j + 1; c < j + 4; ++c) {
      for (int r = j; r < c; ++r) p(r, c) = p(c, r);
    }
    for (int i = j + 4; i < size; i += 4) {
      for (int c = i; c < i + 4; ++c) {
        packet(&p(j, c)) =
            Packet<typename Derived::Scalar>(p(c, j), p(c, j + 1), p(c, j + 2), p(c, j + 3));
      }
    }
  }
}

// P <- P - W W' with the first `count` columns of W, on the first `size` rows and columns. Every
// pair of elements across the diagonal is the same sum of the same products: P stays symmetric.
template <typename P, typename W>
void subtract_outer(Eigen::MatrixBase<P>& p, const Eigen::MatrixBase<W>& w, int count, int size) {
  using Scalar = typename P::Scalar;
  constexpr int kRows = W::RowsAtCompileTime, kStride = P::RowsAtCompileTime;
  int k = 0;
  for (; k + 4 <= count; k += 4) {  // two columns of P against four of W: loads are used twice
    const Scalar* g = &w.derived().coeffRef(0, k);
    for (int j = 0; j < size; j += 2) {
      const Scalar a0 = g[j], a1 = g[j + kRows], a2 = g[j + 2 * kRows], a3 = g[j + 3 * kRows];
      const Scalar b0 = g[j + 1], b1 = g[j + 1 + kRows], b2 = g[j + 1 + 2 * kRows],
                   b3 = g[j + 1 + 3 * kRows];
      Scalar* column = &p.derived().coeffRef(0, j);
      for (int i = 0; i < size; i += 4) {
        const Packet<Scalar> g0 = packet(g + i), g1 = packet(g + i + kRows),
                             g2 = packet(g + i + 2 * kRows), g3 = packet(g + i + 3 * kRows);
        packet(column + i) -= a0 * g0 + a1 * g1 + a2 * g2 + a3 * g3;
        packet(column + i + kStride) -= b0 * g0 + b1 * g1 + b2 * g2 + b3 * g3;
      }
    }
  }
  for (; k < count; ++k) {
    const Scalar* g = &w.derived().coeffRef(0, k);
    for (int j = 0; j < size; ++j) {
      Scalar* column = &p.derived().coeffRef(0, j);
      for (int i = 0; i < size; i += 4) packet(column + i) -= g[j] * packet(g + i);
    }
  }
}

}  // namespace tensegrity
