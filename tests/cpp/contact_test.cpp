#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <limits>
#include <random>

#include "tensegrity/contact/detector.hpp"
#include "tensegrity/math/so3.hpp"

namespace {

using tensegrity::Endcaps;
using tensegrity::Prism;
using tensegrity::Vector;
using tensegrity::Vector3;
using tensegrity::contact::barycentric;
using tensegrity::contact::Detector;
using tensegrity::contact::load_share;
using tensegrity::contact::lowest_first;
using tensegrity::contact::support_shares;

using Flags = std::array<bool, 6>;
constexpr Flags kFace035{{true, false, false, true, false, true}};

// The undeformed robot at rest on endcaps 0, 3 and 5; world, z up [m].
template <typename Scalar>
Endcaps<Scalar> on_face_035() {
  const Endcaps<Scalar> q = Prism<Scalar>().undeformed();
  Vector3<Scalar> up = (q.col(3) - q.col(0)).cross(q.col(5) - q.col(0)).normalized();
  if (up.dot(q.rowwise().mean() - q.col(0)) < 0) up = -up;
  return tensegrity::shortest_rotation<Scalar>(up, Vector3<Scalar>::UnitZ()) * q;
}

// Any six points about the size of the robot.
template <typename Scalar>
Endcaps<Scalar> scattered(std::mt19937& random) {
  std::uniform_real_distribution<double> coordinate(-0.7, 0.7);
  return Endcaps<Scalar>::NullaryExpr([&] { return Scalar(coordinate(random)); });
}

template <typename Scalar>
void check_same(const Detector<Scalar>& a, const Detector<Scalar>& b, Scalar tolerance) {
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(std::abs(a.probability()[i] - b.probability()[i]) < tolerance);
  }
}

}  // namespace

TEST_CASE_TEMPLATE("barycentric coordinates sum to one and reproduce the point", Scalar, double,
                   float) {
  const Scalar tolerance = 2000 * std::numeric_limits<Scalar>::epsilon();
  using Point = Vector<Scalar, 2>;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  const auto draw = [&] { return Point(Scalar(coordinate(random)), Scalar(coordinate(random))); };
  for (int trial = 0; trial < 200; ++trial) {
    const Point a = draw(), b = draw(), c = draw(), p = draw();
    const Point ab = b - a, ac = c - a;
    if (std::abs(ab.x() * ac.y() - ab.y() * ac.x()) < Scalar(0.05)) continue;
    const Vector3<Scalar> s = barycentric<Scalar>(a, b, c, p);
    CHECK(std::abs(s.sum() - 1) < tolerance);
    CHECK((s[0] * a + s[1] * b + s[2] * c - p).norm() < tolerance);
    CHECK((barycentric<Scalar>(a, b, c, a) - Vector3<Scalar>::UnitX()).norm() < tolerance);
    CHECK((barycentric<Scalar>(a, b, c, b) - Vector3<Scalar>::UnitY()).norm() < tolerance);
    CHECK((barycentric<Scalar>(a, b, c, c) - Vector3<Scalar>::UnitZ()).norm() < tolerance);
  }
}

TEST_CASE("a triangle without area shares the weight evenly") {
  using Point = Vector<double, 2>;
  const Point a(0, 0), b(1, 1), c(2, 2), p(0.3, 0.9);
  CHECK(barycentric<double>(a, b, c, p).isApprox(Vector3<double>::Constant(1.0 / 3)));
  CHECK(barycentric<double>(a, a, a, p).isApprox(Vector3<double>::Constant(1.0 / 3)));
}

TEST_CASE("endcaps are ordered by height, ties by number") {
  Endcaps<double> q = Endcaps<double>::Zero();
  q.row(2) << 0.5, 0.1, 0.5, 0.0, 0.9, 0.1;
  CHECK(lowest_first(q) == std::array<int, 6>{{3, 1, 5, 0, 2, 4}});
}

