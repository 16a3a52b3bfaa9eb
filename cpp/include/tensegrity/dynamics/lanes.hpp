// One number of several simulations in one SIMD register.
//
// Written with the vector types of GCC and Clang: they stay in registers from the first load to the
// last store, where an Eigen array of the same size goes through memory after every expression,
// which takes the dynamics 1.4 times as long.
#pragma once

#include <Eigen/Core>

namespace tensegrity::dynamics {

template <typename Scalar>
struct Lanes {
#if EIGEN_MAX_STATIC_ALIGN_BYTES > 0
  static constexpr int kBytes = EIGEN_MAX_STATIC_ALIGN_BYTES;  // of a register
#else
  static constexpr int kBytes = 16;
#endif
  static constexpr int kCount = kBytes / int(sizeof(Scalar));

  typedef Scalar Vector __attribute__((vector_size(kBytes)));

  // One column is one Vector.
  using Buffer = Eigen::Array<Scalar, kCount, Eigen::Dynamic>;
  static Vector* data(Buffer& buffer) { return reinterpret_cast<Vector*>(buffer.data()); }

  static Vector fill(Scalar value) { return Vector{} + value; }
  static Vector max(const Vector& a, const Vector& b) { return a > b ? a : b; }
  static Vector min(const Vector& a, const Vector& b) { return a < b ? a : b; }
  static Vector positive(const Vector& a) { return max(a, Vector{}); }

  static bool any_negative(const Vector& a) {
    const auto negative = a < Vector{};
    bool any = false;
    for (int i = 0; i < kCount; ++i) any |= negative[i] != 0;
    return any;
  }

  // 1 / sqrt(a) for a > 0, to the last bits. In single precision Eigen refines the processor's
  // estimate, which is faster than root and division.
  static Vector inverse_sqrt(const Vector& a) {
    using Array = Eigen::Array<Scalar, kCount, 1>;
    Vector result;
    Eigen::Map<Array, Eigen::AlignedMax>(reinterpret_cast<Scalar*>(&result)) =
        Eigen::Map<const Array, Eigen::AlignedMax>(reinterpret_cast<const Scalar*>(&a)).rsqrt();
    return result;
  }
};

}  // namespace tensegrity::dynamics
