// Cable lengths of a shape against measured ones: half the sum of squared differences, its gradient
// and its Hessian with respect to the tangent.
//
// Written for the net instead of through the 9 x 10 Jacobian: a cable is a 3 x 3 stiffness between
// two endcaps, the endcaps of a free rod move by dc +- across (L/2 du).
#pragma once

#include "tensegrity/shape/cables.hpp"
#include "tensegrity/shape/gauge.hpp"

namespace tensegrity::shape {

template <typename Scalar>
class LengthResiduals {
 public:
  // `measured`: order of `kPrismCables` [m].
  LengthResiduals(const Rods<Scalar>& rods, const CableLengths<Scalar>& measured) {
    const Endcaps<Scalar> q = rods.endcaps();
    for (int k = 0; k < 9; ++k) {
      const Cable cable = kPrismCables[static_cast<std::size_t>(k)];
      directions_.col(k) = detail::cable_direction(q, cable, lengths_[k]);
    }
    residuals_ = lengths_ - measured;
  }

  // Sum of squared residuals [m^2].
  Scalar cost() const { return residuals_.squaredNorm(); }

  // J' residuals
  Tangent<Scalar> gradient(const Rods<Scalar>& rods) const {
    Matrix<Scalar, 3, 6> force = Matrix<Scalar, 3, 6>::Zero();
    for (int k = 0; k < 9; ++k) {
      const Cable cable = kPrismCables[static_cast<std::size_t>(k)];
      const Vector3<Scalar> pull = residuals_[k] * directions_.col(k);
      force.col(cable.from) += pull;
      force.col(cable.to) -= pull;
    }
    Tangent<Scalar> out;
    for (int k = 0; k < 2; ++k) {
      const Vector3<Scalar> even = force.col(2 * k + 2), odd = force.col(2 * k + 3);
      out.template segment<3>(5 * k) = even + odd;
      out.template segment<2>(5 * k + 3) = rods.rod(k).across().transpose() * (even - odd);
    }
    return out;
  }

  // J' J, and with `second_order` the second derivatives of the lengths times the residuals as
  // well. The lower triangle; a unit stiffness holds the spin about z.
  TangentMatrix<Scalar> hessian(const Rods<Scalar>& rods, bool second_order) const {
    using M3 = Matrix3<Scalar>;
    std::array<M3, 4> own;  // stiffness at endcaps 2 .. 5
    own.fill(M3::Zero());
    // Between the rods: sums over their cables of -K, times the side of either end.
    M3 cross = M3::Zero(), cross_0 = M3::Zero(), cross_1 = M3::Zero(), cross_01 = M3::Zero();
    std::array<Scalar, 2> circles{};  // endcaps move on circles about their rod's centre
    for (int k = 0; k < 9; ++k) {
      const Cable cable = kPrismCables[static_cast<std::size_t>(k)];
      const Vector3<Scalar> n = directions_.col(k);
      // A cable resists along itself, and as it is tense also across.
      const Scalar tension =
          second_order && lengths_[k] > 0 ? residuals_[k] / lengths_[k] : Scalar(0);
      M3 stiffness = ((1 - tension) * n) * n.transpose();
      stiffness.diagonal().array() += tension;
      const auto add_end = [&](int endcap, Scalar sign) {
        const int rod = free_rod(endcap);
        if (rod < 0) return;
        own[static_cast<std::size_t>(endcap - 2)] += stiffness;
        if (second_order) {
          circles[static_cast<std::size_t>(rod)] -=
              sign * Scalar(rod_side(endcap)) * residuals_[k] * n.dot(rods.rod(rod).direction());
        }
      };
      add_end(cable.from, Scalar(1));
      add_end(cable.to, Scalar(-1));
      if (free_rod(cable.from) < 0 || free_rod(cable.to) < 0) continue;
      const bool from_is_0 = free_rod(cable.from) == 0;
      const Scalar side_0 = Scalar(rod_side(from_is_0 ? cable.from : cable.to));
      const Scalar side_1 = Scalar(rod_side(from_is_0 ? cable.to : cable.from));
      cross -= stiffness;
      cross_0 -= side_0 * stiffness;
      cross_1 -= side_1 * stiffness;
      cross_01 -= side_0 * side_1 * stiffness;
    }
    const Tangent<Scalar> spin = spin_tangent(rods);
    TangentMatrix<Scalar> h = spin.lazyProduct(spin.transpose());
    for (int k = 0; k < 2; ++k) {
      const auto across = rods.rod(k).across();
      const M3& even = own[static_cast<std::size_t>(2 * k)];
      const M3& odd = own[static_cast<std::size_t>(2 * k + 1)];
      const M3 sum = even + odd;
      h.template block<3, 3>(5 * k, 5 * k) += sum;
      h.template block<2, 3>(5 * k + 3, 5 * k) += across.transpose() * (even - odd);
      h.template block<2, 2>(5 * k + 3, 5 * k + 3) += across.transpose() * sum * across;
      h.template block<2, 2>(5 * k + 3, 5 * k + 3).diagonal().array() +=
          circles[static_cast<std::size_t>(k)] / rods.half_length();
    }
    const auto across_0 = rods.rod(0).across();
    const auto across_1 = rods.rod(1).across();
    h.template block<3, 3>(5, 0) += cross;
    h.template block<3, 2>(5, 3) += cross_0 * across_0;
    h.template block<2, 3>(8, 0) += across_1.transpose() * cross_1;
    h.template block<2, 2>(8, 3) += across_1.transpose() * cross_01 * across_0;
    return h;
  }

 private:
  CableLengths<Scalar> lengths_, residuals_;
  Matrix<Scalar, 3, 9> directions_;  // from `to` to `from`, unit
};

}  // namespace tensegrity::shape
