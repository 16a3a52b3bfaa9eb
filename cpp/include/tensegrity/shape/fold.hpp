// The fold of the shape equations, where two solutions for the same nine lengths meet.
//
// A self-stress of the net is a left null vector of the length Jacobian J, so an unloaded
// prestressed prism is a singular point of its own shape equations: along one direction of motion,
// the mechanism, the lengths change only to second order, and two branches of solutions meet there.
// A loaded robot is close to it. Which branch a shape is on shows in the sign of det[J; t], with t
// the unit spin tangent; how close it is to the fold shows in its size.
#pragma once

#include "tensegrity/math/determinant.hpp"
#include "tensegrity/math/jacobi_svd.hpp"
#include "tensegrity/shape/cables.hpp"
#include "tensegrity/shape/gauge.hpp"

namespace tensegrity::shape {

namespace detail {

// [J; t'], 10 x 10: the length Jacobian, made square by the spin.
template <typename Scalar>
TangentMatrix<Scalar> bordered_jacobian(const Rods<Scalar>& rods) {
  TangentMatrix<Scalar> bordered;
  bordered.template topRows<9>() = length_jacobian(rods);
  bordered.template bottomRows<1>() = spin_tangent(rods).transpose();
  return bordered;
}

}  // namespace detail

// +-det[J; t], dimensionless: zero on the fold and positive on the branch of smaller twist, which a
// prism takes that stands loaded by gravity (about 0.4 for the robot of T at rest). `moment_sign`
// (Prism::moment_sign) gives the mirror image of a shape the same value.
//
// Value and gradient come from one elimination.
template <typename Scalar>
class Fold {
 public:
  Fold(const Rods<Scalar>& rods, Scalar moment_sign)
      : rods_(rods), determinant_(detail::bordered_jacobian(rods)), sign_(-moment_sign) {}

  Scalar value() const { return sign_ * determinant_.value(); }

  // With respect to the tangent [1/m], exact on the fold as well.
  Tangent<Scalar> gradient() const {
    // d det = sum_ij C_ij dA_ij, C the cofactors. The last row adds nothing: its cofactors are
    // parallel to t (both are orthogonal to every row of J), and a unit vector changes across
    // itself.
    const TangentMatrix<Scalar> cofactors = determinant_.cofactors();
    return sign_ *
           length_hessian_products<Scalar>(rods_, cofactors.template topRows<9>().transpose());
  }

 private:
  Rods<Scalar> rods_;
  Determinant<Scalar, kTangent> determinant_;
  Scalar sign_;
};

template <typename Scalar>
Scalar fold(const Rods<Scalar>& rods, Scalar moment_sign) {
  return Fold<Scalar>(rods, moment_sign).value();
}

template <typename Scalar>
Tangent<Scalar> fold_gradient(const Rods<Scalar>& rods, Scalar moment_sign) {
  return Fold<Scalar>(rods, moment_sign).gradient();
}

// Singular value decomposition of J across the spin, with what the fold adds to first order.
template <typename Scalar>
struct FoldAnalysis {
  Vector<Scalar, 9> singular_values;    // descending [m/m]
  Matrix<Scalar, kTangent, 9> motions;  // right singular vectors, all across the spin
  Vector<Scalar, 9> self_stress;        // left singular vector of the smallest singular value
  Scalar curvature;  // kappa, second derivative of the self-stress-weighted lengths along it [1/m]

  auto mechanism() const { return motions.col(8); }
  Scalar smallest() const { return singular_values[8]; }
};

template <typename Scalar>
FoldAnalysis<Scalar> analyse_fold(const Rods<Scalar>& rods) {
  TangentMatrix<Scalar> bordered = detail::bordered_jacobian(rods);
  // t is orthogonal to every row of J, hence a singular vector of its own. Lifted above all others
  // (|J| <= sqrt(trace J J') <= sqrt(18 * 2)) it comes first and the nine of J follow.
  const Scalar spin_weight = 10;
  bordered.template bottomRows<1>() *= spin_weight;
  const JacobiSvd<Scalar, kTangent> svd(bordered);
  FoldAnalysis<Scalar> analysis;
  analysis.singular_values = svd.singular_values().template tail<9>();
  analysis.motions = svd.v().template rightCols<9>();
  analysis.self_stress = svd.u().col(9).template head<9>();
  const Tangent<Scalar> mechanism = analysis.mechanism();
  const Matrix<Scalar, kTangent, 9> stressed = mechanism * analysis.self_stress.transpose();
  analysis.curvature = mechanism.dot(length_hessian_products(rods, stressed));
  return analysis;
}

}  // namespace tensegrity::shape
