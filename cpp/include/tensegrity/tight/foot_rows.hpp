// The four rows of H of a foot (feet.hpp): those of its slip share columns, and their products with
// a vector are one packet.
#pragma once

#include <array>

#include "tensegrity/math/symmetric.hpp"
#include "tensegrity/tight/belief.hpp"

namespace tensegrity::tight {

// Rows 0 to 2 are of the slip, the last of them across the ground; row 3 is of the height.
template <typename Scalar>
class FootRows {
 public:
  using P = Packet<Scalar>;
  static constexpr int kBlocks = 3;  // of the slip, and of the height

  FootRows() { set_zero(slip_.data(), slip_.data() + slip_.size()); }

  // Columns at .. at + 2 of the slip's rows: vectors of three. Blocks in which the one across the
  // ground is zero come last.
  void add_slip(int at, P first, P second) { add_slip(at, first, second, P()); }
  void add_slip(int at, P first, P second, P across) {
    P fourth;
    P::transpose(first, second, across, fourth);
    slip_at_[std::size_t(blocks_)] = at;
    first.store(&slip_(0, 3 * blocks_));
    second.store(&slip_(0, 3 * blocks_ + 1));
    across.store(&slip_(0, 3 * blocks_ + 2));
    ++blocks_;
  }
  // All of them are set.
  void set_height(int block, int at, P h) {
    height_at_[std::size_t(block)] = at;
    h.clear_fourth();
    h.store(height_[block]);
  }
  void limit_across(int blocks) { across_ = blocks; }

  // P H', of one row.
  void cross(int row, const typename Belief<Scalar>::Covariance& p, Scalar* out) const {
    if (row == 3) {
      multiply_blocks<1, 4>(p, height_at_.data(), height_[0], kBlocks, out);
    } else {
      multiply_blocks<4, 12>(p, slip_at_.data(), &slip_(row, 0), row < 2 ? blocks_ : across_, out);
    }
  }
  // H x of four vectors x, `stride` apart.
  void times(const Scalar* x, P* out, int stride) const {
    P slip[2][4], height[4];  // two sums of each: the chains of additions are short
#pragma GCC unroll 3
    for (int b = 0; b < kBlocks; ++b) {
      const P h(height_[b]);
#pragma GCC unroll 4
      for (int j = 0; j < 4; ++j) {
        height[j] = height[j] + h * P(x + height_at_[std::size_t(b)] + j * stride);
      }
      const Scalar* at = x + slip_at_[std::size_t(b)];
#pragma GCC unroll 3
      for (int i = 0; i < 3; ++i) {
        const P column(&slip_(0, 3 * b + i));
#pragma GCC unroll 4
        for (int j = 0; j < 4; ++j) slip[(b + i) % 2][j].add(at[j * stride + i], column);
      }
    }
    P::transpose(height[0], height[1], height[2], height[3]);
    const P heights = height[0] + height[1] + height[2];
    out[0] = P::template with_fourth<0>(slip[0][0] + slip[1][0], heights);
    out[1] = P::template with_fourth<1>(slip[0][1] + slip[1][1], heights);
    out[2] = P::template with_fourth<2>(slip[0][2] + slip[1][2], heights);
    out[3] = P::template with_fourth<3>(slip[0][3] + slip[1][3], heights);
  }

 private:
  Matrix<Scalar, 4, 3 * kBlocks> slip_;
  alignas(4 * sizeof(Scalar)) Scalar height_[kBlocks][4];
  std::array<int, kBlocks> slip_at_{}, height_at_{};
  int blocks_ = 0, across_ = 1;
};

}  // namespace tensegrity::tight
