#include <doctest/doctest.h>

#include <initializer_list>

#include "tensegrity/math/chi_square.hpp"

TEST_CASE("chi-square quantiles equal scipy.stats.chi2.ppf") {
  using tensegrity::chi_square_quantile;
  CHECK(chi_square_quantile(0.95, 1) == doctest::Approx(3.841458820694124).epsilon(1e-10));
  CHECK(chi_square_quantile(0.99, 3) == doctest::Approx(11.344866730144373).epsilon(1e-10));
  CHECK(chi_square_quantile(0.999, 9) == doctest::Approx(27.877164871256568).epsilon(1e-10));
  CHECK(chi_square_quantile(0.5, 18) == doctest::Approx(17.33790236874074).epsilon(1e-8));
  CHECK(chi_square_quantile(1e-3, 6) == doctest::Approx(0.3810667551368064).epsilon(1e-5));
}

TEST_CASE("chi-square quantiles in single precision agree with double precision") {
  using tensegrity::chi_square_quantile;
  for (const double probability : {0.01, 0.5, 0.95, 0.999}) {
    for (int dof = 1; dof <= 18; ++dof) {
      const double expected = chi_square_quantile(probability, dof);
      // 1 - P is left with 1e-3 of float's digits at 0.999.
      CHECK(chi_square_quantile(float(probability), dof) ==
            doctest::Approx(expected).epsilon(1e-4));
    }
  }
}
