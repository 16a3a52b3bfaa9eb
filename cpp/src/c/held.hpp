// An estimator in the memory of a C program: which one it is, and what can be done with it.
#pragma once

#include <cstdint>
#include <new>

#include "convert.hpp"

namespace tensegrity::c {

// The calls of one method. A table of functions rather than a choice in every call: a program then
// links the methods that it creates, and no other.
struct Operations {
  void (*copy)(unsigned char* to, const unsigned char* from);
  Status (*imu)(unsigned char* held, Nanoseconds t, const Vector3<Real>& gyro,
                const Vector3<Real>& accel);
  Status (*rod_imu)(unsigned char* held, Nanoseconds t, int rod, const Vector3<Real>& gyro,
                    const Vector3<Real>& accel);
  Status (*cables)(unsigned char* held, Nanoseconds t, const CableLengths<Real>& lengths);
  Status (*contacts)(unsigned char* held, Nanoseconds t, const std::array<bool, 6>& flags);
  bool (*initialized)(const unsigned char* held);
  void (*state)(const unsigned char* held, tensegrity_state& to);
};

// First in the memory of every estimator.
struct Header {
  std::uint32_t mark;  // kMark: there is an estimator; anything else: there is none
  const Operations* operations;
};

inline constexpr std::uint32_t kMark = 0x74656e73;            // "tens"
inline constexpr std::size_t kOffset = TENSEGRITY_ALIGNMENT;  // of the estimator proper
static_assert(sizeof(Header) <= kOffset);

inline bool aligned(const tensegrity_estimator* estimator) {
  return reinterpret_cast<std::uintptr_t>(estimator) % TENSEGRITY_ALIGNMENT == 0;
}

inline void write_header(tensegrity_estimator* estimator, const Operations& operations) {
  new (estimator->bytes) Header{kMark, &operations};
}

// The table of `Estimator`, a PrismEstimator.
template <typename Estimator>
struct Held {
  static Estimator& in(unsigned char* held) {
    return *std::launder(reinterpret_cast<Estimator*>(held));
  }
  static const Estimator& in(const unsigned char* held) {
    return *std::launder(reinterpret_cast<const Estimator*>(held));
  }

  static constexpr Operations operations{
      [](unsigned char* to, const unsigned char* from) { new (to) Estimator(in(from)); },
      [](unsigned char* held, Nanoseconds t, const Vector3<Real>& gyro,
         const Vector3<Real>& accel) { return in(held).imu(t, gyro, accel); },
      [](unsigned char* held, Nanoseconds t, int rod, const Vector3<Real>& gyro,
         const Vector3<Real>& accel) { return in(held).rod_imu(t, rod, gyro, accel); },
      [](unsigned char* held, Nanoseconds t, const CableLengths<Real>& lengths) {
        return in(held).cables(t, lengths);
      },
      [](unsigned char* held, Nanoseconds t, const std::array<bool, 6>& flags) {
        return in(held).contacts(t, flags);
      },
      [](const unsigned char* held) { return in(held).initialized(); },
      [](const unsigned char* held, tensegrity_state& to) { to_c(in(held).state(), to); }};

  static tensegrity_status create(tensegrity_estimator* estimator, const tensegrity_robot* robot,
                                  const tensegrity_config* config) {
    static_assert(kOffset + sizeof(Estimator) <= TENSEGRITY_ESTIMATOR_SIZE,
                  "raise TENSEGRITY_ESTIMATOR_SIZE");
    static_assert(alignof(Estimator) <= TENSEGRITY_ALIGNMENT, "raise TENSEGRITY_ALIGNMENT");
    if (estimator == nullptr || robot == nullptr || config == nullptr) {
      return TENSEGRITY_NULL_ARGUMENT;
    }
    if (!aligned(estimator)) return TENSEGRITY_MISALIGNED;
    tensegrity_status status = check(*robot);
    if (status == TENSEGRITY_OK) status = check(*config);
    if (status != TENSEGRITY_OK) return status;
    new (estimator->bytes + kOffset) Estimator(to_cpp(*robot), to_cpp(*config));
    write_header(estimator, operations);
    return TENSEGRITY_OK;
  }
};

}  // namespace tensegrity::c
