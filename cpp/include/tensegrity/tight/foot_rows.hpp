// The four rows of H of a foot (feet.hpp): those of its slip share columns, and their products with
// a vector are one packet.
#pragma once

#include <algorithm>
#include <array>

#include "tensegrity/math/symmetric.hpp"
#include "tensegrity/tight/belief.hpp"

namespace tensegrity::tight {

inline constexpr int kMostFeet = 3;  // that carry the robot at once

// Rows 0 to 2 are of the slip, the last of them across the ground; row 3 is of the height. Every
// block has to be set before they are used.
template <typename Scalar>
class FootRows {
 public:
  using P = Packet<Scalar>;
  static constexpr int kBlocks = 3;  // of the slip, and of the height

  // Columns at .. at + 2 of the slip's rows, each with a number for each row and a zero.
  void set_slip(int block, int at, const P& x, const P& y, const P& z) {
    slip_at_[std::size_t(block)] = at;
    x.store(&slip_(0, 3 * block));
    y.store(&slip_(0, 3 * block + 1));
    z.store(&slip_(0, 3 * block + 2));
  }
  // Columns at .. at + 2 of the height's row, and a zero.
  void set_height(int block, int at, const P& h) {
    height_at_[std::size_t(block)] = at;
    h.store(height_[block]);
  }
  // Only the first `blocks` of the slip's are not zero, and of the row across the ground the first
  // `across`.
  void limit(int blocks, int across) { blocks_ = blocks, across_ = across; }

  // Rows that say nothing, of columns that are set.
  void clear() {
    slip_.setZero();
    for (auto& block : height_) std::fill(block, block + 4, Scalar(0));
  }

  // P H', four columns.
  void cross(const typename Belief<Scalar>::Covariance& p, Scalar* out) const {
    constexpr int kColumn = Belief<Scalar>::Dim;
    const int* slip_at = slip_at_.data();
    multiply_blocks<2, 4, 12>(p, slip_at, &slip_(0, 0), blocks_, out);
    multiply_blocks<1, 4, 12>(p, slip_at, &slip_(2, 0), across_, out + 2 * kColumn);
    multiply_blocks<1, 1, 4>(p, height_at_.data(), height_[0], kBlocks, out + 3 * kColumn);
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
  std::array<int, kBlocks> slip_at_, height_at_;
  int blocks_, across_;
};

}  // namespace tensegrity::tight
