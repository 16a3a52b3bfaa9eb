// What a filter does to its covariance all day, written for the columns of a matrix in memory.
//
// A covariance is stored in full, so that any of its columns can be read at once, but computed in
// its lower triangle. Loops run over whole packets of four rows: matrices here have a multiple of
// four rows (`padded`), and are zero beyond their active size.
#pragma once

#include "tensegrity/math/packet.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity {

// Columns `to` .. `to + 2` of P get those of `from` times m': P <- P (I + m at rows `to`, columns
// `from`)'. Rows `first` (a multiple of four) to `end`.
template <typename Derived>
void add_columns(Eigen::MatrixBase<Derived>& p, int to, int from,
                 const Matrix3<typename Derived::Scalar>& m, int first, int end) {
  using Scalar = typename Derived::Scalar;
  constexpr int kStride = Derived::RowsAtCompileTime;
  Scalar* target = &p.derived().coeffRef(0, to);
  const Scalar* source = &p.derived().coeffRef(0, from);
  const Matrix3<Scalar> c = m;            // not in memory that the loop may write to
  for (int i = first; i < end; i += 4) {  // what is loaded is used thrice
    const Packet<Scalar> a0(source + i), a1(source + i + kStride), a2(source + i + 2 * kStride);
    for (int k = 0; k < 3; ++k) {
      Packet<Scalar> x(target + i + k * kStride);
      x.add(c(k, 0), a0);
      x.add(c(k, 1), a1);
      x.add(c(k, 2), a2);
      x.store(target + i + k * kStride);
    }
  }
}

// The same with m = factor I, all rows up to `end`.
template <typename Derived>
void add_columns(Eigen::MatrixBase<Derived>& p, int to, int from, typename Derived::Scalar factor,
                 int end) {
  using Scalar = typename Derived::Scalar;
  for (int k = 0; k < 3; ++k) {
    Scalar* target = &p.derived().coeffRef(0, to + k);
    const Scalar* source = &p.derived().coeffRef(0, from + k);
    for (int i = 0; i < end; i += 4) {
      Packet<Scalar> x(target + i);
      x.add(factor, Packet<Scalar>(source + i));
      x.store(target + i);
    }
  }
}

// Copies the lower triangle of the first `size` rows and columns to the upper one.
template <typename Derived>
void mirror(Eigen::MatrixBase<Derived>& matrix, int size) {
  static_assert(Derived::RowsAtCompileTime % 4 == 0, "whole packets");
  using Scalar = typename Derived::Scalar;
  constexpr int kStride = Derived::RowsAtCompileTime;
  Scalar* p = &matrix.derived().coeffRef(0, 0);
  for (int j = 0; j < size; j += 4) {
    Scalar* own = p + j * kStride + j;  // block on the diagonal
    for (int c = 1; c < 4; ++c) {
      for (int r = 0; r < c; ++r) own[c * kStride + r] = own[r * kStride + c];
    }
    for (int i = j + 4; i < size; i += 4) {
      Packet<Scalar> block[4];
      const Scalar* lower = p + j * kStride + i;
      Scalar* upper = p + i * kStride + j;
#pragma GCC unroll 4
      for (int c = 0; c < 4; ++c) block[c] = Packet<Scalar>(lower + c * kStride);
      Packet<Scalar>::transpose(block);
#pragma GCC unroll 4
      for (int c = 0; c < 4; ++c) block[c].store(upper + c * kStride);
    }
  }
}

// sum a_i x_i of columns x_i of `Rows` rows in memory, up to `Capacity` of them.
template <typename Scalar, int Rows, int Capacity>
class Sum {
 public:
  static_assert(Rows % 4 == 0, "whole packets");

  void add(Scalar factor, const Scalar* column) {
    factors_[count_] = factor;
    columns_[count_++] = column;
  }
  void store(Scalar* out) const { store_from<0>(out); }

 private:
  // So many sums at once that none waits for its last addition, and all stay in registers.
  static constexpr int kMost = Packet<Scalar>::kHeld - 1;
  static constexpr int kPackets = Rows / 4;
  static constexpr int kGroup = (kPackets + (kPackets - 1) / kMost) / ((kPackets - 1) / kMost + 1);

