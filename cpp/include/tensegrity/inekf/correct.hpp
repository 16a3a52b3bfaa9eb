// The measurement update (T eqs. 12-14) for any linearised measurement z = H e + n.
//
// A measurement says what it sees through two products, P H^T and H (P H^T); the structure of H
// stays with the model that knows it (contacts select blocks).
#pragma once

#include "tensegrity/inekf/belief.hpp"
#include "tensegrity/math/ldlt.hpp"
#include "tensegrity/math/symmetric.hpp"

namespace tensegrity::inekf {

// A linearised measurement of `Rows` rows, of a belief with at most `Anchors` anchors: fewer make
// every matrix smaller.
template <typename B, int Rows, int Anchors = B::MaxAnchors>
struct Innovation {
  using Scalar = typename B::Scalar;
  static constexpr int kStates = padded(B::kAnchors + 3 * Anchors);
  Vector<Scalar, Rows> residual;        // z = H e + n
  Matrix<Scalar, kStates, Rows> cross;  // P H^T
  Matrix<Scalar, Rows> covariance;      // S = H P H^T + N, lower triangle
};

template <typename Scalar>
struct Correction {
  Status status = Status::kOk;
  Scalar chi_square = 0;  // z^T S^-1 z, for as many degrees of freedom as rows
};

// Applies the update unless z^T S^-1 z exceeds `gate` (0: no gate). On kRejected or kNotFinite the
// belief is as it was.
//
// With S = L D L^T, y = L^-1 z and W = P H^T L^-T: e = W D^-1 y and P <- P - W D^-1 W^T.
template <typename B, int Rows, int Anchors, typename Scalar = typename B::Scalar>
Correction<Scalar> correct(B& belief, const Innovation<B, Rows, Anchors>& innovation, Scalar gate) {
  constexpr int kStates = Innovation<B, Rows, Anchors>::kStates;
  Correction<Scalar> result;
  Ldlt<Scalar, Rows> factors;
  if (!factors.factor(innovation.covariance)) {
    result.status = Status::kNotFinite;
    return result;
  }
  const Vector<Scalar, Rows> y = factors.forward(innovation.residual);
  const Vector<Scalar, Rows> weighted = factors.inverse_diagonal().cwiseProduct(y);
  const Scalar chi_square = y.dot(weighted);
  result.chi_square = chi_square;
  if (!std::isfinite(chi_square)) {
    result.status = Status::kNotFinite;
    return result;
  }
  if (gate > 0 && chi_square > gate) {
    result.status = Status::kRejected;
    return result;
  }
  Matrix<Scalar, kStates, Rows> w;
  Sum<Scalar, kStates, Rows> error;
  for (int j = 0; j < Rows; ++j) {
    Sum<Scalar, kStates, Rows> column;
    column.add(Scalar(1), &innovation.cross(0, j));
    for (int k = 0; k < j; ++k) column.add(-factors.l(j, k), &w(0, k));
    column.store(&w(0, j));
    error.add(weighted[j], &w(0, j));
  }
  typename B::ErrorVector e = B::ErrorVector::Zero();
  error.store(&e[0]);
  for (int j = 0; j < Rows; ++j) w.col(j) *= std::sqrt(factors.inverse_diagonal()[j]);
  subtract_outer(belief.covariance, w, Rows, kStates);
  belief.retract(e);
  return result;
}

}  // namespace tensegrity::inekf
