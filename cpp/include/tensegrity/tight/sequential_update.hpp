// Corrections one scalar at a time.
//
// Every measurement of this filter touches a few blocks of the state: a cable two endcaps and its
// offset, a foot one rod. A scalar is one sparse row, and a lost cable is a row left out. All rows
// of one instant are linearised at the same mean: the error they agree on is collected and taken
// out of the mean once, so that the result is that of the joint update (for independent noises)
// whatever the order.
#pragma once

#include <algorithm>
#include <cmath>

#include "tensegrity/tight/foot_rows.hpp"
#include "tensegrity/tight/row.hpp"

namespace tensegrity::tight {

// Within the batch every row counts in full, so that the mean is that of the joint update; what a
// row does not inform of is left out of the downdate at the end.
//
// Of S = H P H' + N = G G' the rows of the lower triangular G are found one by one: with them also
// the innovations y = G^-1 z, and what a row says given those before it. What is as long as the
// state waits until all rows are known: C = P H' G^-T, the error C y, and P - C C', so that P is
// read and written once.
template <typename Scalar>
class SequentialUpdate {
 public:
  using B = Belief<Scalar>;
  using P = Packet<Scalar>;

  explicit SequentialUpdate(B& belief) : belief_(belief) {
    set_zero(error_.data(), error_.data() + B::Dim);
  }
  // Takes the collected error out of the mean, if any row was applied.
  ~SequentialUpdate() {
    if (waiting_ == 0) return;  // every applied row waits, also after a full batch was taken
    downdate();
    belief_.retract(error_);
  }
  SequentialUpdate(const SequentialUpdate&) = delete;
  SequentialUpdate& operator=(const SequentialUpdate&) = delete;

  // residual = H e + n with var(n) = variance > 0. Returns y^2, the row's part of the chi-square;
  // with it beyond `gate` (0: no gate) nothing happened. `information` in [0, 1] is the part of the
  // downdate of P that is applied: 1 for a Gaussian measurement, less where the mean moves more
  // than the data inform (robust likelihoods, friction.hpp).
  Scalar correct(const Row<Scalar>& row, Scalar residual, Scalar variance, Scalar gate = 0,
                 Scalar information = 1) {
    if (waiting_ == kCapacity) downdate();
    const int own = waiting_;
    row.cross(belief_.covariance, cross(own));
    Scalar spread = row.times(cross(own));
    Scalar innovation = residual - row.times(&error_[0]);
    for (int k = 0; k < own; ++k) {
      Scalar seen = row.times(cross(k));
      for (int i = 0; i < k; ++i) seen -= g_(k, i) * g_(own, i);
      seen *= inverse_[k];
      g_(own, k) = seen;
      spread -= seen * seen;
      innovation -= seen * y_[k];
    }
    const Scalar inverse = 1 / (std::max(spread, Scalar(0)) + variance);
    const Scalar chi_square = innovation * innovation * inverse;
    if (!std::isfinite(chi_square) || (gate > 0 && chi_square > gate)) return chi_square;
    const Scalar root = std::sqrt(inverse);
    // Also a row that informs of nothing stands in the joint gain.
    set(own, root, innovation * root, information);
    ++waiting_;
    return chi_square;
  }

  // The four rows of a foot without a gate, a number a row in the order of FootRows. If one of the
  // four is not finite nothing happened.
  P correct(const FootRows<Scalar>& rows, P residual, const P& variance, const P& information) {
    pad();
    if (waiting_ == kCapacity) downdate();
    const int own = waiting_;
    // Rows that are known early come first: those of the slip wait for its direction.
    for (int k = 3; k >= 0; --k) rows.cross(k, belief_.covariance, cross(own + k));
    P seen[kCapacity];  // columns of H P H' in these rows
    for (int k = 0; k < own + 4; k += 4) rows.times(cross(k), &seen[k], B::Dim);
    if (taken_) {
      P x[4];  // all of them of the same vector
      rows.times(&error_[0], x, 0);
      residual = residual - x[0];
    }
    // With loops of known length the elimination stays in registers.
    static_assert(kCapacity == 12);
    if (!P::kSimd) return append<-1>(seen, residual, variance, information);
    if (own == 0) return append<0>(seen, residual, variance, information);
    if (own == 4) return append<4>(seen, residual, variance, information);
    return append<8>(seen, residual, variance, information);
  }

 private:
  static constexpr int kCapacity = 12;  // of three feet, and of nine cables

  Scalar* cross(int row) { return &crosses_(0, row); }

  void set(int row, Scalar inverse, Scalar y, Scalar information) {
    inverse_[row] = inverse;
    y_[row] = y;
    information_[row] = information;
  }

