// The four rows of H of a foot (feet.hpp): those of its slip share columns, and the products of all
// four with a vector are one packet.
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

  FootRows() { set_zero(h_[0], h_[3 * kBlocks]); }

  // Columns at .. at + 2 of the slip's rows: vectors of three. Blocks in which the one across the
  // ground is zero come last.
  void add_slip(int at, P first, P second) { add_slip(at, first, second, P()); }
  void add_slip(int at, P first, P second, P across) {
    P fourth;
    P::transpose(first, second, across, fourth);
    at_[std::size_t(slip_)] = at;
    first.store(h_[3 * slip_]);
    second.store(h_[3 * slip_ + 1]);
    across.store(h_[3 * slip_ + 2]);
    ++slip_;
  }
  // All of them are set. The fourth number of `h` does not matter.
  void set_height(int block, int at, const P& h) {
    at_[std::size_t(kBlocks + block)] = at;
    for (int i = 0; i < 3; ++i) P(0, 0, 0, h.at(i)).store(h_[3 * (kBlocks + block) + i]);
  }
  void limit_across(int blocks) { across_ = blocks; }

  // P H', of one row.
  void cross(int row, const typename Belief<Scalar>::Covariance& p, Scalar* out) const {
    const int first = row < 3 ? 0 : kBlocks;
    const int blocks = row < 2 ? slip_ : row == 2 ? across_ : kBlocks;
    multiply_blocks<4>(p, at_.data() + first, &h_[3 * first][row], blocks, out);
  }
  // H x of `Count` vectors x, `stride` apart.
  template <int Count>
  void times(const Scalar* x, P* out, int stride = 0) const {
    P a[Count], b[Count], c[Count];  // one for each axis: the chains of additions are short
#pragma GCC unroll 6
    for (int k = 0; k < 2 * kBlocks; ++k) {
      const Scalar* at = x + at_[std::size_t(k)];
      const P ha(h_[3 * k]), hb(h_[3 * k + 1]), hc(h_[3 * k + 2]);
#pragma GCC unroll 4
      for (int j = 0; j < Count; ++j) a[j].add(at[j * stride], ha);
#pragma GCC unroll 4
      for (int j = 0; j < Count; ++j) b[j].add(at[j * stride + 1], hb);
#pragma GCC unroll 4
      for (int j = 0; j < Count; ++j) c[j].add(at[j * stride + 2], hc);
    }
#pragma GCC unroll 4
    for (int j = 0; j < Count; ++j) out[j] = a[j] + b[j] + c[j];
  }

 private:
  alignas(4 * sizeof(Scalar)) Scalar h_[6 * kBlocks][4];  // by column, then by row
  std::array<int, 2 * kBlocks> at_{};
  int slip_ = 0, across_ = 1;
};

}  // namespace tensegrity::tight
