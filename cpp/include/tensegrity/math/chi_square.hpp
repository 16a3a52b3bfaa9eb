// The chi-square distribution, for gates that are set as probabilities.
#pragma once

#include <cmath>

namespace tensegrity {

// P(X <= x) for `dof` degrees of freedom: the regularised lower incomplete gamma function
// P(dof/2, x/2) by its power series (Abramowitz & Stegun 6.5.29), bounded.
inline double chi_square_probability(double x, int dof) {
  if (!(x > 0)) return 0;
  const double a = dof / 2.0, y = x / 2;
  double term = 1 / a, sum = term;
  for (int k = 1; k < 1000 && term > sum * 1e-16; ++k) {
    term *= y / (a + k);
    sum += term;
  }
  return sum * std::exp(a * std::log(y) - y - std::lgamma(a));
}

// The x with P(X <= x) = probability, by bisection. Not for the hot path: tabulate it.
inline double chi_square_quantile(double probability, int dof) {
  double low = 0, high = 10.0 * dof + 100;
  for (int k = 0; k < 100; ++k) {
    const double middle = (low + high) / 2;
    (chi_square_probability(middle, dof) < probability ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace tensegrity
