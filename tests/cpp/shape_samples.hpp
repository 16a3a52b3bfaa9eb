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

// By its definition: the sum over the cables of weight * d2l/dtangent2, 10 x 10 [1/m]: the
// second-order part of a least-squares Hessian (weights = residuals) or the stress stiffness
// (weights = a self-stress).
inline TangentMatrix<double> weighted_length_hessian(const Rods<double>& rods,
                                                     const Vector<double, 9>& weights) {
  const Endcaps<double> q = rods.endcaps();
  TangentMatrix<double> hessian = TangentMatrix<double>::Zero();
  for (int row = 0; row < 9; ++row) {
    const Cable cable = kPrismCables[static_cast<std::size_t>(row)];
    double length;
    const Vector3<double> n = detail::cable_direction(q, cable, length);
    if (length <= 0) continue;
    // A cable curves as the part of its motion across itself ...
    const Matrix3<double> across =
        weights[row] / length * (Matrix3<double>::Identity() - n * n.transpose());
    const auto add_block = [&](int a, int b, double sign) {
      const int ka = free_rod(a);
      const int kb = free_rod(b);
      if (ka < 0 || kb < 0) return;
      const double sa = double(rod_side(a));
      const double sb = double(rod_side(b));
      const auto ba = rods.rod(ka).across();
      const auto bb = rods.rod(kb).across();
      const Matrix<double, 3, 2> across_bb = sb * (across * bb);
      hessian.block<3, 3>(5 * ka, 5 * kb) += sign * across;
      hessian.block<3, 2>(5 * ka, 5 * kb + 3) += sign * across_bb;
      hessian.block<2, 3>(5 * ka + 3, 5 * kb) += (sign * sa) * (ba.transpose() * across);
      hessian.block<2, 2>(5 * ka + 3, 5 * kb + 3) += (sign * sa) * (ba.transpose() * across_bb);
    };
    add_block(cable.from, cable.from, 1);
    add_block(cable.to, cable.to, 1);
    add_block(cable.from, cable.to, -1);
    add_block(cable.to, cable.from, -1);
    // ... and as the endcaps do, which move on circles about their rods' centres.
    const auto add_circle = [&](int endcap, double sign) {
      const int k = free_rod(endcap);
      if (k < 0) return;
      const double inward = -sign * double(rod_side(endcap)) * n.dot(rods.rod(k).direction());
      hessian.block<2, 2>(5 * k + 3, 5 * k + 3).diagonal().array() +=
          weights[row] * inward / rods.half_length();
    };
    add_circle(cable.from, 1);
    add_circle(cable.to, -1);
  }
  return hessian;
}

}  // namespace tensegrity::shape::test
