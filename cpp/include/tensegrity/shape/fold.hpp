// The fold of the shape equations, where two solutions for the same nine lengths meet.
//
// A self-stress of the net is a left null vector of the length Jacobian J, so an unloaded
// prestressed prism is a singular point of its own shape equations: along one direction of motion,
// the mechanism, the lengths change only to second order, and two branches of solutions meet there.
// A loaded robot is close to it. Which branch a shape is on shows in the sign of det[J; t], with t
// the unit spin tangent; how close it is to the fold shows in its size.
#pragma once

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

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

// Cofactor matrix, d det(A) / dA. Exact for a singular matrix too, as long as its rank deficiency
// is one: with complete pivoting only the last pivot p can then vanish, and
//   adj([U1 u; 0 p]) = det(U1) [p U1^-1, -U1^-1 u; 0, 1].
template <typename Scalar>
TangentMatrix<Scalar> cofactors(const TangentMatrix<Scalar>& matrix) {
  constexpr int n = kTangent - 1;
  const Eigen::FullPivLU<TangentMatrix<Scalar>> lu(matrix);  // P A Q = L U
  const TangentMatrix<Scalar>& factors = lu.matrixLU();
  const Matrix<Scalar, n> u1 = factors.template topLeftCorner<n, n>();
  const auto upper = u1.template triangularView<Eigen::Upper>();
  TangentMatrix<Scalar> adjugate = TangentMatrix<Scalar>::Zero();  // of U, over det(U1)
  adjugate.template topLeftCorner<n, n>().diagonal().setConstant(factors(n, n));
  adjugate.template topRightCorner<n, 1>() = -factors.template topRightCorner<n, 1>();
  upper.solveInPlace(adjugate.template topRows<n>());
  adjugate(n, n) = 1;
  // adj(A) = det(P) det(Q) Q adj(U) L^-1 P, and the cofactors are its transpose.
  factors.template triangularView<Eigen::UnitLower>().template solveInPlace<Eigen::OnTheRight>(
      adjugate);
  const Scalar scale = Scalar(lu.permutationP().determinant() * lu.permutationQ().determinant()) *
                       u1.diagonal().prod();
  adjugate = (lu.permutationQ() * adjugate * lu.permutationP()).eval();
  return scale * adjugate.transpose();
}

}  // namespace detail

// +-det[J; t], dimensionless: zero on the fold and positive on the branch of smaller twist, which a
// prism takes that stands loaded by gravity (about 0.4 for the robot of T at rest). `moment_sign`
// (Prism::moment_sign) gives the mirror image of a shape the same value.
template <typename Scalar>
Scalar fold(const Rods<Scalar>& rods, Scalar moment_sign) {
  return -moment_sign * detail::bordered_jacobian(rods).determinant();
}

// Gradient of `fold` with respect to the tangent [1/m], exact at the fold as well.
template <typename Scalar>
Tangent<Scalar> fold_gradient(const Rods<Scalar>& rods, Scalar moment_sign) {
  const TangentMatrix<Scalar> cofactors = detail::cofactors(detail::bordered_jacobian(rods));
  // d det = sum_ij C_ij dA_ij. The last row adds nothing: its cofactors are parallel to t (both are
  // orthogonal to every row of J), and a unit vector changes across itself.
  Tangent<Scalar> gradient = Tangent<Scalar>::Zero();
  for (int k = 0; k < 9; ++k) {
    gradient += weighted_length_hessian<Scalar>(rods, Vector<Scalar, 9>::Unit(k)) *
                cofactors.row(k).transpose();
  }
  return -moment_sign * gradient;
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
  const Eigen::JacobiSVD<TangentMatrix<Scalar>, Eigen::NoQRPreconditioner> svd(
      bordered, Eigen::ComputeFullU | Eigen::ComputeFullV);
  FoldAnalysis<Scalar> analysis;
  analysis.singular_values = svd.singularValues().template tail<9>();
  analysis.motions = svd.matrixV().template rightCols<9>();
  analysis.self_stress = svd.matrixU().col(9).template head<9>();
  const TangentMatrix<Scalar> stiffness = weighted_length_hessian(rods, analysis.self_stress);
  const Tangent<Scalar> mechanism = analysis.mechanism();
  analysis.curvature = mechanism.dot(stiffness * mechanism);
  return analysis;
}

}  // namespace tensegrity::shape
