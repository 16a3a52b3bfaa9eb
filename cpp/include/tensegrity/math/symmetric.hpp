// What a filter does to its covariance all day, written for the columns of a matrix in memory.
//
// A covariance is computed in its lower triangle, and stored in full, so that any of its columns
// can be read at once after a `mirror`. Loops run over whole packets of four rows: matrices here
// have a multiple of four rows (`padded`), and are zero beyond their active size.
#pragma once

#include "tensegrity/math/packet.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity {

// `count` columns from `to` on get `factor` times those from `from` on, in the rows from `first` (a
// multiple of four) on.
template <typename Derived>
void add_columns(Eigen::MatrixBase<Derived>& p, int to, int from, int count,
                 typename Derived::Scalar factor, int first) {
  using Scalar = typename Derived::Scalar;
  for (int k = 0; k < count; ++k) {
    Scalar* target = &p.derived().coeffRef(0, to + k);
    const Scalar* source = &p.derived().coeffRef(0, from + k);
    for (int i = first; i < Derived::RowsAtCompileTime; i += 4) {
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
      const Scalar* lower = p + j * kStride + i;
      Scalar* upper = p + i * kStride + j;
      Packet<Scalar> x0(lower), x1(lower + kStride), x2(lower + 2 * kStride),
          x3(lower + 3 * kStride);
      Packet<Scalar>::transpose(x0, x1, x2, x3);
      x0.store(upper);
      x1.store(upper + kStride);
      x2.store(upper + 2 * kStride);
      x3.store(upper + 3 * kStride);
    }
  }
}

// Of `packets` sums so many at once that none waits for its last addition, and all stay in
// registers: there is a factor besides, and a number from memory.
template <typename Scalar>
constexpr int packets_at_once(int packets) {
  const int most = Packet<Scalar>::kHeld + 1;
  const int groups = (packets - 1) / most + 1;
  return (packets + groups - 1) / groups;
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
  static constexpr int kPackets = Rows / 4;
  static constexpr int kGroup = packets_at_once<Scalar>(kPackets);

  template <int First>
  void store_from(Scalar* out) const {
    constexpr int kHere = std::min(kGroup, kPackets - First);
    Packet<Scalar> sum[kHere];
    for (int k = 0; k < count_; ++k) {
#pragma GCC unroll 13
      for (int i = 0; i < kHere; ++i) {
        sum[i].add(factors_[k], Packet<Scalar>(columns_[k] + 4 * (First + i)));
      }
    }
#pragma GCC unroll 13
    for (int i = 0; i < kHere; ++i) sum[i].store(out + 4 * (First + i));
    if constexpr (First + kHere < kPackets) store_from<First + kHere>(out);
  }

  Scalar factors_[Capacity];
  const Scalar* columns_[Capacity];
  int count_ = 0;
};

// P h for an h of `blocks` blocks of three numbers, for the columns of P from at[b] on. From one
// number of h to the next it is `Step`, from one block to the next `BlockStep`.
template <int Step, int BlockStep, int First = 0, typename Derived>
void multiply_blocks(const Eigen::MatrixBase<Derived>& p, const int* at,
                     const typename Derived::Scalar* h, int blocks, typename Derived::Scalar* out) {
  using Scalar = typename Derived::Scalar;
  constexpr int kStride = Derived::RowsAtCompileTime;
  constexpr int kPackets = kStride / 4;
  constexpr int kHere = std::min(packets_at_once<Scalar>(kPackets), kPackets - First);
  Packet<Scalar> sum[kHere];
  for (int b = 0; b < blocks; ++b) {
    const Scalar* factor = h + b * BlockStep;
    const Scalar* column = &p.derived().coeffRef(4 * First, at[b]);
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i, factor += Step, column += kStride) {
#pragma GCC unroll 13
      for (int k = 0; k < kHere; ++k) sum[k].add(*factor, Packet<Scalar>(column + 4 * k));
    }
  }
#pragma GCC unroll 13
  for (int k = 0; k < kHere; ++k) sum[k].store(out + 4 * (First + k));
  if constexpr (First + kHere < kPackets) {
    multiply_blocks<Step, BlockStep, First + kHere>(p, at, h, blocks, out);
  }
}

