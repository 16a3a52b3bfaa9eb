// Random states of the tightly coupled filter, and its algebra done the plain way: derivatives by
// differences, updates with dense matrices. Compiled once (tight_samples.cpp), for dense algebra is
// slow to compile.
#pragma once

#include <functional>
#include <memory>

#include "tensegrity/math/vector_lanes.hpp"
#include "tensegrity/robot/prism.hpp"
#include "tensegrity/tight/belief.hpp"

namespace tensegrity::tight::test {

using B = Belief<double>;
using V3 = Vector3<double>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// States of the belief; what its vectors have beyond is always zero.
inline constexpr int kStates = B::kOffsets + 9;

class Samples {
 public:
  explicit Samples(unsigned seed);
  ~Samples();

  double uniform(double low, double high);
  double normal();
  VectorXd normal(int size, double sigma);
  V3 vector(double sigma);

  // Any pose, velocity and shape of the robot, on a sloped plane. The rods have their length, but
  // their endcaps move as they like. The covariance is `covariance(0.05)`.
  B belief(const Prism<double>& robot);

  // Of full rank, every standard deviation about `scale`.
  B::Covariance covariance(double scale);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The vector in a lane.
inline V3 vector(const VectorLanes<double>& v, int lane) {
  return {v.x.at(lane), v.y.at(lane), v.z.at(lane)};
}

// X <- Exp(e) X, theta <- theta + e.
B perturbed(const B& belief, const VectorXd& e);

// The error of `a` with `b` as the truth: a = perturbed(b, difference(a, b)).
VectorXd difference(const B& a, const B& b);

// How `f` changes with the error of the belief, by central differences: one row per value of f.
MatrixXd derivative(const B& belief, const std::function<VectorXd(const B&)>& f);
// A step of 1e-5 and third derivatives of order ten, rounding of 1e-16 / 1e-5 besides.
inline constexpr double kDerivativeError = 1e-8;

// The Kalman update with z = H e + n, all rows at once.
B dense_update(const B& belief, const MatrixXd& h, const VectorXd& z, const VectorXd& variances);

// F P F' + Q.
MatrixXd sandwich(const MatrixXd& f, const MatrixXd& p, const MatrixXd& q);

// Whether P is symmetric where the filter reads it.
bool symmetric(const B& belief);

// P^-1 of the states [kStates x kStates].
MatrixXd information(const B& belief);

// Largest difference of two covariances, relative to the largest variance of the second.
double distance(const MatrixXd& a, const MatrixXd& b);

}  // namespace tensegrity::tight::test
