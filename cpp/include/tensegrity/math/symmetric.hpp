// What a filter does to its covariance all day, written for the columns of a matrix in memory.
//
// A covariance is computed in its lower triangle, and columns that are read as a whole get their
// upper part by a `mirror`. Loops run over whole packets of four rows: matrices here
// have a multiple of four rows (`padded`), and are zero beyond their active size.
#pragma once

#include "tensegrity/math/packet.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity {

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

namespace detail {

// Four columns from `column` on.
template <typename Derived>
void mirror_columns(Eigen::MatrixBase<Derived>& matrix, int column) {
  static_assert(Derived::RowsAtCompileTime % 4 == 0, "whole packets");
  using P = Packet<typename Derived::Scalar>;
  const auto all = columns(matrix.derived());
  const auto to = all.from_column(column);
  for (int row = 0; row < column; row += 4) {
    const auto lower = all.from_column(row).from(column), upper = to.from(row);
    P x0(lower[0]), x1(lower[1]), x2(lower[2]), x3(lower[3]);
    P::transpose(x0, x1, x2, x3);
    x0.store(upper[0]), x1.store(upper[1]), x2.store(upper[2]), x3.store(upper[3]);
  }
  const auto own = to.from(column);  // the block on the diagonal
  P x0(own[0]), x1(own[1]), x2(own[2]), x3(own[3]);
  const P below1 = x1, below2 = x2, below3 = x3;
  P::transpose(x0, x1, x2, x3);
  P::template first<1>(x1, below1).store(own[1]);
  P::template first<2>(x2, below2).store(own[2]);
  P::template first<3>(x3, below3).store(own[3]);
}

}  // namespace detail

// Copies the lower triangle to the upper one in the columns from `begin` to `end`, multiples of
// four.
template <typename Derived>
void mirror(Eigen::MatrixBase<Derived>& matrix, int begin, int end) {
  for (int column = begin; column < end; column += 4) detail::mirror_columns(matrix, column);
}

// Of `packets` sums so many at once that none waits for its last addition, and all stay in
// registers: there is a factor besides, and a number from memory.
template <typename Scalar>
constexpr int packets_at_once(int packets, int rows = 1) {
  const int most = rows == 1 ? Packet<Scalar>::kHeld + 1 : Packet<Scalar>::kHeld / rows;
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

// P h of `Rows` vectors h of `blocks` blocks of three numbers, for the columns of P from at[b] on.
// From one h to the next it is one number, to the next number of h `Step`, to the next block
// `BlockStep`; the results are as far apart as columns of P. What is loaded of P serves all.
template <int Rows, int Step, int BlockStep, int First = 0, typename Derived>
void multiply_blocks(const Eigen::MatrixBase<Derived>& p, const int* at,
                     const typename Derived::Scalar* h, int blocks, typename Derived::Scalar* out) {
  using Scalar = typename Derived::Scalar;
  constexpr int kStride = Derived::RowsAtCompileTime;
  constexpr int kPackets = kStride / 4;
  constexpr int kHere = std::min(packets_at_once<Scalar>(kPackets, Rows), kPackets - First);
  Packet<Scalar> sum[Rows][kHere];
  for (int b = 0; b < blocks; ++b) {
    const Scalar* factors = h + b * BlockStep;
    const Scalar* column = &p.derived().coeffRef(4 * First, at[b]);
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i, factors += Step, column += kStride) {
#pragma GCC unroll 13
      for (int k = 0; k < kHere; ++k) {
        Packet<Scalar> x(column + 4 * k);
        if constexpr (Rows > 1) x.hold();
#pragma GCC unroll 2
        for (int r = 0; r < Rows; ++r) sum[r][k].add(factors[r], x);
      }
    }
  }
#pragma GCC unroll 2
  for (int r = 0; r < Rows; ++r) {
#pragma GCC unroll 13
    for (int k = 0; k < kHere; ++k) sum[r][k].store(out + r * kStride + 4 * (First + k));
  }
  if constexpr (First + kHere < kPackets) {
    multiply_blocks<Rows, Step, BlockStep, First + kHere>(p, at, h, blocks, out);
  }
}

namespace detail {

// Four columns of P, `Packets` packets of rows: P <- P - A B' with `count` > 0 columns of A
// and B. What is loaded of A is used in every column, what is loaded of B in every packet, and the
// tile stays in registers.
template <int Packets, typename Scalar, int P, int W>
void subtract_tile(Columns<Scalar, P> p, Columns<const Scalar, W> a, Columns<const Scalar, W> b,
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
      for (int k = 0; k < Packets; ++k) tile[c][k].subtract(b.first[c], rows[k]);
    }
    a.first += W;
    b.first += W;
  } while (a.first != end);
#pragma GCC unroll 4
  for (int c = 0; c < 4; ++c) {
#pragma GCC unroll 2
    for (int k = 0; k < Packets; ++k) tile[c][k].store(p[c] + 4 * k);
  }
}

// The same with one packet of rows, in two sums each: four chains of additions are too few at once.
template <typename Scalar, int P, int W>
void subtract_single(Columns<Scalar, P> p, Columns<const Scalar, W> a, Columns<const Scalar, W> b,
                     int count) {
  Packet<Scalar> even[4], odd[4];
  const auto take = [](Packet<Scalar>(&sums)[4], Packet<Scalar> rows, const Scalar* factors) {
    rows.hold();
#pragma GCC unroll 4
    for (int c = 0; c < 4; ++c) sums[c].subtract(factors[c], rows);
  };
#pragma GCC unroll 4
  for (int c = 0; c < 4; ++c) even[c] = Packet<Scalar>(p[c]);
  int k = 0;
  for (; k + 2 <= count; k += 2) {
    take(even, Packet<Scalar>(a[k]), b[k]);
    take(odd, Packet<Scalar>(a[k + 1]), b[k + 1]);
  }
  if (k < count) take(even, Packet<Scalar>(a[k]), b[k]);
#pragma GCC unroll 4
  for (int c = 0; c < 4; ++c) (even[c] + odd[c]).store(p[c]);
}

}  // namespace detail

// P <- P - W W' with the first `count` columns of W, in the lower triangle of the first `size` rows
// and columns.
template <typename P, typename W>
void subtract_outer(Eigen::MatrixBase<P>& p, const Eigen::MatrixBase<W>& w, int count, int size) {
  static_assert(P::RowsAtCompileTime % 4 == 0 && W::RowsAtCompileTime % 4 == 0, "whole packets");
  const auto to = columns(p.derived());
  const auto from = columns(w);
  for (int j = 0; count > 0 && j < size; j += 4) {
    const auto own = to.from_column(j);
    int i = j;
    if constexpr (Packet<typename P::Scalar>::kHeld >= 12) {
      for (; i + 8 <= size; i += 8) {
        detail::subtract_tile<2>(own.from(i), from.from(i), from.from(j), count);
      }
      if (i < size) detail::subtract_single(own.from(i), from.from(i), from.from(j), count);
    } else {
      for (; i < size; i += 4) {
        detail::subtract_tile<1>(own.from(i), from.from(i), from.from(j), count);
      }
    }
  }
}

}  // namespace tensegrity