TEST_CASE("known feet share the weight so that its moments are in equilibrium") {
  std::mt19937 random(7);
  for (int trial = 0; trial < 200; ++trial) {
    const Endcaps<double> q = scattered<double>(random);
    const std::array<int, 6> order = lowest_first(q);
    const Vector<double, 2> centre = q.topRows<2>().rowwise().mean();
    for (std::size_t feet = 0; feet <= 6; ++feet) {
      // Any feet: the last `feet` of the order, so that higher ones are among them.
      Flags loaded{};
      for (std::size_t k = 6 - feet; k < 6; ++k) loaded[std::size_t(order[k])] = true;
      const double no_least = -std::numeric_limits<double>::infinity();
      const std::array<double, 6> share = support_shares(q, loaded, no_least);

      double sum = 0;
      Vector<double, 2> moment = Vector<double, 2>::Zero();  // turned by 90 degrees
      std::size_t standing = 0;
      for (std::size_t i = 0; i < 6; ++i) {
        if (!loaded[i]) CHECK(share[i] == 0);
        if (share[i] != 0) ++standing;
        sum += share[i];
        moment += share[i] * (q.col(Eigen::Index(i)).head<2>() - centre);
      }
      if (feet == 0) {
        CHECK(sum == 0);
        continue;
      }
      CHECK(sum == doctest::Approx(1));
      CHECK(standing <= 3);
      // Of more than three the lowest three.
      for (std::size_t k = 6 - feet + 3; k < 6; ++k) CHECK(share[std::size_t(order[k])] == 0);
      if (feet == 1) CHECK(share[std::size_t(order[5])] == 1);
      if (feet == 2) {  // a lever balances along itself
        const Vector<double, 2> lever = (q.col(order[5]) - q.col(order[4])).head<2>().normalized();
        CHECK(std::abs(lever.dot(moment)) < 1e-9);
      }
      if (feet >= 3 && share[std::size_t(order[6 - feet])] != 1.0 / 3) {  // no degenerate triangle
        CHECK(moment.norm() < 1e-9);
      }
    }
  }
}

TEST_CASE("no foot carries less than the least share, and the rest keep their ratio") {
  std::mt19937 random(9);
  for (int trial = 0; trial < 200; ++trial) {
    const Endcaps<double> q = scattered<double>(random);
    const std::array<int, 6> order = lowest_first(q);
    Flags loaded{};
    for (std::size_t k = 0; k < 3; ++k) loaded[std::size_t(order[k])] = true;
    const Vector3<double> free = load_share(q, order);
    const Vector3<double> bounded = free.cwiseMax(0.01);
    const std::array<double, 6> share = support_shares(q, loaded, 0.01);
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(share[std::size_t(order[k])] ==
            doctest::Approx(bounded[Eigen::Index(k)] / bounded.sum()));
    }
  }
}

TEST_CASE("two feet on top of each other still share the whole weight") {
  Endcaps<double> q = on_face_035<double>();
  q.col(3).head<2>() = q.col(0).head<2>();
  const std::array<double, 6> share =
      support_shares(q, Flags{{true, false, false, true, false, false}}, 0.01);
  CHECK(share[0] + share[3] == doctest::Approx(1));
}

TEST_CASE_TEMPLATE("a robot at rest on a face stands on exactly its three feet", Scalar, double,
                   float) {
  const Endcaps<Scalar> q = on_face_035<Scalar>();
  const Vector3<Scalar> share = load_share(q, lowest_first(q));
  CHECK(share.minCoeff() > 0);  // it does not tip
  Detector<Scalar> detector{Prism<Scalar>()};
  CHECK(detector.update(q, Scalar(0)) == kFace035);  // at once
  for (int k = 0; k < 500; ++k) REQUIRE(detector.update(q, Scalar(0.01)) == kFace035);
}

TEST_CASE_TEMPLATE("an endcap lifted off the ground is let go, at any rate of updates alike",
                   Scalar, double, float) {
  const Endcaps<Scalar> down = on_face_035<Scalar>();
  // About the edge (0, 3) until endcap 5 is 0.4 m up.
  const Vector3<Scalar> edge = (down.col(3) - down.col(0)).normalized();
  const Scalar side = edge.cross(down.col(5) - down.col(0)).z() > 0 ? Scalar(1) : Scalar(-1);
  const Eigen::AngleAxis<Scalar> tip(Scalar(0.5) * side, edge);
  const Endcaps<Scalar> up =
      (tip.toRotationMatrix() * (down.colwise() - down.col(0))).colwise() + down.col(0);
  REQUIRE(up(2, 5) - up(2, 0) > Scalar(0.3));

  const auto release = [&](Scalar dt) {  // [s]
    Detector<Scalar> detector{Prism<Scalar>()};
    for (Scalar standing = 0; standing < 1; standing += dt) detector.update(down, dt);
    REQUIRE(detector.loaded()[5]);
    Scalar time = 0;
    while (detector.update(up, dt)[5] && time < 1) time += dt;
    return time;
  };
  const Scalar at_200_hz = release(Scalar(0.005));
  CHECK(at_200_hz < Scalar(0.2));
  CHECK(std::abs(release(Scalar(0.01)) - at_200_hz) <= Scalar(0.0151));
  CHECK(std::abs(release(Scalar(0.001)) - at_200_hz) <= Scalar(0.0051));
}

