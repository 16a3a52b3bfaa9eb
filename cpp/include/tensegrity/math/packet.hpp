// Four consecutive numbers of a column, in SIMD registers where the processor has them.
//
// Written with the vector types of GCC and Clang: they stay in registers from the first load to the
// last store, where an Eigen array of four goes through memory after every expression. Processors
// without such registers get the four scalar operations.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstring>

namespace tensegrity {

// The next multiple of four.
constexpr int padded(int size) { return (size + 3) / 4 * 4; }
// The packet of four that `row` is in starts here.
constexpr int packet_start(int row) { return row / 4 * 4; }

namespace detail {

// A register of `Bytes`, or a number by itself.
template <typename Scalar, bool Simd, int Bytes>
struct Register {
  typedef Scalar Type __attribute__((vector_size(Bytes)));
};
template <typename Scalar, int Bytes>
struct Register<Scalar, false, Bytes> {
  using Type = Scalar;
};

}  // namespace detail

template <typename Scalar>
class Packet {
 public:
#ifdef EIGEN_VECTORIZE
  static constexpr bool kSimd = true;
#else
  static constexpr bool kSimd = false;
#endif
  // Eigen aligns to the width of a register.
  static constexpr int kWidth = kSimd ? std::max(EIGEN_MAX_STATIC_ALIGN_BYTES, 16) : 1;
  static constexpr int kBytes =
      std::max(std::min(kWidth, 4 * int(sizeof(Scalar))), int(sizeof(Scalar)));
  static constexpr int kRegisters = 4 * int(sizeof(Scalar)) / kBytes;
  // So many packets can be held at once beside what a loop reads.
  static constexpr int kHeld = kSimd ? 8 : 4;

  Packet() = default;
  explicit Packet(const Scalar* rows) { std::memcpy(part_, rows, sizeof(part_)); }
  Packet(Scalar a, Scalar b, Scalar c, Scalar d) {
    if constexpr (kRegisters == 4) {
      part_[0] = a, part_[1] = b, part_[2] = c, part_[3] = d;
    } else if constexpr (kRegisters == 2) {
      part_[0] = Register{a, b};
      part_[1] = Register{c, d};
    } else {
      part_[0] = Register{a, b, c, d};
    }
  }

  void store(Scalar* rows) const { std::memcpy(rows, part_, sizeof(part_)); }

  // Stays in its registers: GCC would read it again from memory for every use, and loads, not
  // arithmetic, would then set the pace.
  void hold() {
#if defined(__AVX__)
    for (int k = 0; k < kRegisters; ++k) asm("" : "+x"(part_[k]));
#endif
  }

  // this + a x
  void add(Scalar a, const Packet& x) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) part_[k] += a * x.part_[k];
  }
  void subtract(Scalar a, const Packet& x) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) part_[k] -= a * x.part_[k];
  }

  // Rows of four packets become columns.
  static void transpose(Packet (&x)[4]) {
#if __has_builtin(__builtin_shufflevector)
    if constexpr (kRegisters == 1) {
      const Register a = x[0].part_[0], b = x[1].part_[0], c = x[2].part_[0], d = x[3].part_[0];
      const Register ab_02 = __builtin_shufflevector(a, b, 0, 4, 2, 6);
      const Register ab_13 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
      const Register cd_02 = __builtin_shufflevector(c, d, 0, 4, 2, 6);
      const Register cd_13 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
      x[0].part_[0] = __builtin_shufflevector(ab_02, cd_02, 0, 1, 4, 5);
      x[1].part_[0] = __builtin_shufflevector(ab_13, cd_13, 0, 1, 4, 5);
      x[2].part_[0] = __builtin_shufflevector(ab_02, cd_02, 2, 3, 6, 7);
      x[3].part_[0] = __builtin_shufflevector(ab_13, cd_13, 2, 3, 6, 7);
      return;
    }
#endif
    const auto at = [&](int column, int row) {
      if constexpr (kRegisters == 4) {
        return x[column].part_[row];
      } else {
        return x[column].part_[row * kRegisters / 4][row % (4 / kRegisters)];
      }
    };
    const Packet r0(at(0, 0), at(1, 0), at(2, 0), at(3, 0)),
        r1(at(0, 1), at(1, 1), at(2, 1), at(3, 1)), r2(at(0, 2), at(1, 2), at(2, 2), at(3, 2)),
        r3(at(0, 3), at(1, 3), at(2, 3), at(3, 3));
    x[0] = r0, x[1] = r1, x[2] = r2, x[3] = r3;
  }

 private:
  using Register = typename detail::Register<Scalar, kSimd, kBytes>::Type;
  Register part_[kRegisters] = {};
};

}  // namespace tensegrity
