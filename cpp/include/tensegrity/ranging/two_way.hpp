// Symmetric double-sided two-way ranging: the distance of two radio modules from six timestamps.
//
// C = Caluwaerts et al. 2016, "State Estimation for Tensegrity Robots", §III-A. Module i polls, j
// responds, i sends the final packet, j knows all stamps (C Fig. 2):
//
//   i  SP ----------- RR --- SF ---        a = SF - SP, d = SF - RR  in ticks of i   (C eqs. 1, 4)
//        \          /          \           b = RF - RP, c = RF - SR  in ticks of j   (C eqs. 2, 3)
//   j     RP --- SR ------------ RF
//
// The clocks are not synchronized and run at different rates. b/a is the ratio of the rates, so
// c - d b/a is twice the time of flight in ticks of j (C eq. 5). In metres,
//
//   raw range = v/2 (c - d b/a) = distance + offset,  v = 299 792 458 m/s,          (C eqs. 6, 7)
//
// where the paper prints 1/(2 v) for v/2. The offset (antenna delays, some 3.9 m) stays in.
//
// What remains of errors, with p = d/a the share of the exchange after the response:
// - Drift: the ratio is measured, so a constant difference of the rates cancels, however long the
//   replies take. What is left is the rate of j against true time: 20 ppm of the range, 0.2 mm in
//   10 m. Two packets alone (SP, RP, SR, RR) would be off by v/2 (SR - RP) drift: 3 m per ms of
//   reply time and 20 ppm.
// - A rate that changes by s per second while the packets fly shifts the range by
//   v/4 s d (a - d): with s = 1e-7 1/s it is 0.03 mm in 2 ms exchanges, 7 mm in 60 ms ones.
// - Noise sigma of the receive stamps (RP, RR, RF): v/2 sigma sqrt(p^2 + 1 + (1 - p)^2), about
//   1.2 times v/2 sigma for p = 1/2.
// - Motion: the result is the distance at the moment of the response (SR), plus second differences
//   of the distance over the exchange.
#pragma once

#include <cmath>
#include <cstdint>

#include "tensegrity/types.hpp"

namespace tensegrity::ranging {

inline constexpr double kSpeedOfLight = 299'792'458.0;  // [m/s]
// Clock of the DWM1000: 128 x 499.2 MHz, 15.65 ps, in a counter of 40 bit that wraps every 17.2 s.
inline constexpr double kTickSeconds = 1.0 / (128 * 499.2e6);
inline constexpr std::uint64_t kCounterMask = (std::uint64_t{1} << 40) - 1;

// An exchange takes 3 ms pairwise and up to 60 ms with broadcasts (C §III-A). Packets stamped in
// the wrong order look like one of nearly 17.2 s.
inline constexpr double kLongestExchangeSeconds = 1.0;
// Of one clock against the other. IEEE 802.15.4 allows each 20 ppm; the rest is for temperature.
inline constexpr double kLargestDrift = 100e-6;
inline constexpr double kLongestRange = 300.0;  // of the radio [m]

// Counter values [ticks]: poll, response and final packet, sent and received, in order of time.
// SP, RR, SF are those of the module that starts, RP, SR, RF those of the one that responds.
struct TwoWayStamps {
  std::uint64_t poll_sent;          // SP
  std::uint64_t poll_received;      // RP
  std::uint64_t response_sent;      // SR
  std::uint64_t response_received;  // RR
  std::uint64_t final_sent;         // SF
  std::uint64_t final_received;     // RF
};

template <typename Scalar>
struct TwoWayRange {
  Status status;
  Scalar range;  // raw: distance + offset [m]; zero unless the status is kOk
  Scalar drift;  // rate of the responding clock over that of the other, minus one [1]
};

// Ticks from `earlier` to `later`, less than one turn of the counter apart.
constexpr std::uint64_t ticks_between(std::uint64_t earlier, std::uint64_t later) {
  return (later - earlier) & kCounterMask;
}

// C eq. 6. kOutOfRange: a counter of more than 40 bit, packets out of order, an exchange longer
// than kLongestExchangeSeconds, clocks further apart than kLargestDrift, or a range beyond
// kLongestRange in magnitude (antenna delays that are taken off in the module can leave it a little
// below zero).
template <typename Scalar>
TwoWayRange<Scalar> two_way_range(const TwoWayStamps& s) {
  constexpr TwoWayRange<Scalar> impossible{Status::kOutOfRange, Scalar(0), Scalar(0)};
  constexpr auto longest = static_cast<std::uint64_t>(kLongestExchangeSeconds / kTickSeconds);

  const std::uint64_t counters = s.poll_sent | s.poll_received | s.response_sent |
                                 s.response_received | s.final_sent | s.final_received;
  if (counters > kCounterMask) return impossible;
  const std::uint64_t a = ticks_between(s.poll_sent, s.final_sent);
  const std::uint64_t b = ticks_between(s.poll_received, s.final_received);
  const std::uint64_t c = ticks_between(s.response_sent, s.final_received);
  const std::uint64_t d = ticks_between(s.response_received, s.final_sent);
  if (a == 0 || a > longest || b > longest || c > b || d > a) return impossible;

  // c - d b/a as (c - d) - d (b - a)/a: the large numbers are subtracted as integers, so that
  // single precision suffices.
  const auto difference = [](std::uint64_t x, std::uint64_t y) {
    return static_cast<Scalar>(static_cast<std::int64_t>(x) - static_cast<std::int64_t>(y));
  };
  const Scalar drift = difference(b, a) / static_cast<Scalar>(a);
  const Scalar two_flights = difference(c, d) - static_cast<Scalar>(d) * drift;
  const Scalar range = Scalar(kSpeedOfLight * kTickSeconds / 2) * two_flights;
  if (std::abs(drift) > Scalar(kLargestDrift) || std::abs(range) > Scalar(kLongestRange)) {
    return impossible;
  }
  return {Status::kOk, range, drift};
}

}  // namespace tensegrity::ranging
