#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <limits>
#include <random>

#include "tensegrity/contact/detector.hpp"

namespace {

using tensegrity::Endcaps;
using tensegrity::Prism;
using tensegrity::Vector;
using tensegrity::Vector3;
using tensegrity::contact::barycentric;
using tensegrity::contact::Detector;
using tensegrity::contact::load_share;
using tensegrity::contact::lowest_first;

using Flags = std::array<bool, 6>;
constexpr Flags kFace035{{true, false, false, true, false, true}};

// The undeformed robot at rest on endcaps 0, 3 and 5; world, z up [m].
template <typename Scalar>
Endcaps<Scalar> on_face_035() {
  const Endcaps<Scalar> q = Prism<Scalar>().undeformed();
  Vector3<Scalar> up = (q.col(3) - q.col(0)).cross(q.col(5) - q.col(0)).normalized();
  if (up.dot(q.rowwise().mean() - q.col(0)) < 0) up = -up;
  const auto turn = Eigen::Quaternion<Scalar>::FromTwoVectors(up, Vector3<Scalar>::UnitZ());
  return turn.toRotationMatrix() * q;
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
    while (detector.probability()[5] < Scalar(0.99)) detector.update(down, dt);
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
