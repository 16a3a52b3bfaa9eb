// Strapdown integration against the integrals it stands for and against differences of itself.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "tensegrity/inekf/strapdown.hpp"

using tensegrity::SO3;

TEST_CASE_TEMPLATE("strapdown: R, v and p against Gamma, errors of the samples against differences",
                   Scalar, double, float) {
  using V3 = tensegrity::Vector3<Scalar>;
  using M3 = tensegrity::Matrix3<Scalar>;
  using tensegrity::inekf::ImuSample;
  const Scalar h = std::cbrt(std::numeric_limits<Scalar>::epsilon()), gravity = Scalar(9.81);
  const M3 start = SO3<Scalar>::Exp(V3(Scalar(0.3), Scalar(0.2), Scalar(-0.9))).matrix();
  const V3 v0(Scalar(0.4), Scalar(-0.2), Scalar(0.1)), p0(Scalar(0.5), Scalar(0.6), Scalar(-0.3));
  for (const double rate : {1e-4, 0.3, 1.6, 3.2, 30.0}) {
    const Scalar dt = Scalar(0.1);
    const ImuSample<Scalar> imu{Scalar(rate) * V3(Scalar(0.3), Scalar(0.5), Scalar(-0.8)),
                                V3(Scalar(0.7), Scalar(-1.2), Scalar(9.4))};
    struct End {
      M3 r;
      V3 v, p;
      tensegrity::inekf::Strapdown<Scalar> by;
    };
    const auto step = [&](const V3& gyro_error, const V3& accel_error) {
      End end{start, v0, p0, {}};
      end.by =
          integrate(end.r, end.v, end.p,
                    ImuSample<Scalar>{imu.gyro + gyro_error, imu.accel + accel_error}, dt, gravity);
      return end;
    };
    const End end = step(V3::Zero(), V3::Zero());
    const tensegrity::Gamma<Scalar> gamma(imu.gyro * dt);
    const V3 g(0, 0, -gravity);
    const Scalar rounding = 100 * std::numeric_limits<Scalar>::epsilon();
    CHECK((end.r - start * gamma.g0).norm() < rounding);
    CHECK((end.v - (v0 + start * gamma.g1 * imu.accel * dt + g * dt)).norm() < rounding);
    CHECK(
        (end.p - (p0 + v0 * dt + start * gamma.g2 * imu.accel * dt * dt + g * dt * dt / 2)).norm() <
        rounding);
    const auto column = [](const tensegrity::Block<Scalar>& block, int k) {
      V3 out;
      block[std::size_t(k)].store_vector(out);
      return out;
    };
    // Errors Xbar X^-1 of a mean that took a sample with an error zeta in its bias: one less.
    for (int k = 0; k < 3; ++k) {
      const V3 zeta = h * V3::Unit(k);
      const End a = step(-zeta, V3::Zero()), b = step(zeta, V3::Zero());
      const V3 theta = SO3<Scalar>(a.r * b.r.transpose()).Log() / (2 * h);  // error of R
      const auto error = [&](const V3& xa, const V3& xb, const V3& x) {
        return V3((xa - xb) / (2 * h) - theta.cross(x));  // xi_x = dx - theta x x
      };
      CHECK((theta + column(end.by.int_r, k)).norm() < 200 * h * h);
      CHECK((error(a.v, b.v, end.v) - column(end.by.velocity_by_gyro, k)).norm() < 200 * h * h);
      CHECK((error(a.p, b.p, end.p) - column(end.by.position_by_gyro, k)).norm() < 200 * h * h);
      const End c = step(V3::Zero(), -zeta), d = step(V3::Zero(), zeta);
      CHECK(((c.v - d.v) / (2 * h) + column(end.by.int_r, k)).norm() < 200 * h * h);
      CHECK(((c.p - d.p) / (2 * h) - column(end.by.position_by_accel, k)).norm() < 200 * h * h);
    }
  }
}
