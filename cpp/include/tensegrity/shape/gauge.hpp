// The spin of the free rods about the base rod, which no cable can see (T §V).
//
// Turning q2..q5 about the body z axis changes no cable length, so lengths determine a shape only
// up to that angle. Every public shape is therefore given in one gauge: turned about z so that its
// q2..q5 fit those of a reference shape best in the least-squares sense (Procrustes). A gauge that
// depends on the shape alone cannot wind up, which summed minimum-norm steps do.
#pragma once

#include <cmath>

#include "tensegrity/shape/rods.hpp"

namespace tensegrity::shape {

// A turn about z.
template <typename Scalar>
struct Spin {
  Scalar cosine, sine;

  Scalar angle() const { return std::atan2(sine, cosine); }  // [rad], within (-pi, pi]
};

// The turn of `reference` that fits `q` best over q2..q5, none for every shape that is in the gauge
// of `reference`. Without a trigonometric function: a solver asks for it after every solution.
template <typename Scalar>
Spin<Scalar> spin(const Endcaps<Scalar>& q, const Endcaps<Scalar>& reference) {
  Scalar sine = 0;
  Scalar cosine = 0;
  for (int i = 2; i < 6; ++i) {
    sine += reference(0, i) * q(1, i) - reference(1, i) * q(0, i);
    cosine += reference(0, i) * q(0, i) + reference(1, i) * q(1, i);
  }
  const Scalar radius = std::sqrt(sine * sine + cosine * cosine);
  if (!(radius > 0)) return {Scalar(1), Scalar(0)};
  return {cosine / radius, sine / radius};
}

// Its angle [rad], within (-pi, pi].
template <typename Scalar>
Scalar spin_angle(const Endcaps<Scalar>& q, const Endcaps<Scalar>& reference) {
  return spin(q, reference).angle();
}

// q2..q5 turned about the body z axis by `angle` [rad]; q0 and q1 are on that axis.
template <typename Scalar>
Endcaps<Scalar> rotate_about_z(const Endcaps<Scalar>& q, Scalar angle) {
  return Rods<Scalar>::rotation_about_z(angle) * q;
}

template <typename Scalar>
Endcaps<Scalar> in_procrustes_gauge(const Endcaps<Scalar>& q, const Endcaps<Scalar>& reference) {
  return rotate_about_z(q, -spin_angle(q, reference));
}

// Velocity of the stacked endcaps per radian of spin, t_q = e_z x q over q2..q5 [m/rad].
template <typename Scalar>
Vector<Scalar, 18> spin_velocity(const Endcaps<Scalar>& q) {
  Vector<Scalar, 18> velocity = Vector<Scalar, 18>::Zero();
  for (int i = 2; i < 6; ++i) velocity.template segment<3>(3 * i) << -q(1, i), q(0, i), 0;
  return velocity;
}

// Gradient w of `spin_angle` at a shape that is in the gauge of `reference` [rad/m]; w' t_q = 1.
template <typename Scalar>
Vector<Scalar, 18> spin_gradient(const Endcaps<Scalar>& q, const Endcaps<Scalar>& reference) {
  Scalar cosine = 0;
  Vector<Scalar, 18> gradient = Vector<Scalar, 18>::Zero();
  for (int i = 2; i < 6; ++i) {
    cosine += reference(0, i) * q(0, i) + reference(1, i) * q(1, i);
    gradient.template segment<3>(3 * i) << -reference(1, i), reference(0, i), 0;
  }
  // Both factors are radii about z: no fit can be closer to undefined than rods that lie on z.
  return cosine > 0 ? Vector<Scalar, 18>(gradient / cosine) : Vector<Scalar, 18>::Zero();
}

// Covariance of a shape given in the Procrustes gauge, from the covariance of the same shape in any
// other gauge (18 x 18, q stacked by endcap): G cov G' with G = I - t_q w'. What was uncertainty of
// the spin leaves, what was fixed by the other gauge enters.
template <typename Scalar>
Matrix<Scalar, 18> to_procrustes_gauge(const Matrix<Scalar, 18>& covariance,
                                       const Endcaps<Scalar>& q, const Endcaps<Scalar>& reference) {
  const Vector<Scalar, 18> t = spin_velocity(q);
  const Vector<Scalar, 18> w = spin_gradient(q, reference);
  const Vector<Scalar, 18> cw = covariance * w;
  const Scalar variance = w.dot(cw);  // of the spin angle [rad^2]
  Matrix<Scalar, 18> out = covariance;
  out.noalias() -= t * cw.transpose();
  out.noalias() -= cw * t.transpose();
  out.noalias() += variance * t * t.transpose();
  return out;
}

// Tangent of the spin about z per radian [m/rad], the exact null vector of the length Jacobian.
template <typename Scalar>
Tangent<Scalar> spin_by_angle(const Rods<Scalar>& rods) {
  Tangent<Scalar> tangent;
  for (int k = 0; k < 2; ++k) {
    const auto& rod = rods.rod(k);
    // z x c, and of L/2 z x u what is across: a . (z x u) = b_z, b . (z x u) = -a_z.
    tangent[5 * k] = -rod.centre.y();
    tangent[5 * k + 1] = rod.centre.x();
    tangent[5 * k + 2] = 0;
    tangent[5 * k + 3] = rods.half_length() * rod.frame(2, 1);
    tangent[5 * k + 4] = -rods.half_length() * rod.frame(2, 0);
  }
  return tangent;
}

// The same of unit length. Zero when both rods lie on z, where there is no spin.
template <typename Scalar>
Tangent<Scalar> spin_tangent(const Rods<Scalar>& rods) {
  const Tangent<Scalar> tangent = spin_by_angle(rods);
  const Scalar norm = tangent.norm();
  return norm > 0 ? Tangent<Scalar>(tangent / norm) : Tangent<Scalar>::Zero();
}

// G in tangent coordinates, I - t w' with w' t = 1: takes a tangent covariance P to G P G'.
// `rods` has to be in the gauge of `reference`.
template <typename Scalar>
TangentMatrix<Scalar> gauge_projection(const Rods<Scalar>& rods, const Endcaps<Scalar>& reference) {
  const Endcaps<Scalar> q = rods.endcaps();
  const Vector<Scalar, 18> w = spin_gradient(q, reference);
  Tangent<Scalar> w_tangent = Tangent<Scalar>::Zero();
  for (int i = 2; i < 6; ++i) {
    const int k = free_rod(i);
    const Vector3<Scalar> wi = w.template segment<3>(3 * i);
    w_tangent.template segment<3>(5 * k) += wi;
    w_tangent.template segment<2>(5 * k + 3) +=
        Scalar(rod_side(i)) * (rods.rod(k).across().transpose() * wi);
  }
  const Tangent<Scalar> t = spin_tangent(rods);
  const Scalar scale = t.dot(w_tangent);
  TangentMatrix<Scalar> projection = TangentMatrix<Scalar>::Identity();
  if (scale > 0) projection.noalias() -= t * (w_tangent.transpose() / scale);
  return projection;
}

// Covariance of the stacked endcaps in the gauge of `reference` (18 x 18) from a tangent covariance
// of `rods`, which have to be in that gauge.
template <typename Scalar>
Matrix<Scalar, 18> endcap_covariance(const Rods<Scalar>& rods, const TangentMatrix<Scalar>& tangent,
                                     const Endcaps<Scalar>& reference) {
  // Lazy products: others refer to the heap for operands of more than eight rows and columns.
  const EndcapJacobian<Scalar> map =
      rods.endcap_jacobian().lazyProduct(gauge_projection(rods, reference));
  const EndcapJacobian<Scalar> spread = map.lazyProduct(tangent);
  const Matrix<Scalar, 18> covariance = spread.lazyProduct(map.transpose());
  return (covariance + covariance.transpose()) / 2;
}

// Turns the rods into the gauge of `reference`. A tangent covariance P that belongs to them turns
// along: the directions across the rods travel with the rods, the centres are in body axes.
template <typename Scalar>
void move_to_procrustes_gauge(Rods<Scalar>& rods, const Endcaps<Scalar>& reference,
                              TangentMatrix<Scalar>& covariance) {
  const Scalar angle = -spin_angle(rods.endcaps(), reference);
  rods.rotate_about_z(angle);
  TangentMatrix<Scalar> turn = TangentMatrix<Scalar>::Identity();
  const Matrix3<Scalar> rotation = Rods<Scalar>::rotation_about_z(angle);
  turn.template block<3, 3>(0, 0) = rotation;
  turn.template block<3, 3>(5, 5) = rotation;
  const TangentMatrix<Scalar> map = gauge_projection(rods, reference).lazyProduct(turn);
  const TangentMatrix<Scalar> spread = map.lazyProduct(covariance);
  const TangentMatrix<Scalar> moved = spread.lazyProduct(map.transpose());
  covariance = (moved + moved.transpose()) / 2;
}

}  // namespace tensegrity::shape
