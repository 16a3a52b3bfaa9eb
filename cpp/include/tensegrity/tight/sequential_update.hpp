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

#include "tensegrity/math/symmetric.hpp"
#include "tensegrity/tight/belief.hpp"

namespace tensegrity::tight {

// One row of H, as blocks of three columns and at most one single column.
template <typename Scalar>
class Row {
 public:
  static constexpr int kMaxBlocks = 6;

  void add(int at, const Vector3<Scalar>& h) {
    for (int k = 0; k < blocks_; ++k) {
      if (at_[std::size_t(k)] == at) {
        h_[std::size_t(k)] += h;
        return;
      }
    }
    at_[std::size_t(blocks_)] = at;
    h_[std::size_t(blocks_++)] = h;
  }
  void add_single(int at, Scalar h) {
    single_at_ = at;
    single_ = h;
  }

  // P H'
  template <typename Covariance>
  Vector<Scalar, Covariance::RowsAtCompileTime> cross(const Covariance& p) const {
    Vector<Scalar, Covariance::RowsAtCompileTime> c;
    if (single_at_ >= 0) {
      c = single_ * p.col(single_at_);
    } else {
      c.setZero();
    }
    for (int k = 0; k < blocks_; ++k) {
      const int at = at_[std::size_t(k)];
      const Vector3<Scalar>& h = h_[std::size_t(k)];
      c += h[0] * p.col(at) + h[1] * p.col(at + 1) + h[2] * p.col(at + 2);
    }
    return c;
  }
  // H x
  template <typename Derived>
  Scalar times(const Eigen::MatrixBase<Derived>& x) const {
    Scalar sum = single_at_ >= 0 ? single_ * x[single_at_] : Scalar(0);
    for (int k = 0; k < blocks_; ++k) {
      sum += h_[std::size_t(k)].dot(x.template segment<3>(at_[std::size_t(k)]));
    }
    return sum;
  }

 private:
  std::array<int, kMaxBlocks> at_{};
  std::array<Vector3<Scalar>, kMaxBlocks> h_{};
  int blocks_ = 0;
  int single_at_ = -1;
  Scalar single_ = 0;
};

// Within the batch every row counts in full, so that the mean is that of the joint update; what a
// row does not inform of is left out of the downdate at the end.
//
// The downdates of P wait until the end as columns g of P - sum g g': P is then read and written
// once for all rows instead of once for each.
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

  // residual = H e + n with var(n) = variance > 0. Returns y^2 / S, the row's part of the
  // chi-square; with it beyond `gate` (0: no gate) nothing happened. `information` in [0, 1] is the
  // part of the downdate of P that is applied: 1 for a Gaussian measurement, less where the mean
  // moves more than the data inform (robust likelihoods, friction.hpp).
  Scalar correct(const Row<Scalar>& row, Scalar residual, Scalar variance, Scalar gate = 0,
                 Scalar information = 1) {
    typename B::ErrorVector cross = row.cross(belief_.covariance);
    for (int k = 0; k < waiting_; ++k) cross -= row.times(gains_.col(k)) * gains_.col(k);
    const Scalar s = std::max(row.times(cross), Scalar(0)) + variance;
    const Scalar y = residual - row.times(error_);
    const Scalar chi_square = y * y / s;
    if (!std::isfinite(chi_square) || (gate > 0 && chi_square > gate)) return chi_square;
    error_ += (y / s) * cross;
    // Also a row that informs of nothing stands in the joint gain.
    if (waiting_ == kCapacity) downdate();
    applied_[std::size_t(waiting_)] = std::sqrt(information);
    gains_.col(waiting_++) = cross / std::sqrt(s);
    return chi_square;
  }

 private:
  static constexpr int kCapacity = 12;  // of three feet, and of nine cables

  void downdate() {
    for (int k = 0; k < waiting_; ++k) gains_.col(k) *= applied_[std::size_t(k)];
    subtract_outer(belief_.covariance, gains_, waiting_, B::Dim);
    waiting_ = 0;
  }

  B& belief_;
  typename B::ErrorVector error_ = B::ErrorVector::Zero();
  Matrix<Scalar, B::Dim, kCapacity> gains_;
  std::array<Scalar, kCapacity> applied_{};  // square root of the part of each that informs
  int waiting_ = 0;
};

}  // namespace tensegrity::tight
