// The chi-square distribution, for gates that are set as probabilities.
#pragma once

#include <cmath>

namespace tensegrity {

// P(X <= x) for `dof` degrees of freedom: the regularised lower incomplete gamma function
// P(dof/2, x/2) by its power series (Abramowitz & Stegun 6.5.29), bounded.
template <typename Scalar>
Scalar chi_square_probability(Scalar x, int dof) {
  if (!(x > 0)) return 0;
  const Scalar a = Scalar(dof) / 2, y = x / 2;
  Scalar term = 1 / a, sum = term;
  for (int k = 1; k < 1000 && term > sum * Scalar(1e-16); ++k) {
    term *= y / (a + Scalar(k));
    sum += term;
  }
  return sum * std::exp(a * std::log(y) - y - std::lgamma(a));
}

// The x with P(X <= x) = probability, by bisection. Not for the hot path: tabulate it.
template <typename Scalar>
Scalar chi_square_quantile(Scalar probability, int dof) {
  Scalar low = 0, high = Scalar(10 * dof + 100);
  for (int k = 0; k < 100; ++k) {
    const Scalar middle = (low + high) / 2;
    (chi_square_probability(middle, dof) < probability ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace tensegrity
