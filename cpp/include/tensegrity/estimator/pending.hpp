// Measurements that came before the IMU sample that reaches their stamp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "tensegrity/robot/prism.hpp"

namespace tensegrity {

using Nanoseconds = std::int64_t;

// From one stamp to another [s].
template <typename Scalar>
Scalar seconds(Nanoseconds from, Nanoseconds to) {
  return Scalar(to - from) * Scalar(1e-9);
}

template <typename Scalar>
struct PendingMeasurement {
  enum class Kind : std::uint8_t { kContacts, kCables };  // at equal stamps contacts go first
  Nanoseconds t = 0;
  Kind kind = Kind::kContacts;
  CableLengths<Scalar> lengths = CableLengths<Scalar>::Zero();
  std::array<bool, 6> flags{};

  bool before(const PendingMeasurement& other) const {
    return t != other.t ? t < other.t : kind < other.kind;
  }
};

// Sorted by stamp, bounded. When it is full (the IMU has been silent) the oldest entry goes.
template <typename Scalar, std::size_t Capacity = 16>
class PendingQueue {
 public:
  using Item = PendingMeasurement<Scalar>;

  // Returns false when the oldest entry had to go to make room.
  bool push(const Item& item) {
    const bool full = size_ == Capacity;
    if (full) pop();
    std::size_t i = size_++;
    for (; i > 0 && item.before(items_[i - 1]); --i) items_[i] = items_[i - 1];
    items_[i] = item;
    return !full;
  }
  bool empty() const { return size_ == 0; }
  const Item& front() const { return items_[0]; }
  void pop() {
    for (std::size_t i = 1; i < size_; ++i) items_[i - 1] = items_[i];
    --size_;
  }

 private:
  std::array<Item, Capacity> items_{};
  std::size_t size_ = 0;
};

}  // namespace tensegrity
