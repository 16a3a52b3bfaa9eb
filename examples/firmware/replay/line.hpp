// One line of text with numbers, without the heap and without printf: newlib's printf of a float
// brings malloc and tens of kilobytes with it.
#pragma once

#include <cmath>
#include <cstdint>

namespace replay {

class Line {
 public:
  explicit Line(const char* text) { add(text); }

  Line& add(const char* text) {
    while (*text != '\0') put(*text++);
    return *this;
  }

  Line& add(std::uint32_t value) {
    char digits[10];
    int count = 0;
    do {
      digits[count++] = char('0' + value % 10);
      value /= 10;
    } while (value > 0);
    while (count > 0) put(digits[--count]);
    return *this;
  }

  // With six decimals. Beyond +-4294 or not finite: "nan".
  template <typename Scalar>
  Line& add_decimal(Scalar value) {
    if (!(std::abs(value) < Scalar(4294))) return add("nan");
    if (value < 0) put('-');
    const auto millionths = std::uint32_t(std::abs(value) * Scalar(1e6) + Scalar(0.5));
    add(millionths / 1000000);
    put('.');
    for (std::uint32_t unit = 100000; unit > 0; unit /= 10) {
      put(char('0' + millionths / unit % 10));
    }
    return *this;
  }

  Line& space() {
    put(' ');
    return *this;
  }

  // Ends the line and returns it.
  const char* end() {
    text_[size_++] = '\n';
    text_[size_] = '\0';
    return text_;
  }

 private:
  // What does not fit is cut off.
  void put(char c) {
    if (size_ < kCapacity) text_[size_++] = c;
  }

  static constexpr int kCapacity = 200;
  char text_[kCapacity + 2];  // newline and terminator
  int size_ = 0;
};

}  // namespace replay
