// Ground that is declared flat: believed once the feet have had their say, and do not object.
//
// Flat ground that is true ties heights far apart to each other. Said of a slope it bends tilt,
// biases and shape within a second, and no later correction undoes that. So the declaration waits:
// the slope starts as unknown as that of any plane, and feet measure it. Once they have, flatness
// is tested, and taken as a measurement or refused for good. Waiting costs little, for what the
// slope is correlated with gets its correction with it.
#pragma once

#include <cmath>

#include "tensegrity/tight/sequential_update.hpp"

namespace tensegrity::tight {

// Level floors: 10 mm over 4 m is the tolerance of DIN 18202.
inline constexpr double kFlatSlopeStd = 0.0025;

enum class Flatness {
  kUndecided,  // the slope is not known well enough to tell
  kBelieved,   // measured to be 0 +- kFlatSlopeStd in each direction
  kRefuted,    // the ground slopes
};

// The slope is known well enough for the test when it is to three times the tolerance in every
// direction: what is believed has been tested about as sharply as it is going to be used. The test
// is that of chi-square: m' (P + kFlatSlopeStd^2)^-1 m of the slope m has to be below its 0.999
// quantile for two degrees of freedom, -2 ln(1 - 0.999). A slope of two degrees is at twice that,
// and flat ground refused by chance is only a plane whose slope is estimated.
template <typename Scalar>
Flatness judge_flatness(Belief<Scalar>& belief) {
  using B = Belief<Scalar>;
  constexpr Scalar kKnown = Scalar(3 * kFlatSlopeStd);
  constexpr Scalar kGate = Scalar(13.82);
  constexpr Scalar kVariance = Scalar(kFlatSlopeStd * kFlatSlopeStd);
  constexpr int kX = B::kGround + 1, kY = B::kGround + 2;

  const auto& p = belief.covariance;
  const Scalar xx = p(kX, kX), xy = p(kX, kY), yy = p(kY, kY);
  const Scalar greatest = (xx + yy) / 2 + std::hypot((xx - yy) / 2, xy);
  if (!(greatest < kKnown * kKnown)) return Flatness::kUndecided;

  const Scalar x = belief.ground[1], y = belief.ground[2];
  const Scalar sxx = xx + kVariance, syy = yy + kVariance;
  const Scalar chi_square = (syy * x * x - 2 * xy * x * y + sxx * y * y) / (sxx * syy - xy * xy);
  if (!(chi_square < kGate)) return Flatness::kRefuted;

  SequentialUpdate<Scalar> update(belief);
  for (int k = 1; k < 3; ++k) {
    Row<Scalar> row;
    row.add(B::kGround, Vector3<Scalar>::Unit(k));
    update.correct(row, belief.ground[k], kVariance);
  }
  return Flatness::kBelieved;
}

}  // namespace tensegrity::tight
