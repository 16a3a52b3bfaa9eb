// Random shapes for the tests of shape reconstruction.
#pragma once

#include <random>

#include "tensegrity/shape/cables.hpp"
#include "tensegrity/shape/constraints.hpp"
#include "tensegrity/shape/gauge.hpp"

namespace tensegrity::shape::test {

class Samples {
 public:
  explicit Samples(unsigned seed) : generator_(seed) {}

  template <int Size>
  Vector<double, Size> normal(double sigma) {
    std::normal_distribution<double> distribution(0, sigma);
    Vector<double, Size> out;
    for (int i = 0; i < Size; ++i) out[i] = distribution(generator_);
    return out;
  }

  // A shape whose rods have not passed through each other, `spread` [m] from the undeformed robot
  // in every tangent direction, in the Procrustes gauge. 0.12 m tilts the rods by 10 degrees.
  Rods<double> shape(const Prism<double>& prism, double spread = 0.12) {
    const Endcaps<double> reference = prism.undeformed();
    while (true) {
      Rods<double> rods(prism, reference);
      rods.retract(normal<kTangent>(spread));
      if (handedness(rods.endcaps(), prism.moment_sign()) != Handedness::kRight) continue;
      rods.rotate_about_z(-spin_angle(rods.endcaps(), reference));
      return rods;
    }
  }

 private:
  std::mt19937 generator_;
};

}  // namespace tensegrity::shape::test
