// Four consecutive numbers of a column, in SIMD registers where the processor has them.
//
// Written with the vector types of GCC and Clang: they stay in registers from the first load to the
// last store, where an Eigen array of four goes through memory after every expression. Processors
// without such registers get the four scalar operations.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>

// Before a function that runs all the time: it takes in all that it calls, so that what these hand
// on stays in registers. Not where code has to be small, as where there is no SIMD.
#ifdef EIGEN_VECTORIZE
#define TENSEGRITY_FLATTEN __attribute__((flatten))
#else
#define TENSEGRITY_FLATTEN
#endif

// Before a function that is large and called once: what it returns stays in registers. Where there
// are none for that the compiler decides.
#ifdef EIGEN_VECTORIZE
#define TENSEGRITY_INLINE EIGEN_ALWAYS_INLINE
#else
#define TENSEGRITY_INLINE inline
#endif

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
  // The same anywhere in an array of numbers.
  typedef Scalar Unaligned __attribute__((vector_size(Bytes), aligned(alignof(Scalar)), may_alias));
  static Type load(const Scalar* at) { return *reinterpret_cast<const Unaligned*>(at); }
  static void store(Scalar* at, const Type& x) { *reinterpret_cast<Unaligned*>(at) = x; }
};
template <typename Scalar, int Bytes>
struct Register<Scalar, false, Bytes> {
  using Type = Scalar;
  static Type load(const Scalar* at) { return *at; }
  static void store(Scalar* at, Type x) { *at = x; }
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
  // So many packets can be held at once beside what a loop reads: of sixteen registers, or more.
  static constexpr int kHeld = kSimd ? 12 / kRegisters : 4;

