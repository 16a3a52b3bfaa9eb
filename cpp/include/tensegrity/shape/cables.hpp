// Cable lengths of a shape and their first and second derivatives with respect to the tangent.
#pragma once

#include "tensegrity/shape/rods.hpp"

namespace tensegrity::shape {

// Distances of the endcap centres, order of `kPrismCables` [m].
template <typename Scalar>
CableLengths<Scalar> cable_lengths(const Endcaps<Scalar>& q) {
  CableLengths<Scalar> lengths;
  for (int k = 0; k < 9; ++k) {
    const Cable cable = kPrismCables[static_cast<std::size_t>(k)];
    lengths[k] = (q.col(cable.from) - q.col(cable.to)).norm();
  }
  return lengths;
}

namespace detail {

// Unit vector from a cable's `to` to its `from` endcap; zero for a cable of no length, whose
// derivative does not exist.
template <typename Scalar>
Vector3<Scalar> cable_direction(const Endcaps<Scalar>& q, Cable cable, Scalar& length) {
  const Vector3<Scalar> span = q.col(cable.from) - q.col(cable.to);
  length = span.norm();
  return length > 0 ? Vector3<Scalar>(span / length) : Vector3<Scalar>::Zero();
}

}  // namespace detail

// J = dl/dtangent, 9 x 10 [m/m]. Turning the free rods about body z is its exact null vector.
template <typename Scalar>
LengthJacobian<Scalar> length_jacobian(const Rods<Scalar>& rods) {
  const Endcaps<Scalar> q = rods.endcaps();
  LengthJacobian<Scalar> jacobian = LengthJacobian<Scalar>::Zero();
  for (int row = 0; row < 9; ++row) {
    const Cable cable = kPrismCables[static_cast<std::size_t>(row)];
    Scalar length;
    const Vector3<Scalar> n = detail::cable_direction(q, cable, length);
    const auto add_end = [&](int endcap, Scalar sign) {
      const int k = free_rod(endcap);
      if (k < 0) return;
      jacobian.template block<1, 3>(row, 5 * k) += sign * n.transpose();
      jacobian.template block<1, 2>(row, 5 * k + 3) +=
          sign * Scalar(rod_side(endcap)) * (n.transpose() * rods.rod(k).across());
    };
    add_end(cable.from, Scalar(1));
    add_end(cable.to, Scalar(-1));
  }
  return jacobian;
}

// Sum over the cables of d2l/dtangent2 times that cable's column of `vectors` (10 x 9). A cable
// curves as the part of its motion across itself, and as its endcaps do, which move on circles
// about their rods' centres. The 10 x 10 are never formed: a cable has two ends only.
template <typename Scalar>
Tangent<Scalar> length_hessian_products(const Rods<Scalar>& rods,
                                        const Matrix<Scalar, kTangent, 9>& vectors) {
  const Endcaps<Scalar> q = rods.endcaps();
  Tangent<Scalar> sum = Tangent<Scalar>::Zero();
  for (int column = 0; column < 9; ++column) {
    const Cable cable = kPrismCables[static_cast<std::size_t>(column)];
    Scalar length;
    const Vector3<Scalar> n = detail::cable_direction(q, cable, length);
    if (length <= 0) continue;
    Vector3<Scalar> parting = Vector3<Scalar>::Zero();  // of the ends
    const auto add_motion = [&](int endcap, Scalar sign) {
      const int k = free_rod(endcap);
      if (k < 0) return;
      const Vector3<Scalar> centre = vectors.template block<3, 1>(5 * k, column);
      const Vector<Scalar, 2> turn = vectors.template block<2, 1>(5 * k + 3, column);
      parting += sign * (centre + Scalar(rod_side(endcap)) * (rods.rod(k).across() * turn));
    };
    add_motion(cable.from, Scalar(1));
    add_motion(cable.to, Scalar(-1));
    const Vector3<Scalar> across = (parting - n * n.dot(parting)) / length;
    const auto add_end = [&](int endcap, Scalar sign) {
      const int k = free_rod(endcap);
      if (k < 0) return;
      const Scalar side = sign * Scalar(rod_side(endcap));
      const Scalar inward = -side * n.dot(rods.rod(k).direction());
      sum.template segment<3>(5 * k) += sign * across;
      sum.template segment<2>(5 * k + 3) +=
          side * (rods.rod(k).across().transpose() * across) +
          inward / rods.half_length() * vectors.template block<2, 1>(5 * k + 3, column);
    };
    add_end(cable.from, Scalar(1));
    add_end(cable.to, Scalar(-1));
  }
  return sum;
}

}  // namespace tensegrity::shape
