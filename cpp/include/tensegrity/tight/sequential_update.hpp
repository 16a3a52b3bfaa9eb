// Corrections one scalar at a time.
//
// Every measurement of this filter touches a few blocks of the state: a cable two endcaps and its
// offset, a foot one rod. As scalars they cost one sparse product and one rank-1 downdate of P
// each, need no decomposition, and a lost cable is a row left out. All rows of one instant are
// linearised at the same mean: the error they agree on is collected and taken out of the mean once,
// so that the result is that of the joint update (for independent noises) whatever the order.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "tensegrity/tight/row.hpp"

namespace tensegrity::tight {

// Within the batch every row counts in full, so that the mean is that of the joint update; what a
// row does not inform of is left out of the downdate at the end.
//
// The downdates of P wait until the end: P is then read and written once for all rows instead of
// once for each. What waits of a row is its c = P H' (with the rows before it applied) and 1/S, of
// P - sum c c' / S; the error collected so far is sum c y / S with y the row's innovation.
template <typename Scalar>
class SequentialUpdate {
 public:
  using B = Belief<Scalar>;

  explicit SequentialUpdate(B& belief) : belief_(belief) {}
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
    Sum<Scalar, B::Dim, Row<Scalar>::kMost + kCapacity> cross;
    row.for_each([&](int i, Scalar h) { cross.add(h, &belief_.covariance(0, i)); });
    Scalar innovation = residual - row.times(&error_[0]);
    for (int k = 0; k < waiting_; ++k) {
      const Waiting& before = rows_[std::size_t(k)];
      const Scalar seen = row.times(&crosses_(0, k));
      cross.add(-seen * before.inverse_variance, &crosses_(0, k));
      innovation -= seen * before.weight;
    }
    auto c = crosses_.col(waiting_);
    cross.store(&c[0]);
    const Scalar inverse_variance = 1 / (std::max(row.times(&c[0]), Scalar(0)) + variance);
    const Scalar weight = innovation * inverse_variance;
    const Scalar chi_square = innovation * weight;
    if (!std::isfinite(chi_square) || (gate > 0 && chi_square > gate)) return chi_square;
    // Also a row that informs of nothing stands in the joint gain.
    rows_[std::size_t(waiting_++)] = {inverse_variance, weight, information};
    return chi_square;
  }

 private:
  static constexpr int kCapacity = 12;  // of three feet, and of nine cables

  struct Waiting {
    Scalar inverse_variance;  // 1/S
    Scalar weight;            // y/S
    Scalar information;       // part of the downdate that is applied
  };

  void downdate() {
    Sum<Scalar, B::Dim, kCapacity + 1> error;
    error.add(Scalar(1), &error_[0]);
    for (int k = 0; k < waiting_; ++k) {
      error.add(rows_[std::size_t(k)].weight, &crosses_(0, k));
    }
    error.store(&error_[0]);
    for (int k = 0; k < waiting_; ++k) {
      const Waiting& row = rows_[std::size_t(k)];
      crosses_.col(k) *= std::sqrt(row.information * row.inverse_variance);
    }
    subtract_outer(belief_.covariance, crosses_, waiting_, B::Dim);
    mirror(belief_.covariance, B::Dim);
    waiting_ = 0;
  }

  B& belief_;
  typename B::ErrorVector error_ = B::ErrorVector::Zero();  // of the rows before those that wait
  Matrix<Scalar, B::Dim, kCapacity> crosses_;               // c
  std::array<Waiting, kCapacity> rows_;
  int waiting_ = 0;
};

}  // namespace tensegrity::tight