// Columns of numbers in memory, `Stride` apart.
template <typename Scalar, int Stride>
struct Columns {
  Scalar* first;

  Columns from(int row) const { return {first + row}; }
  Columns from_column(int column) const { return {first + column * Stride}; }
  Scalar* operator[](int column) const { return first + column * Stride; }
};

// Of a matrix, or of a block of whole columns or rows.
template <typename Derived>
auto columns(Eigen::PlainObjectBase<Derived>& m) {
  return Columns<typename Derived::Scalar, Derived::OuterStrideAtCompileTime>{m.data()};
}
template <typename Derived>
auto columns(const Eigen::MatrixBase<Derived>& m) {
  return Columns<const typename Derived::Scalar, Derived::OuterStrideAtCompileTime>{
      m.derived().data()};
}

namespace detail {

// Four columns of P, `Packets` packets of rows: P <- P +- A B' with `count` > 0 columns of A
// and B. What is loaded of A is used in every column, what is loaded of B in every packet, and the
// tile stays in registers.
template <int Packets, bool Subtract, typename Scalar, int P, int A, int B>
void add_product_tile(Columns<Scalar, P> p, Columns<const Scalar, A> a, Columns<const Scalar, B> b,
                      int count) {
  Packet<Scalar> tile[4][Packets];
#pragma GCC unroll 4
  for (int c = 0; c < 4; ++c) {
#pragma GCC unroll 2
    for (int k = 0; k < Packets; ++k) tile[c][k] = Packet<Scalar>(p[c] + 4 * k);
  }
  const Scalar* end = a[count];
  do {  // with a test at its end alone: the tile would leave its registers at a test before it
    Packet<Scalar> rows[Packets];
#pragma GCC unroll 2
    for (int k = 0; k < Packets; ++k) {
      rows[k] = Packet<Scalar>(a.first + 4 * k);
      rows[k].hold();
    }
#pragma GCC unroll 4
    for (int c = 0; c < 4; ++c) {
#pragma GCC unroll 2
      for (int k = 0; k < Packets; ++k) {
        if constexpr (Subtract) {
          tile[c][k].subtract(b.first[c], rows[k]);
        } else {
          tile[c][k].add(b.first[c], rows[k]);
        }
      }
    }
    a.first += A;
    b.first += B;
  } while (a.first != end);
#pragma GCC unroll 4
  for (int c = 0; c < 4; ++c) {
#pragma GCC unroll 2
    for (int k = 0; k < Packets; ++k) tile[c][k].store(p[c] + 4 * k);
  }
}

}  // namespace detail

// Four columns of P from `first` to `end` (multiples of four): P <- P +- A B' with `count` columns
// (> 0) of A, from the same rows, and of B, of which each has four numbers.
template <bool Subtract, typename Scalar, int P, int A, int B>
void add_product(Columns<Scalar, P> p, Columns<const Scalar, A> a, Columns<const Scalar, B> b,
                 int count, int first, int end) {
  int i = first;
  if constexpr (Packet<Scalar>::kHeld >= 12) {
    for (; i + 8 <= end; i += 8) {
      detail::add_product_tile<2, Subtract>(p.from(i), a.from(i), b, count);
    }
  }
  for (; i < end; i += 4) {
    detail::add_product_tile<1, Subtract>(p.from(i), a.from(i), b, count);
  }
}

// P <- P - W W' with the first `count` columns of W, in the lower triangle of the first `size` rows
// and columns.
template <typename P, typename W>
void subtract_outer(Eigen::MatrixBase<P>& p, const Eigen::MatrixBase<W>& w, int count, int size) {
  static_assert(P::RowsAtCompileTime % 4 == 0 && W::RowsAtCompileTime % 4 == 0, "whole packets");
  const auto to = columns(p.derived());
  const auto from = columns(w);
  for (int j = 0; count > 0 && j < size; j += 4) {
    add_product<true>(to.from_column(j), from, from.from(j), count, j, size);
  }
}

}  // namespace tensegrity
