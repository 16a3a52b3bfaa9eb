// Standing still, detected: the mean of a window in which the IMU's scatter and its means are what
// sensor noise and bias priors explain.
#pragma once

#include <array>
#include <cmath>

#include "tensegrity/estimator/config.hpp"
#include "tensegrity/math/so3.hpp"
#include "tensegrity/robot/prism.hpp"

namespace tensegrity {

// What a robot at rest showed: all that a filter starts from.
template <typename Scalar>
struct AtRest {
  Vector3<Scalar> gyro;          // the gyro's bias: mean rate, or its prior [rad/s]
  Vector3<Scalar> accel;         // mean specific force, IMU frame [m/s^2]
  int samples = 1;               // that were averaged
  CableLengths<Scalar> lengths;  // mean lengths [m]
  std::array<bool, 6> contacts;  // endcaps on the ground; all false: not known
};

// The base rod of a belief at rest, with the priors of `config`: roll and pitch from the mean
// specific force, gyro bias from the mean rate, heading and position zero by definition. Returns
// the force without the prior bias, body [m/s^2].
template <typename B, typename Scalar = typename B::Scalar>
Vector3<Scalar> stand_still(B& belief, const AtRest<Scalar>& rest,
                            const PrismConfig<Scalar>& config) {
  const Vector3<Scalar> force = rest.accel - config.accelerometer_bias;
  belief.rotation = shortest_rotation<Scalar>(force.normalized(), Vector3<Scalar>::UnitZ());
  belief.gyro_bias = rest.gyro;
  belief.accel_bias = config.accelerometer_bias;
  const auto set = [&](int at, Scalar std) {
    for (int k = at; k < at + 3; ++k) belief.covariance(k, k) = std * std;
  };
  set(B::kRotation, config.orientation_std);
  belief.covariance(B::kRotation + 2, B::kRotation + 2) = 0;  // heading
  set(B::kVelocity, config.velocity_std);
  set(B::kPosition, config.position_std);
  set(B::kGyroBias, config.static_bias_initialization
                        ? config.gyroscope_std / std::sqrt(Scalar(rest.samples))
                        : config.gyroscope_bias_std);
  set(B::kAccelBias, config.accelerometer_bias_std);
  return force;
}

template <typename Scalar>
class StaticStart {
 public:
  struct Limits {
    int samples;                 // a window is this many samples in a row
    Scalar gyro_scatter;         // largest standard deviation of any gyro axis [rad/s]
    Scalar accel_scatter;        // largest standard deviation of any accelerometer axis [m/s^2]
    Scalar gyro_mean;            // largest norm of (mean rate - prior bias) [rad/s]
    Scalar accel_mean;           // largest | |mean specific force - prior bias| - g | [m/s^2]
    Scalar gravity;              // [m/s^2]
    Vector3<Scalar> gyro_bias;   // prior mean [rad/s]
    Vector3<Scalar> accel_bias;  // prior mean [m/s^2]
  };

  explicit StaticStart(const Limits& limits) : limits_(limits) { clear(); }

  // Adds one sample; true when a whole window was still. A window that was not is forgotten.
  bool add(const Vector3<Scalar>& gyro, const Vector3<Scalar>& accel) {
    gyro_.add(gyro);
    accel_.add(accel);
    if (gyro_.count < limits_.samples) return false;
    const bool still =
        gyro_.variance().maxCoeff() <= limits_.gyro_scatter * limits_.gyro_scatter &&
        accel_.variance().maxCoeff() <= limits_.accel_scatter * limits_.accel_scatter &&
        (gyro_.mean - limits_.gyro_bias).norm() <= limits_.gyro_mean &&
        std::abs((accel_.mean - limits_.accel_bias).norm() - limits_.gravity) <= limits_.accel_mean;
    if (!still) clear();
    return still;
  }

  void clear() { gyro_ = accel_ = Welford{}; }

  int samples() const { return gyro_.count; }
  const Vector3<Scalar>& mean_gyro() const { return gyro_.mean; }
  const Vector3<Scalar>& mean_accel() const { return accel_.mean; }

 private:
  // Running mean and variance (Welford 1962): no buffer, no cancellation.
  struct Welford {
    int count = 0;
    Vector3<Scalar> mean = Vector3<Scalar>::Zero();
    Vector3<Scalar> sum_squares = Vector3<Scalar>::Zero();

    void add(const Vector3<Scalar>& x) {
      ++count;
      const Vector3<Scalar> before = x - mean;
      mean += before / Scalar(count);
      sum_squares += before.cwiseProduct(x - mean);
    }
    Vector3<Scalar> variance() const { return sum_squares / Scalar(count > 1 ? count - 1 : 1); }
  };

  Limits limits_;
  Welford gyro_, accel_;
};

}  // namespace tensegrity