TEST_CASE_TEMPLATE("only what the ground sees matters: heading, place and handedness do not",
                   Scalar, double, float) {
  const Scalar tolerance = std::is_same_v<Scalar, double> ? Scalar(1e-9) : Scalar(2e-2);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  const Prism<Scalar> robot;
  Detector<Scalar> plain(robot), turned(robot), moved(robot), mirrored(robot);
  for (int k = 0; k < 100; ++k) {
    const Endcaps<Scalar> q = scattered<Scalar>(random);
    const Scalar dt = Scalar(0.01);
    plain.update(q, dt);
    const Eigen::AngleAxis<Scalar> yaw(Scalar(angle(random)), Vector3<Scalar>::UnitZ());
    turned.update(yaw.toRotationMatrix() * q, dt);
    check_same(plain, turned, tolerance);
    moved.update(q.colwise() + Vector3<Scalar>(3, -5, 1), dt);
    check_same(plain, moved, tolerance);
    mirrored.update(Vector3<Scalar>(1, -1, 1).asDiagonal() * q, dt);
    check_same(plain, mirrored, tolerance);
  }
}

TEST_CASE_TEMPLATE("bad input keeps the last decision, and nothing becomes NaN", Scalar, double,
                   float) {
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  const Scalar infinity = std::numeric_limits<Scalar>::infinity();
  const Endcaps<Scalar> good = on_face_035<Scalar>();
  Detector<Scalar> detector{Prism<Scalar>()};

  Endcaps<Scalar> bad = good;
  bad(0, 4) = nan;
  CHECK(detector.update(bad, Scalar(0.01)) == Flags{});  // nothing is known yet
  REQUIRE(detector.update(good, Scalar(0.01)) == kFace035);
  const auto before = detector.probability();

  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 6; ++col) {
      for (const Scalar value : {nan, infinity, -infinity}) {
        bad = good;
        bad(row, col) = value;
        CHECK(detector.update(bad, Scalar(0.01)) == kFace035);
      }
    }
  }
  for (const Scalar dt : {nan, Scalar(-1), -infinity}) {
    CHECK(detector.update(good.colwise().reverse(), dt) == kFace035);
  }
  CHECK(detector.probability() == before);

  // Finite but absurd: anything may be decided, but with probabilities.
  const Scalar huge = std::numeric_limits<Scalar>::max();
  for (const Scalar scale : {huge, huge / 4, std::sqrt(huge), Scalar(0)}) {
    detector.update(good * scale, Scalar(0.01));
    for (const Scalar p : detector.probability()) CHECK((p > 0 && p < 1));
  }
  detector.update(good, infinity);  // an endless pause: what was known before is void
  for (const Scalar p : detector.probability()) CHECK((p > 0 && p < 1));
  CHECK(detector.update(good, Scalar(1)) == kFace035);
}

TEST_CASE("after a reset a detector is as new") {
  std::mt19937 random(8);
  Detector<double> used{Prism<double>()}, fresh{Prism<double>()};
  for (int k = 0; k < 20; ++k) used.update(scattered<double>(random), 0.01);
  used.reset();
  CHECK(used.loaded() == Flags{});
  const Endcaps<double> q = scattered<double>(random);
  CHECK(used.update(q, 0.01) == fresh.update(q, 0.01));
  CHECK(used.probability() == fresh.probability());
}

TEST_CASE("contact sensors are evidence: their odds add up, and enough of them outvote geometry") {
  const double log_odds = std::log(9.0);  // wrong in 10 %
  const auto odds = [](double p) { return std::log(p / (1 - p)); };
  Detector<double> detector{Prism<double>()};
  const Endcaps<double> q = on_face_035<double>();
  detector.update(q, 0.01);
  const auto before = detector.probability();
  const Flags wrong{{false, true, false, true, false, true}};
  detector.measure(wrong, log_odds);
  for (std::size_t i = 0; i < 6; ++i) {
    const double added = odds(detector.probability()[i]) - odds(before[i]);
    CHECK(added == doctest::Approx(wrong[i] ? log_odds : -log_odds));
    CHECK(detector.loaded()[i] == (detector.probability()[i] > 0.5));
  }
  for (int k = 0; k < 20; ++k) {
    detector.update(q, 0.005);
    detector.measure(wrong, log_odds);
  }
  CHECK(detector.loaded() == wrong);
  // One sensor that lies now and then does not.
  detector.reset();
  for (int k = 0; k < 400; ++k) {
    detector.update(q, 0.005);
    Flags flags = kFace035;
    if (k % 10 == 9) flags[0] = false;
    detector.measure(flags, log_odds);
    if (k > 20) REQUIRE(detector.loaded() == kFace035);
  }
}
