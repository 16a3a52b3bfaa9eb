// Scalar measurements that have been taken, and what is as long as the state is still to be done.
//
// Of S = H P H' + N = G G' the lower triangular G is known, and y = G^-1 z. In the end
// C = P H' G^-T, the error C y, and P - C C': P is read and written once.
#pragma once

#include "tensegrity/math/symmetric.hpp"
#include "tensegrity/tight/belief.hpp"

namespace tensegrity::tight {

template <typename Scalar>
struct WaitingRows {
  using B = Belief<Scalar>;
  using P = Packet<Scalar>;
  static constexpr int kCapacity = 12;  // of three feet, and of nine cables

  Scalar* cross(int row) { return &crosses(0, row); }

  // `root`: 1 / the diagonal element of G.
  void set(int row, Scalar root, Scalar innovation) {
    inverse[row] = root;
    y[row] = innovation;
  }

  // C of the first `count` rows, and what they say of the error is added to it.
  void whiten(int count, typename B::ErrorVector& error) {
    for (int k = count; k < padded(count); ++k) {  // rows that say nothing
      crosses.col(k).setZero();
      g.row(k).head(k).setZero();
      set(k, Scalar(0), Scalar(0));
    }
    for (int j = 0; j < count; j += 4) whiten_four(j, error);
  }
  // After that: takes them out of P.
  void downdate(typename B::Covariance& covariance, int count) {
    subtract(covariance, count);
    mirror(covariance, 0, B::kComplete);
  }

  Matrix<Scalar, B::Dim, kCapacity> crosses;  // P H', in the end C
  Matrix<Scalar, kCapacity> g;                // G below its diagonal
  // By row: 1 / its diagonal element of G, and y.
  alignas(4 * sizeof(Scalar)) Scalar inverse[kCapacity], y[kCapacity];

 private:
  TENSEGRITY_FLATTEN void subtract(typename B::Covariance& covariance, int count) {
    subtract_outer(covariance, crosses, count, B::Dim);
  }

  // Columns j to j + 3 of C from those of P H', once those before them are done, and their error.
  void whiten_four(int j, typename B::ErrorVector& error) {
    constexpr int kTogether = P::kHeld >= 12 ? 2 : 1;
    constexpr int kWhole = B::Dim / (4 * kTogether) * (4 * kTogether);
    for (int i = 0; i < kWhole; i += 4 * kTogether) whiten_tile<kTogether>(j, i, error);
    for (int i = kWhole; i < B::Dim; i += 4) whiten_tile<1>(j, i, error);
  }
  template <int Packets>
  void whiten_tile(int j, int i, typename B::ErrorVector& error) {
    P tile[4][Packets], sum[Packets];
#pragma GCC unroll 2
    for (int k = 0; k < Packets; ++k) {
      sum[k] = P(&error[i + 4 * k]);
#pragma GCC unroll 4
      for (int c = 0; c < 4; ++c) tile[c][k] = P(&crosses(i + 4 * k, j + c));
    }
    for (int before = 0; before < j; ++before) {
      const Scalar* factors = &g(j, before);
#pragma GCC unroll 2
      for (int k = 0; k < Packets; ++k) {
        P rows(&crosses(i + 4 * k, before));
        rows.hold();
#pragma GCC unroll 4
        for (int c = 0; c < 4; ++c) tile[c][k].subtract(factors[c], rows);
      }
    }
#pragma GCC unroll 4
    for (int c = 0; c < 4; ++c) {
#pragma GCC unroll 2
      for (int k = 0; k < Packets; ++k) {
        tile[c][k] = inverse[j + c] * tile[c][k];
        sum[k].add(y[j + c], tile[c][k]);
        tile[c][k].store(&crosses(i + 4 * k, j + c));
#pragma GCC unroll 4
        for (int d = c + 1; d < 4; ++d) tile[d][k].subtract(g(j + d, j + c), tile[c][k]);
      }
    }
#pragma GCC unroll 2
    for (int k = 0; k < Packets; ++k) sum[k].store(&error[i + 4 * k]);
  }
};

}  // namespace tensegrity::tight
