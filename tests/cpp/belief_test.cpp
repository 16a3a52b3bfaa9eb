// Beliefs go back to how they were constructed.
#include <doctest/doctest.h>

#include "tensegrity/inekf/belief.hpp"
#include "tight_samples.hpp"

using tensegrity::Prism;

TEST_CASE("a belief of the tightly coupled filter is new after a reset") {
  using namespace tensegrity::tight::test;
  const Prism<double> robot;
  B belief = Samples(1).belief(robot);
  belief.rate.setOnes();
  belief.reset();
  const B fresh(robot);
  CHECK(belief.base == fresh.base);
  CHECK(belief.rate == fresh.rate);
  CHECK(difference(belief, fresh).norm() == 0);
  CHECK(belief.covariance == fresh.covariance);
  CHECK(fresh.rotation.isIdentity(0));
  CHECK(fresh.covariance.isZero(0));
}

TEST_CASE("a belief of the loosely coupled filter is new after a reset") {
  using Belief = tensegrity::inekf::Belief<double, 1>;
  Belief belief;
  belief.rotation.setRandom();
  for (auto* vector : {&belief.velocity, &belief.position, &belief.gyro_bias, &belief.accel_bias}) {
    vector->setRandom();
  }
  belief.extra.setRandom();
  belief.anchors.setRandom();
  belief.anchor_ids.fill(3);
  belief.anchor_count = 2;
  belief.covariance.setRandom();
  belief.reset();
  CHECK(belief.rotation.isIdentity(0));
  for (auto* vector : {&belief.velocity, &belief.position, &belief.gyro_bias, &belief.accel_bias}) {
    CHECK(vector->isZero(0));
  }
  CHECK(belief.extra.isZero(0));
  CHECK(belief.anchors.isZero(0));
  CHECK(belief.anchor_ids == std::array<int, 6>{});
  CHECK(belief.anchor_count == 0);
  CHECK(belief.covariance.isZero(0));
}