  template <int First>
  void store_from(Scalar* out) const {
    constexpr int kHere = std::min(kGroup, kPackets - First);
    Packet<Scalar> sum[kHere];
    for (int k = 0; k < count_; ++k) {
#pragma GCC unroll 7
      for (int i = 0; i < kHere; ++i) {
        sum[i].add(factors_[k], Packet<Scalar>(columns_[k] + 4 * (First + i)));
      }
    }
#pragma GCC unroll 7
    for (int i = 0; i < kHere; ++i) sum[i].store(out + 4 * (First + i));
    if constexpr (First + kHere < kPackets) store_from<First + kHere>(out);
  }

  Scalar factors_[Capacity];
  const Scalar* columns_[Capacity];
  int count_ = 0;
};

namespace detail {

// Four columns of P, `Packets` packets of rows: P <- P +- A B with `count` columns of A and rows of
// B. What is loaded of A is used in every column, what is loaded of B in every packet, and the tile
// stays in registers.
template <int Packets, bool Subtract, typename Scalar>
void add_product_tile(Scalar* p, int p_stride, const Scalar* a, int a_stride, const Scalar* b,
                      int b_stride, int count) {
  Packet<Scalar> tile[4][Packets];
#pragma GCC unroll 4
  for (int c = 0; c < 4; ++c) {
#pragma GCC unroll 3
    for (int k = 0; k < Packets; ++k) tile[c][k] = Packet<Scalar>(p + c * p_stride + 4 * k);
  }
  for (const Scalar* end = a + count * a_stride; a != end; a += a_stride, b += b_stride) {
    Packet<Scalar> rows[Packets];
#pragma GCC unroll 3
    for (int k = 0; k < Packets; ++k) {
      rows[k] = Packet<Scalar>(a + 4 * k);
      rows[k].hold();
    }
#pragma GCC unroll 4
    for (int c = 0; c < 4; ++c) {
#pragma GCC unroll 3
      for (int k = 0; k < Packets; ++k) {
        if constexpr (Subtract) {
          tile[c][k].subtract(b[c], rows[k]);
        } else {
          tile[c][k].add(b[c], rows[k]);
        }
      }
    }
  }
#pragma GCC unroll 4
  for (int c = 0; c < 4; ++c) {
#pragma GCC unroll 3
    for (int k = 0; k < Packets; ++k) tile[c][k].store(p + c * p_stride + 4 * k);
  }
}

}  // namespace detail

// The same for rows `first` to `end` (multiples of four) of P and A.
template <bool Subtract, typename Scalar>
void add_product(Scalar* p, int p_stride, const Scalar* a, int a_stride, const Scalar* b,
                 int b_stride, int count, int first, int end) {
  int i = first;
  if constexpr (Packet<Scalar>::kHeld >= 8 * Packet<Scalar>::kRegisters) {
    for (; i + 8 <= end; i += 8) {
      detail::add_product_tile<2, Subtract>(p + i, p_stride, a + i, a_stride, b, b_stride, count);
    }
  }
  for (; i < end; i += 4) {
    detail::add_product_tile<1, Subtract>(p + i, p_stride, a + i, a_stride, b, b_stride, count);
  }
}

// P <- P - W W' with the first `count` columns of W, on the first `size` rows and columns.
template <typename P, typename W>
void subtract_outer(Eigen::MatrixBase<P>& p, const Eigen::MatrixBase<W>& w, int count, int size) {
  static_assert(P::RowsAtCompileTime % 4 == 0 && W::RowsAtCompileTime % 4 == 0, "whole packets");
  constexpr int kRows = W::RowsAtCompileTime, kStride = P::RowsAtCompileTime;
  auto* to = &p.derived().coeffRef(0, 0);
  const auto* from = &w.derived().coeffRef(0, 0);
  for (int j = 0; j < size; j += 4) {
    add_product<true>(to + j * kStride, kStride, from, kRows, from + j, kRows, count, j, size);
  }
  mirror(p, size);
}

}  // namespace tensegrity
