// What is above the diagonal of a loosely coupled filter's covariance is scratch.
#include <doctest/doctest.h>

#include <functional>
#include <random>
#include <vector>

#include "tensegrity/inekf/anchors.hpp"
#include "tensegrity/inekf/contact_kinematics.hpp"
#include "tensegrity/inekf/propagate.hpp"

namespace tensegrity::inekf {
namespace {

using B = Belief<double, 1>;

class Numbers {
 public:
  double operator()() { return distribution_(engine_); }
  Vector3<double> vector() {
    const double x = (*this)(), y = (*this)(), z = (*this)();
    return {x, y, z};
  }

 private:
  std::mt19937 engine_{7};
  std::uniform_real_distribution<double> distribution_{-1, 1};
};

B::Covariance lower(const B& belief) { return belief.covariance.triangularView<Eigen::Lower>(); }

void scribble(B& belief, Numbers& numbers) {
  for (int j = 0; j < belief.dim(); ++j) {
    for (int i = 0; i < j; ++i) belief.covariance(i, j) = 100 * numbers();
  }
}

Kinematics<double, 6, 1> kinematics(Numbers& numbers) {
  Kinematics<double, 6, 1> k;
  for (int i = 0; i < 6; ++i) {
    k.h.col(i) = numbers.vector() / 4;
    k.h_extra.middleRows<3>(3 * i) = Vector3<double>::UnitZ().cross(k.h.col(i));
  }
  k.variance = 1e-4;
  return k;
}

TEST_CASE("no function reads what is above the diagonal of the covariance") {
  Numbers numbers;
  const Kinematics<double, 6, 1> k = kinematics(numbers);
  const auto touch = [&k](int id) {
    return [&k, id](B& b) {
      CHECK(augment(b, id, Vector3<double>(k.h.col(id)),
                    Matrix<double, 3, 1>(k.h_extra.middleRows<3>(3 * id)), k.covariance(id, id)));
    };
  };
  const auto move = [](double radius) {
    return [radius](B& b) {
      propagate(b, {{0.3, -0.5, 0.2}, {0.2, 0.1, 9.8}}, 0.005, 9.81,
                ProcessNoise<double>{0.002, 0.04, 0.001, 0.001, 0.05}, Rolling<double>{radius},
                Vector<double, 1>(0.01));
    };
  };
  const auto correct = [&k](B& b) { correct_contacts(b, k, 0.0); };
  const auto leave = [](B& b) { marginalise(b, 1); };
  const std::vector<std::function<void(B&)>> steps = {
      move(0),  touch(0), move(0),  touch(3), touch(5),   move(0),  correct, move(0.02),
      correct,  move(0),  move(0),  leave,    move(0),    touch(3), leave,   correct,
      touch(1), touch(2), touch(5), move(0),  move(0.02), correct};

  B clean;
  clean.covariance.topLeftCorner<16, 16>().setIdentity();
  clean.covariance *= 0.01;
  B scribbled = clean;
  for (const auto& step : steps) {
    step(clean);
    scribble(scribbled, numbers);
    step(scribbled);
    CHECK(lower(scribbled) == lower(clean));
    CHECK(scribbled.rotation == clean.rotation);
    CHECK(scribbled.position == clean.position);
    const B::Covariance p = scribbled.complete_covariance();
    CHECK(p == p.transpose());
    CHECK(scribbled.position_covariance() == clean.position_covariance());
    CHECK(scribbled.velocity_covariance() == clean.velocity_covariance());
    CHECK(scribbled.rotation_covariance() == clean.rotation_covariance());
  }
}

}  // namespace
}  // namespace tensegrity::inekf
