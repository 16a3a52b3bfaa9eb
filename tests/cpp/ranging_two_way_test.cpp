// Two-way ranging from counters of real clocks, and the range model against finite differences.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "tensegrity/ranging/range_model.hpp"
#include "tensegrity/ranging/two_way.hpp"

namespace {

using namespace tensegrity::ranging;
using tensegrity::Status;
using V3 = tensegrity::Vector3<double>;

// Stamps are rounded to a tick of 4.7 mm; three are received, so a range is within three halves.
constexpr double kTickMetres = kSpeedOfLight * kTickSeconds;
constexpr double kRounding = 1.5 * kTickMetres;

// A counter that started somewhere and runs `drift` fast, which may change by `aging` per second.
struct Clock {
  double drift = 0;
  double start_s = 0;
  double aging = 0;

  std::uint64_t at(double time) const {
    const long double local = start_s + time * (1 + drift) + aging / 2 * time * time;
    return static_cast<std::uint64_t>(std::llround(local / kTickSeconds)) & kCounterMask;
  }
};

// One exchange over a distance that changes at `speed`; the responder waits `first_reply`, the
// other `second_reply` [s].
struct Exchange {
  double distance = 7.3;
  double first_reply = 1e-3;
  double second_reply = 1e-3;
  double speed = 0;
  Clock starter;
  Clock responder;

  double flight(double time) const { return (distance + speed * time) / kSpeedOfLight; }

  TwoWayStamps stamps(double t = 0.5) const {
    const double sp = t, rp = sp + flight(sp);
    const double sr = rp + first_reply, rr = sr + flight(sr);
    const double sf = rr + second_reply, rf = sf + flight(sf);
    return {starter.at(sp), responder.at(rp), responder.at(sr),
            starter.at(rr), starter.at(sf),   responder.at(rf)};
  }
};

}  // namespace

TEST_CASE_TEMPLATE("two-way ranging: the distance, whatever the clocks", Scalar, double, float) {
  for (const double drift : {-40e-6, 0.0, 35e-6}) {
    for (const double reply : {0.3e-3, 1e-3, 60e-3}) {
      for (const double distance : {0.0, 1.7, 42.0, 250.0}) {
        Exchange exchange;
        exchange.distance = distance;
        exchange.first_reply = reply;
        exchange.second_reply = 0.7 * reply;
        exchange.starter = {drift, 3.0};
        exchange.responder = {-drift / 2, 11.0};
        const TwoWayRange<Scalar> result = two_way_range<Scalar>(exchange.stamps());
        REQUIRE(result.status == Status::kOk);
        const double own_rate = std::abs(drift / 2) * distance;
        CHECK(std::abs(static_cast<double>(result.range) - distance) < kRounding + own_rate + 1e-4);
        CHECK(std::abs(static_cast<double>(result.drift) + 1.5 * drift) < 1e-7);
      }
    }
  }
}

TEST_CASE("two-way ranging: two packets alone would be off by the drift times the reply") {
  Exchange exchange;
  exchange.first_reply = 20e-3;
  exchange.starter.drift = 20e-6;
  const TwoWayStamps s = exchange.stamps();
  const double round = static_cast<double>(ticks_between(s.poll_sent, s.response_received));
  const double reply = static_cast<double>(ticks_between(s.poll_received, s.response_sent));
  const double two_packets = kTickMetres / 2 * (round - reply);
  CHECK(two_packets - exchange.distance ==
        doctest::Approx(kSpeedOfLight / 2 * 20e-3 * 20e-6).epsilon(1e-3));
  CHECK(std::abs(two_way_range<double>(s).range - exchange.distance) < kRounding);
}

