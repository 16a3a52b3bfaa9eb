// Where the sigma points of an unscented filter lie and what they count.
//
// A mean x and a root S of its covariance (S S' = P) of dimension L give 2L+1 points: x itself and
// x +- spread * S(:, i). With the usual alpha of 0.001 to 0.1 the weight of the centre is about
// -1/alpha^2 and those of the others large: sums of whole points lose as many digits. What is
// summed here are deviations d_i = y_i - y_0 from the transformed centre, so that the centre's
// weight never appears. The weights of the mean sum to one, therefore
//   mean       = y_0 + e,                              e = outer * sum_i d_i
//   covariance = outer * sum_i d_i d_i' + centre * e e'
// With scaled weights (Wan & van der Merwe 2000, the reference C [9] of C §IV-B) `centre` is
// beta - alpha^2, which is positive for the usual beta = 2: the covariance is positive semidefinite
// by construction.
#pragma once

#include <cmath>
#include <cstdint>

namespace tensegrity::ukf {

enum class Weights : std::uint8_t {
  kScaled,   // Wan & van der Merwe 2000
  kUniform,  // 1 / (2L+1) for every point: what the code of C's authors does
};

template <typename Scalar>
struct SigmaWeights {
  Scalar spread = 0;  // of the points, in columns of the root
  Scalar outer = 0;   // weight of every point but the centre
  Scalar centre = 0;  // factor of e e' in the covariance
};

// Weights for a state of `dimension` L. alpha > 0; L + kappa > 0.
template <typename Scalar>
SigmaWeights<Scalar> sigma_weights(Weights kind, int dimension, Scalar alpha, Scalar beta,
                                   Scalar kappa) {
  const double c = double(alpha) * double(alpha) * (dimension + double(kappa));
  SigmaWeights<Scalar> weights;
  weights.spread = Scalar(std::sqrt(c));
  if (kind == Weights::kScaled) {
    weights.outer = Scalar(0.5 / c);
    // From the weights of the centre, m = 1 - 2 L outer and m + 1 - alpha^2 + beta.
    weights.centre = beta - alpha * alpha;
  } else {
    // The points spread as if they were scaled, then all count the same: what comes out has
    // 2 c / (2L+1) of the covariance that went in (C's code; with alpha = 0.0139, a
    // five-thousandth).
    weights.outer = Scalar(1) / Scalar(2 * dimension + 1);
    weights.centre = Scalar(-1);
  }
  return weights;
}

}  // namespace tensegrity::ukf
