// Configurations of the loosely coupled filter.
#pragma once

#include "tensegrity/estimator/config.hpp"

namespace tensegrity::test {

// Everything that improves on T (the default).
template <typename Scalar>
PrismConfig<Scalar> improved_loose_config() {
  PrismConfig<Scalar> config;
  config.shape = ShapeMethod::kTracker;
  config.spin = SpinMethod::kEstimated;
  config.contact_point = ContactPoint::kRolling;
  config.contact_noise = ContactNoise::kFromShape;
  config.chi_square_gate = Scalar(0.999);
  return config;
}

}  // namespace tensegrity::test