TEST_CASE("two-way ranging: a rate that changes during the exchange") {
  Exchange exchange;
  exchange.first_reply = exchange.second_reply = 30e-3;
  exchange.responder.aging = 2e-6;
  const double shift = kSpeedOfLight / 4 * 2e-6 * 30e-3 * 30e-3;  // v/4 s d (a - d)
  REQUIRE(shift > 5 * kRounding);
  const double rate = 2e-6 * 0.5;  // of the clock, after 0.5 s of aging
  CHECK(std::abs(two_way_range<double>(exchange.stamps()).range - exchange.distance - shift) <
        kRounding + rate);
}

TEST_CASE("two-way ranging: noise of the receive stamps") {
  const double sigma = 30;  // [ticks]
  Exchange exchange;
  exchange.first_reply = 1e-3;
  exchange.second_reply = 3e-3;
  const TwoWayStamps exact = exchange.stamps();
  const double p = 0.75;
  const double expected = kTickMetres / 2 * sigma * std::sqrt(p * p + 1 + (1 - p) * (1 - p));
  std::mt19937 generator(1);
  std::normal_distribution<double> noise(0, sigma);
  double squares = 0;
  constexpr int kSamples = 4000;
  for (int k = 0; k < kSamples; ++k) {
    TwoWayStamps s = exact;
    for (std::uint64_t* stamp : {&s.poll_received, &s.response_received, &s.final_received}) {
      *stamp = (*stamp + static_cast<std::uint64_t>(std::llround(noise(generator)))) & kCounterMask;
    }
    const double error = two_way_range<double>(s).range - exchange.distance;
    squares += error * error;
  }
  CHECK(std::sqrt(squares / kSamples) == doctest::Approx(expected).epsilon(0.05));
}

TEST_CASE("two-way ranging: of a moving module the distance at the response") {
  Exchange exchange;
  exchange.speed = 5;
  exchange.first_reply = 12e-3;
  exchange.second_reply = 40e-3;
  const double at_response = exchange.distance + exchange.speed * (0.5 + 12e-3);
  CHECK(std::abs(two_way_range<double>(exchange.stamps()).range - at_response) < kRounding);
}

TEST_CASE("two-way ranging: counters wrap anywhere in the exchange") {
  const double turn = std::ldexp(kTickSeconds, 40);
  Exchange exchange;
  for (const double before : {0.0, 0.5e-3, 1.0e-3, 1.5e-3, 2.0e-3}) {
    exchange.starter.start_s = turn - 0.5 - before;
    exchange.responder.start_s = turn - 0.5 - before + 0.3e-3;
    const auto result = two_way_range<double>(exchange.stamps());
    REQUIRE(result.status == Status::kOk);
    CHECK(std::abs(result.range - exchange.distance) < kRounding);
  }
}

TEST_CASE("two-way ranging: impossible counters are refused") {
  const Exchange exchange;
  const TwoWayStamps good = exchange.stamps();
  REQUIRE(two_way_range<double>(good).status == Status::kOk);
  const auto refused = [](const TwoWayStamps& s) {
    const auto result = two_way_range<double>(s);
    return result.status == Status::kOutOfRange && result.range == 0;
  };
  SUBCASE("more than 40 bit") {
    TwoWayStamps s = good;
    s.response_sent |= std::uint64_t{1} << 40;
    CHECK(refused(s));
  }
  SUBCASE("packets out of order") {
    TwoWayStamps s = good;
    std::swap(s.poll_sent, s.final_sent);
    CHECK(refused(s));
    s = good;
    std::swap(s.poll_received, s.response_sent);
    CHECK(refused(s));
    s = good;
    std::swap(s.response_received, s.final_sent);
    CHECK(refused(s));
  }
  SUBCASE("nothing happened") { CHECK(refused(TwoWayStamps{})); }
  SUBCASE("clocks too far apart, an outdated stamp") {
    TwoWayStamps s = good;
    s.final_received += static_cast<std::uint64_t>(2e-3 * 2 * kLargestDrift / kTickSeconds);
    CHECK(refused(s));
  }
  SUBCASE("further away than the radio reaches") {
    Exchange far;
    far.distance = 1.1 * kLongestRange;
    CHECK(refused(far.stamps()));
  }
  SUBCASE("too long") {
    Exchange slow;
    slow.first_reply = kLongestExchangeSeconds;
    CHECK(refused(slow.stamps()));
  }
}