  // Rows of G from those of S, `seen` by columns, and of their noise. `Own`: rows so far, -1 for
  // any number.
  template <int Own>
  P append(P* seen, P residual, const P& variance, const P& information) {
    const int own = Own < 0 ? waiting_ : Own;
#pragma GCC unroll 8
    for (int k = 0; k < own; ++k) {
#pragma GCC unroll 8
      for (int i = 0; i < k; ++i) seen[k].subtract(g_(k, i), seen[i]);
      seen[k] = inverse_[k] * seen[k];
      seen[k].store(&g_(own, k));
      residual.subtract(y_[k], seen[k]);
    }
#pragma GCC unroll 8
    for (int k = 0; k < own; ++k) {
#pragma GCC unroll 4
      for (int c = 0; c < 4; ++c) seen[own + c].subtract(g_(own + c, k), seen[k]);
    }
    Scalar chi_squares[4];
#pragma GCC unroll 4
    for (int c = 0; c < 4; ++c) {
      const P column = seen[own + c];
      // Roots are not in the chain from pivot to pivot.
      const Scalar inverse = 1 / (std::max(column.at(c), Scalar(0)) + variance.at(c));
      const Scalar innovation = residual.at(c);
      const Scalar weight = innovation * inverse;
#pragma GCC unroll 4
      for (int d = c + 1; d < 4; ++d) seen[own + d].subtract(column.at(d) * inverse, column);
      residual.subtract(weight, column);
      chi_squares[c] = innovation * weight;
      const Scalar root = std::sqrt(inverse);
      (root * column).store(&g_(own, own + c));
      set(own + c, root, innovation * root, information.at(c));
    }
    const P out(chi_squares);
    if (std::isfinite(P::dot(out, {1, 1, 1, 0}) + out.at(3))) waiting_ += 4;
    return out;
  }

  // Rows that say nothing, up to a multiple of four.
  void pad() {
    for (; waiting_ % 4 != 0; ++waiting_) {
      crosses_.col(waiting_).setZero();
      g_.row(waiting_).head(waiting_).setZero();
      set(waiting_, Scalar(0), Scalar(0), Scalar(1));
    }
  }

  TENSEGRITY_FLATTEN void downdate() {
    const int count = waiting_;
    pad();
    for (int j = 0; j < count; j += 4) whiten(j);
    for (int k = 0; k < count; ++k) {
      if (information_[k] < 1) crosses_.col(k) *= std::sqrt(information_[k]);
    }
    subtract_outer(belief_.covariance, crosses_, count, B::Dim);
    mirror(belief_.covariance, B::Dim);
    waiting_ = 0;
    taken_ = true;
  }

  // Columns j to j + 3 of C from those of P H', once those before them are done, and their error.
  void whiten(int j) {
    using Const = Columns<const Scalar, kCapacity>;
    const auto all = columns(crosses_);
    const auto own = all.from_column(j);
    if (j > 0) {
      add_product<true>(own, Columns<const Scalar, B::Dim>{all.first}, Const{&g_(j, 0)}, j, 0,
                        B::Dim);
    }
    const Scalar g10 = g_(j + 1, j), g20 = g_(j + 2, j), g30 = g_(j + 3, j), g21 = g_(j + 2, j + 1),
                 g31 = g_(j + 3, j + 1), g32 = g_(j + 3, j + 2);
    for (int i = 0; i < B::Dim; i += 4) {
      P a(own[0] + i), b(own[1] + i), c(own[2] + i), d(own[3] + i), error(&error_[i]);
      a = inverse_[j] * a;
      b.subtract(g10, a), c.subtract(g20, a), d.subtract(g30, a), error.add(y_[j], a);
      b = inverse_[j + 1] * b;
      c.subtract(g21, b), d.subtract(g31, b), error.add(y_[j + 1], b);
      c = inverse_[j + 2] * c;
      d.subtract(g32, c), error.add(y_[j + 2], c);
      d = inverse_[j + 3] * d;
      error.add(y_[j + 3], d);
      a.store(own[0] + i), b.store(own[1] + i), c.store(own[2] + i), d.store(own[3] + i);
      error.store(&error_[i]);
    }
  }

  B& belief_;
  typename B::ErrorVector error_;              // of the rows of full batches
  Matrix<Scalar, B::Dim, kCapacity> crosses_;  // P H', in the end C
  Matrix<Scalar, kCapacity> g_;                // G below its diagonal
  // By row: 1 / its diagonal element of G, y, and the part of the downdate that is applied.
  Scalar inverse_[kCapacity], y_[kCapacity], information_[kCapacity];
  int waiting_ = 0;
  bool taken_ = false;  // a full batch was
};

}  // namespace tensegrity::tight
