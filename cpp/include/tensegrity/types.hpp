// Fixed-size types shared by every part of the library.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

namespace tensegrity {

template <typename Scalar>
using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
template <typename Scalar>
using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;
template <typename Scalar, int N>
using Vector = Eigen::Matrix<Scalar, N, 1>;
template <typename Scalar, int Rows, int Cols = Rows>
using Matrix = Eigen::Matrix<Scalar, Rows, Cols>;

// What a call did with its input. Nothing in the hot path throws: whatever is returned here, the
// object that was called holds a valid, finite state.
enum class Status : std::uint8_t {
  kOk = 0,
  kNotInitialized,  // the call needs a state that is not there yet; nothing was done
  kNotFinite,       // NaN or infinity in the input; the input was dropped
  kOutOfRange,      // finite but physically impossible (a negative length); the input was dropped
  kDuplicate,       // a stamp that was seen before; the input was dropped
  kOutOfOrder,      // a stamp before the newest one of its kind; the input was dropped
  kTooLate,         // older than `max_latency`; the input was dropped
  kGap,             // samples were missing before this one; it was used, uncertainty was widened
  kRejected,        // the innovation failed the chi-square gate; the input was dropped
  kNotConverged,    // the iteration limit was reached; the best iterate is kept
  kWrongChirality,  // only mirror images or crossing rods fit the lengths; the state is unchanged
};

// True for outcomes after which the input has become part of the state.
constexpr bool used(Status status) { return status == Status::kOk || status == Status::kGap; }

constexpr const char* to_string(Status status) {
  switch (status) {
    case Status::kOk:
      return "ok";
    case Status::kNotInitialized:
      return "not_initialized";
    case Status::kNotFinite:
      return "not_finite";
    case Status::kOutOfRange:
      return "out_of_range";
    case Status::kDuplicate:
      return "duplicate";
    case Status::kOutOfOrder:
      return "out_of_order";
    case Status::kTooLate:
      return "too_late";
    case Status::kGap:
      return "gap";
    case Status::kRejected:
      return "rejected";
    case Status::kNotConverged:
      return "not_converged";
    case Status::kWrongChirality:
      return "wrong_chirality";
  }
  return "unknown";
}

}  // namespace tensegrity