TEST_CASE("two-way ranging: any counters give a finite result and a status") {
  std::mt19937_64 generator(2);
  for (int k = 0; k < 20000; ++k) {
    TwoWayStamps s;
    const std::uint64_t mask = k % 2 == 0 ? kCounterMask : 0xffff;
    for (std::uint64_t* stamp : {&s.poll_sent, &s.poll_received, &s.response_sent,
                                 &s.response_received, &s.final_sent, &s.final_received}) {
      *stamp = generator() & mask;
    }
    const auto result = two_way_range<float>(s);
    REQUIRE((result.status == Status::kOk || result.status == Status::kOutOfRange));
    REQUIRE(std::abs(result.range) <= kLongestRange);
  }
}

TEST_CASE("range model: the module sits inside the rod's end") {
  const V3 end(1, 2, 3), far_end(1, 2, 4.7);
  CHECK((Module<double>(end, far_end, 0.1).position - V3(1, 2, 3.1)).norm() < 1e-15);
  const Module<double> here(end, far_end, 0.1), there(far_end, end, 0.1);
  CHECK(ModuleDistance<double>(here, there).distance == doctest::Approx(1.5));
  CHECK(AnchorDistance<double>(here, V3(1, 2, 0)).distance == doctest::Approx(3.1));
}

TEST_CASE("range model: points in one place leave everything finite") {
  const V3 here(1, 2, 3);
  const Module<double> squeezed(here, here, 0.1);
  CHECK(squeezed.position == here);
  const AnchorDistance<double> touching(squeezed, here);
  CHECK(touching.distance == 0);
  CHECK((touching.by_end.isZero() && touching.by_far_end.isZero() && touching.by_anchor.isZero()));
  CHECK(ModuleDistance<double>(squeezed, squeezed).by_second_end.isZero());
}

TEST_CASE("range model: derivatives against finite differences") {
  constexpr double kInset = 0.1, kStep = 1e-6, kError = 1e-9;
  std::srand(3);
  for (int trial = 0; trial < 20; ++trial) {
    // Columns: first end, its far end, second end, its far end, anchor.
    const Eigen::Matrix<double, 3, 5> points = Eigen::Matrix<double, 3, 5>::Random();
    const auto modules = [&](const Eigen::Matrix<double, 3, 5>& p) {
      return std::pair(Module<double>(p.col(0), p.col(1), kInset),
                       Module<double>(p.col(2), p.col(3), kInset));
    };
    const auto [first, second] = modules(points);
    const AnchorDistance<double> outside(first, points.col(4));
    const ModuleDistance<double> inside(first, second);
    Eigen::Matrix<double, 3, 5> by_outside, by_inside;
    by_outside << outside.by_end, outside.by_far_end, V3::Zero(), V3::Zero(), outside.by_anchor;
    by_inside << inside.by_first_end, inside.by_first_far_end, inside.by_second_end,
        inside.by_second_far_end, V3::Zero();
    for (int entry = 0; entry < 15; ++entry) {
      double distances[2][2];
      for (const int side : {0, 1}) {
        Eigen::Matrix<double, 3, 5> moved = points;
        moved(entry) += side == 0 ? -kStep : kStep;
        const auto [a, b] = modules(moved);
        distances[side][0] = AnchorDistance<double>(a, moved.col(4)).distance;
        distances[side][1] = ModuleDistance<double>(a, b).distance;
      }
      CHECK(std::abs((distances[1][0] - distances[0][0]) / (2 * kStep) - by_outside(entry)) <
            kError);
      CHECK(std::abs((distances[1][1] - distances[0][1]) / (2 * kStep) - by_inside(entry)) <
            kError);
    }
  }
}
