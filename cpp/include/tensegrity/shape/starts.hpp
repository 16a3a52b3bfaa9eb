// The fixed set of shapes from which a solver starts cold.
#pragma once

#include "tensegrity/robot/prism.hpp"
#include "tensegrity/shape/rods.hpp"

namespace tensegrity::shape {

inline constexpr int kColdStarts = 17;

// Start 0 is the undeformed robot and suffices for most shapes a robot can take. The others tilt
// its free rods in all sixteen combinations of signs, by 20 degrees in each of two directions.
template <typename Scalar>
Rods<Scalar> cold_start(const Prism<Scalar>& prism, int k) {
  Rods<Scalar> rods(prism, prism.undeformed());
  if (k == 0) return rods;
  const int signs = k - 1;
  const Scalar tilt = Scalar(0.36) * prism.rod_length / 2;
  Tangent<Scalar> delta = Tangent<Scalar>::Zero();
  delta[3] = signs & 1 ? tilt : -tilt;
  delta[4] = signs & 2 ? tilt : -tilt;
  delta[8] = signs & 4 ? tilt : -tilt;
  delta[9] = signs & 8 ? tilt : -tilt;
  rods.retract(delta);
  return rods;
}

}  // namespace tensegrity::shape