  Packet() = default;
  explicit Packet(const Scalar* rows) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) part_[k] = InMemory::load(rows + k * 4 / kRegisters);
  }
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

  // Three numbers, and a zero.
  template <typename Derived>
  explicit Packet(const Eigen::MatrixBase<Derived>& v) : Packet(v[0], v[1], v[2], v[2]) {
    static_assert(Derived::SizeAtCompileTime == 3, "a vector of three");
    clear_fourth();
  }

  void store(Scalar* rows) const {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) InMemory::store(rows + k * 4 / kRegisters, part_[k]);
  }

  // Stays in its registers: GCC would read it again from memory for every use, and loads, not
  // arithmetic, would then set the pace.
  void hold() {
#if defined(__AVX__)
    for (int k = 0; k < kRegisters; ++k) asm("" : "+x"(part_[k]));
#endif
  }

  // Numbers that stay what they are: of a factor and a zero GCC would make a packet by moving a
  // register in a way that Valgrind 3.19 does not know.
  static Packet constant(Scalar a, Scalar b, Scalar c, Scalar d) {
    Packet x(a, b, c, d);
    x.hold();
    return x;
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

  // Number by number.
  void add(const Packet& a, const Packet& x) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) part_[k] += a.part_[k] * x.part_[k];
  }
  void subtract(const Packet& a, const Packet& x) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) part_[k] -= a.part_[k] * x.part_[k];
  }

  friend Packet operator*(Scalar a, Packet x) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) x.part_[k] *= a;
    return x;
  }
  friend Packet operator*(Packet x, const Packet& y) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) x.part_[k] *= y.part_[k];
    return x;
  }
  friend Packet operator+(Packet x, const Packet& y) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) x.part_[k] += y.part_[k];
    return x;
  }
  friend Packet operator-(Packet x, const Packet& y) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) x.part_[k] -= y.part_[k];
    return x;
  }

  friend Packet operator/(Scalar a, Packet x) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) x.part_[k] = a / x.part_[k];
    return x;
  }

  // Four times the same number.
  static Packet all(Scalar a) { return {a, a, a, a}; }

  static Packet sqrt(const Packet& x) {
    // Eigen's does not set errno, for which the standard's leaves the registers.
    using Four = Eigen::Array<Scalar, 4, 1>;
    Four numbers;
    x.store(numbers.data());
    numbers = numbers.sqrt().eval();
    return Packet(numbers.data());
  }

  // The numbers of `yes` where those of x are greater than `limit`, else those of `no`.
  static Packet where_greater(const Packet& x, Scalar limit, Packet yes, const Packet& no) {
#pragma GCC unroll 4
    for (int k = 0; k < kRegisters; ++k) {
      yes.part_[k] = x.part_[k] > limit ? yes.part_[k] : no.part_[k];
    }
    return yes;
  }

  // The first three numbers.
  template <typename Derived>
  void store_vector(Eigen::MatrixBase<Derived>& v) const {
    static_assert(Derived::SizeAtCompileTime == 3, "a vector of three");
    v.derived() << at(0), at(1), at(2);
  }

  // Of the first three numbers; the fourth becomes zero (or stays not finite).
  static Packet cross(const Packet& a, const Packet& b) {
#if __has_builtin(__builtin_shufflevector)
    if constexpr (kRegisters == 1) {
      const auto next = [](const Register& x) { return __builtin_shufflevector(x, x, 1, 2, 0, 3); };
      const Register u = a.part_[0], v = b.part_[0];
      Packet out;
      out.part_[0] = next(u * next(v) - next(u) * v);
      return out;
    }
#endif
    const Scalar x = a.at(0), y = a.at(1), z = a.at(2);
    return {y * b.at(2) - z * b.at(1), z * b.at(0) - x * b.at(2), x * b.at(1) - y * b.at(0),
            Scalar(0)};
  }

  // Of the first three numbers.
  static Scalar dot(const Packet& a, const Packet& b) {
    const Packet c = a * b;
    return c.at(0) + c.at(1) + c.at(2);
  }

  // As a blend of what is in a register: built with a zero GCC moves a register in a way that
  // Valgrind 3.19 does not know.
  void clear_fourth() {
#if __has_builtin(__builtin_shufflevector)
    if constexpr (kRegisters == 1) {
      hold();
      part_[0] = __builtin_shufflevector(part_[0], Register{}, 0, 1, 2, 4);
      return;
    }
#endif
    *this = Packet(at(0), at(1), at(2), Scalar(0));
  }

  // The number in `row`.
  Scalar at(int row) const {
    if constexpr (kRegisters == 4) {
      return part_[row];
    } else {
      return part_[row * kRegisters / 4][row % (4 / kRegisters)];
    }
  }

  // (x_A, x_B, x_C, x_D)
  template <int A, int B, int C, int D>
  static Packet permute(const Packet& x) {
#if __has_builtin(__builtin_shufflevector)
    if constexpr (kRegisters == 1) {
      Packet out;
      out.part_[0] = __builtin_shufflevector(x.part_[0], x.part_[0], A, B, C, D);
      return out;
    }
#endif
    return {x.at(A), x.at(B), x.at(C), x.at(D)};
  }

  // The first `Count` numbers of x, the others of y.
  template <int Count>
  static Packet first(const Packet& x, const Packet& y) {
#if __has_builtin(__builtin_shufflevector)
    if constexpr (kRegisters == 1) {
      Packet out;
      out.part_[0] =
          __builtin_shufflevector(x.part_[0], y.part_[0], Count > 0 ? 0 : 4, Count > 1 ? 1 : 5,
                                  Count > 2 ? 2 : 6, Count > 3 ? 3 : 7);
      return out;
    }
#endif
    return {Count > 0 ? x.at(0) : y.at(0), Count > 1 ? x.at(1) : y.at(1),
            Count > 2 ? x.at(2) : y.at(2), Count > 3 ? x.at(3) : y.at(3)};
  }

  // The first three numbers of x, and y's number in `Row`.
  template <int Row>
  static Packet with_fourth(const Packet& x, const Packet& y) {
#if __has_builtin(__builtin_shufflevector)
    if constexpr (kRegisters == 1) {
      Packet out;
      out.part_[0] = __builtin_shufflevector(x.part_[0], y.part_[0], 0, 1, 2, 4 + Row);
      return out;
    }
#endif
    return {x.at(0), x.at(1), x.at(2), y.at(Row)};
  }

  // Columns of a block of four by four become its rows.
  static void transpose(Packet& x0, Packet& x1, Packet& x2, Packet& x3) {
#if __has_builtin(__builtin_shufflevector)
    if constexpr (kRegisters == 1) {
      const Register a = x0.part_[0], b = x1.part_[0], c = x2.part_[0], d = x3.part_[0];
      const Register ab_02 = __builtin_shufflevector(a, b, 0, 4, 2, 6);
      const Register ab_13 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
      const Register cd_02 = __builtin_shufflevector(c, d, 0, 4, 2, 6);
      const Register cd_13 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
      x0.part_[0] = __builtin_shufflevector(ab_02, cd_02, 0, 1, 4, 5);
      x1.part_[0] = __builtin_shufflevector(ab_13, cd_13, 0, 1, 4, 5);
      x2.part_[0] = __builtin_shufflevector(ab_02, cd_02, 2, 3, 6, 7);
      x3.part_[0] = __builtin_shufflevector(ab_13, cd_13, 2, 3, 6, 7);
      return;
    }
#endif
    const Packet r0(x0.at(0), x1.at(0), x2.at(0), x3.at(0)),
        r1(x0.at(1), x1.at(1), x2.at(1), x3.at(1)), r2(x0.at(2), x1.at(2), x2.at(2), x3.at(2)),
        r3(x0.at(3), x1.at(3), x2.at(3), x3.at(3));
    x0 = r0, x1 = r1, x2 = r2, x3 = r3;
  }

 private:
  using InMemory = detail::Register<Scalar, kSimd, kBytes>;
  using Register = typename InMemory::Type;
  Register part_[kRegisters] = {};
};

// A matrix of three by three, a packet a column: products stay in registers.
template <typename Scalar>
using Block = std::array<Packet<Scalar>, 3>;

template <typename Derived, typename Scalar = typename Derived::Scalar>
Block<Scalar> to_block(const Eigen::MatrixBase<Derived>& m) {
  return {Packet<Scalar>(m.col(0)), Packet<Scalar>(m.col(1)), Packet<Scalar>(m.col(2))};
}
template <typename Scalar>
void store_block(const Block<Scalar>& block, Eigen::Matrix<Scalar, 3, 3>& m) {
  for (int k = 0; k < 3; ++k) {
    auto column = m.col(k);
    block[std::size_t(k)].store_vector(column);
  }
}

// M x, with x any three numbers.
template <typename Scalar, typename Three>
Packet<Scalar> multiply(const Block<Scalar>& m, const Three& x) {
  Packet<Scalar> sum = x[0] * m[0];
  sum.add(x[1], m[1]);
  sum.add(x[2], m[2]);
  return sum;
}

// Zeros in the packets from `rows` to `end`. GCC would call memset for them, which takes longer for
// arrays as short as these.
template <typename Scalar>
void set_zero(Scalar* rows, Scalar* end) {
  Packet<Scalar> zero;
  zero.hold();
  for (; rows != end; rows += 4) zero.store(rows);
}

}  // namespace tensegrity
