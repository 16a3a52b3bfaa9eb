// A scalar measurement of the tightly coupled filter touches a few blocks of the state: a cable two
// endcaps and its offset, a foot one rod.
#pragma once

#include <algorithm>
#include <array>

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

  // Columns from here on are zero.
  int end() const {
    int end = single_at_ + 1;
    for (int k = 0; k < blocks_; ++k) end = std::max(end, at_[std::size_t(k)] + 3);
    return end;
  }
  // P H'
  void cross(const typename Belief<Scalar>::Covariance& p, Scalar* out) const {
    multiply_blocks<1, 1, 3>(p, at_.data(), h_[0].data(), blocks_, out);
    if (single_at_ < 0) return;
    for (int i = 0; i < Belief<Scalar>::Dim; i += 4) {
      Packet<Scalar> sum(out + i);
      sum.add(single_, Packet<Scalar>(&p(i, single_at_)));
      sum.store(out + i);
    }
  }
  // H x
  Scalar times(const Scalar* x) const {
    // A sum for each axis: the chains of additions are short.
    Scalar a = single_at_ >= 0 ? single_ * x[single_at_] : Scalar(0), b = 0, c = 0;
    for (int k = 0; k < blocks_; ++k) {
      const Vector3<Scalar>& h = h_[std::size_t(k)];
      const Scalar* at = x + at_[std::size_t(k)];
      a += h[0] * at[0];
      b += h[1] * at[1];
      c += h[2] * at[2];
    }
    return a + b + c;
  }

 private:
  std::array<int, kMaxBlocks> at_;
  std::array<Vector3<Scalar>, kMaxBlocks> h_;
  int blocks_ = 0;
  int single_at_ = -1;
  Scalar single_ = 0;
};

}  // namespace tensegrity::tight
