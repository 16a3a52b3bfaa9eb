// P <- F P F' for a shear F, read and written in the lower triangle of P alone.
//
// A shear adds to errors x what three errors s before them cause, x <- x + B s. With S = P_ss and
// G = P_xs, column by column of P,
//   P_xj <- P_xj + B P_sj                      up to and in s,
//   P_xj <- P_xj + B Ghat_j' + G B_j'          after it, Ghat = G + B (S + N),
// where N is the variance of a noise that is an error of s for this shear alone. Errors between s
// and x count as x without rows in B.
#pragma once

#include <type_traits>

#include "tensegrity/math/symmetric.hpp"

namespace tensegrity {

// `Rows`: of P, a multiple of four, the last of them after those of x.
template <typename Scalar, int Rows>
class Shear {
 public:
  // `source`: where s starts. `noise`: variance of each of the three numbers in N.
  explicit Shear(int source, Scalar noise = 0) : source_(source), noise_(noise) {}

  // Column k of B. Before `apply` all packets that it takes have to be set.
  Scalar* column(int k) { return by_[k]; }
  // Rows at .. at + 2 of B, and zeros in the row after them. By ascending `at`.
  void set(int at, const Block<Scalar>& m) {
    for (int k = 0; k < 3; ++k) m[std::size_t(k)].store(by_[k] + at);
  }
  void clear(int first, int end) {
    for (int k = 0; k < 3; ++k) set_zero(by_[k] + first, by_[k] + end);
  }

  // `begin` to `end`: rows of x. `rows`: up to where P has anything, a multiple of four.
  template <typename P>
  void apply(P& covariance, int begin, int end, int rows) const {
    const auto p = columns(covariance);
    const int first = packet_start(begin), own = padded(end);
    // S in full.
    const auto s = p.from(source_).from_column(source_);
    s[1][0] = s[0][1], s[2][0] = s[0][2], s[2][1] = s[1][2];
    alignas(4 * sizeof(Scalar)) Scalar seen[3][Rows];  // Ghat
    for (int i = packet_start(source_ + 3); i < first; i += 4) {
      for (int k = 0; k < 3; ++k) {
        Packet<Scalar> g(p[source_ + k] + i);
        g.hold();  // or GCC calls memcpy for every packet
        g.store(seen[k] + i);
      }
    }
    const Range x{begin, end};
    int i = first;
    if constexpr (kAtOnce == 2) {
      for (; i + 8 <= own; i += 8) own_rows<2>(p, seen[0], i, x);
    }
    for (; i < own; i += 4) own_rows<1>(p, seen[0], i, x);
    if constexpr (kAtOnce == 2) {
      for (; i + 8 <= rows; i += 8) other_rows<2>(p, i, x);
    }
    for (; i < rows; i += 4) other_rows<1>(p, i, x);
  }

 private:
  struct Range {
    int begin, end;
  };
  template <int N>
  using Constant = std::integral_constant<int, N>;
  // Packets of rows: B and G of two fit the registers of AVX.
  static constexpr int kAtOnce = Packet<Scalar>::kHeld >= 12 ? 2 : 1;

  // Packets of a column and sum b_k x_k, where b is `Stride` apart.
  template <int Stride, int Packets>
  static void add(Scalar* to, const Scalar* b, const Packet<Scalar> (&x)[3][Packets]) {
#pragma GCC unroll 2
    for (int q = 0; q < Packets; ++q) {
      Packet<Scalar> sum(to + 4 * q);
#pragma GCC unroll 3
      for (int k = 0; k < 3; ++k) sum.add(b[k * Stride], x[k][q]);
      sum.store(to + 4 * q);
    }
  }

  // Packets of rows from i on, of which some are x.
  template <int Packets, typename P>
  void own_rows(P p, Scalar* seen, int i, Range x) const {
    Packet<Scalar> b[3][Packets], g[3][Packets];
#pragma GCC unroll 3
    for (int k = 0; k < 3; ++k) {
#pragma GCC unroll 2
      for (int q = 0; q < Packets; ++q) {
        b[k][q] = Packet<Scalar>(by_[k] + i + 4 * q);
        g[k][q] = Packet<Scalar>(p[source_ + k] + i + 4 * q);
      }
    }
    for (int j = 0; j < source_; ++j) add<1>(p[j] + i, p[j] + source_, b);
#pragma GCC unroll 3
    for (int k = 0; k < 3; ++k) {
      const Scalar* s = p[source_ + k] + source_;
      const Scalar s0 = s[0], s1 = s[1], s2 = s[2];
#pragma GCC unroll 2
      for (int q = 0; q < Packets; ++q) {
        Packet<Scalar> sum = g[k][q];
        sum.add(s0, b[0][q]), sum.add(s1, b[1][q]), sum.add(s2, b[2][q]);
        sum.store(p[source_ + k] + i + 4 * q);
        sum.add(noise_, b[k][q]);
        sum.store(seen + k * Rows + i + 4 * q);
      }
    }
    const int end = std::min(i + 4 * Packets, x.end);
    for (int j = source_ + 3; j < std::min(x.begin, end); ++j) add<Rows>(p[j] + i, seen + j, b);
    // Two short chains of additions for each sum: of long ones too few are under way at once.
    const auto add_both = [&](int j, auto first) {
      constexpr int kFirst = decltype(first)::value;
      const Scalar *bj = by_[0] + j, *gj = seen + j;
      Packet<Scalar> sum[Packets], more[Packets];
#pragma GCC unroll 2
      for (int q = kFirst; q < Packets; ++q) {
        sum[q] = Packet<Scalar>(p[j] + i + 4 * q);
        more[q] = bj[0] * g[0][q];
      }
#pragma GCC unroll 3
      for (int k = 0; k < 3; ++k) {
#pragma GCC unroll 2
        for (int q = kFirst; q < Packets; ++q) {
          sum[q].add(gj[k * Rows], b[k][q]);
          if (k > 0) more[q].add(bj[k * Rows], g[k][q]);
        }
      }
#pragma GCC unroll 2
      for (int q = kFirst; q < Packets; ++q) (sum[q] + more[q]).store(p[j] + i + 4 * q);
    };
    int j = x.begin;
    for (; j < std::min(i + 4, end); ++j) add_both(j, Constant<0>());
    for (; j < end; ++j) add_both(j, Constant<Packets - 1>());  // below the diagonal there alone
  }

  // Packets of rows after x, from i on.
  template <int Packets, typename P>
  void other_rows(P p, int i, Range x) const {
    Packet<Scalar> g[3][Packets];
#pragma GCC unroll 3
    for (int k = 0; k < 3; ++k) {
#pragma GCC unroll 2
      for (int q = 0; q < Packets; ++q) g[k][q] = Packet<Scalar>(p[source_ + k] + i + 4 * q);
    }
    for (int j = x.begin; j < x.end; ++j) add<Rows>(p[j] + i, by_[0] + j, g);
  }

  int source_;
  Scalar noise_;
  alignas(4 * sizeof(Scalar)) Scalar by_[3][Rows];
};

}  // namespace tensegrity
