#include <doctest/doctest.h>

#include "tensegrity/estimator/activity.hpp"

using tensegrity::Activity;
using V3 = tensegrity::Vector3<double>;

TEST_CASE("activity: zero at rest, one from the declared force or rate on, the sum between") {
  const V3 rest(0, 0, 9.81), none = V3::Zero();
  const auto level = [](const V3& rate, const V3& force) {
    Activity<double> activity(4, 2);
    activity.update(rate, force, 9.81, 0.005);
    return activity.level();
  };
  CHECK(Activity<double>(4, 2).level() == 0);
  CHECK(level(none, rest) == 0);
  CHECK(level(none, V3(9.81, 0, 0)) == 0);  // whichever way up
  CHECK(level(V3(0, 0.5, 0), rest) == doctest::Approx(0.25));
  CHECK(level(none, V3(0, 0, 10.81)) == doctest::Approx(0.25));
  CHECK(level(none, V3(0, 0, 8.81)) == doctest::Approx(0.25));
  CHECK(level(V3(0, 0.5, 0), V3(0, 0, 10.81)) == doctest::Approx(0.5));
  CHECK(level(V3(9, 0, 0), rest) == 1);
  CHECK(level(none, none) == 1);  // free fall
}

TEST_CASE("activity: rises at once and is forgotten, at any rate of samples alike") {
  const V3 rest(0, 0, 9.81), none = V3::Zero();
  const auto after = [&](double time, int samples) {
    Activity<double> activity(4, 2);
    activity.update(none, none, 9.81, 0.005);
    for (int k = 0; k < samples; ++k) activity.update(none, rest, 9.81, time / samples);
    return activity.level();
  };
  CHECK(after(0.02, 1) == doctest::Approx(after(0.02, 20)));
  CHECK(after(0.02, 1) > after(0.05, 1));
  CHECK(after(2, 1) < 1e-6);
}
