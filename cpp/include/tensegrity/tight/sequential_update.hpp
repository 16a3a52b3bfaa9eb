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

#include "tensegrity/tight/row.hpp"
#include "tensegrity/tight/waiting_rows.hpp"

namespace tensegrity::tight {

// Within the batch every row counts in full, so that the mean is that of the joint update.
//
// The rows of G (waiting_rows.hpp) are found one by one: with them also the innovations, and what a
// row says given those before it.
template <typename Scalar>
class SequentialUpdate {
 public:
  using B = Belief<Scalar>;

  explicit SequentialUpdate(B& belief) : belief_(belief) {
    set_zero(error_.data(), error_.data() + B::Dim);
  }
  // Takes the collected error out of the mean, if any row was applied.
  ~SequentialUpdate() {
    if (waiting_ == 0) return;  // every applied row waits, also after a full batch was taken
    rows_.whiten(waiting_, error_);
    belief_.retract(error_);
    rows_.downdate(belief_.covariance, waiting_);
  }
  SequentialUpdate(const SequentialUpdate&) = delete;
  SequentialUpdate& operator=(const SequentialUpdate&) = delete;

  // residual = H e + n with var(n) = variance > 0. Returns y^2, the row's part of the chi-square;
  // with it beyond `gate` (0: no gate) nothing happened.
  Scalar correct(const Row<Scalar>& row, Scalar residual, Scalar variance, Scalar gate = 0) {
    if (waiting_ == rows_.kCapacity) take();
    const int own = waiting_;
    for (; complete_ < row.end(); complete_ += 4) {
      mirror(belief_.covariance, complete_, complete_ + 4);
    }
    row.cross(belief_.covariance, rows_.cross(own));
    Scalar spread = row.times(rows_.cross(own));
    Scalar innovation = residual - row.times(&error_[0]);
    auto& g = rows_.g;
    for (int k = 0; k < own; ++k) {
      Scalar seen = row.times(rows_.cross(k));
      for (int i = 0; i < k; ++i) seen -= g(k, i) * g(own, i);
      seen *= rows_.inverse[k];
      g(own, k) = seen;
      spread -= seen * seen;
      innovation -= seen * rows_.y[k];
    }
    const Scalar inverse = 1 / (std::max(spread, Scalar(0)) + variance);
    const Scalar chi_square = innovation * innovation * inverse;
    if (!std::isfinite(chi_square) || (gate > 0 && chi_square > gate)) return chi_square;
    const Scalar root = std::sqrt(inverse);
    // Also a row that informs of nothing stands in the joint gain.
    rows_.set(own, root, innovation * root);
    ++waiting_;
    return chi_square;
  }

 private:
  void take() {
    rows_.whiten(waiting_, error_);
    rows_.downdate(belief_.covariance, waiting_);
    complete_ = B::kComplete;
    waiting_ = 0;
  }

  B& belief_;
  typename B::ErrorVector error_;  // of the rows of full batches
  WaitingRows<Scalar> rows_;
  int complete_ = B::kComplete;  // columns of P
  int waiting_ = 0;
};

}  // namespace tensegrity::tight
