// The measurement update (T eqs. 12-14) for any linearised measurement z = H e + n.
//
// A measurement says what it sees through two products, P H^T and H (P H^T); the structure of H
// stays with the model that knows it (contacts select blocks).
#pragma once

#include "tensegrity/inekf/belief.hpp"
#include "tensegrity/math/ldlt.hpp"
#include "tensegrity/math/symmetric.hpp"

namespace tensegrity::inekf {

// A linearised measurement z = H e + n of `Rows` rows, of a belief with at most `Anchors` anchors:
// fewer make every matrix smaller. Its parts are stacked as one elimination wants them.
template <typename B, int Rows, int Anchors = B::MaxAnchors>
struct Innovation {
  using Scalar = typename B::Scalar;
  static constexpr int kStates = padded(B::kAnchors + 3 * Anchors);
  using System = Ldlt<Scalar, Rows, kStates>;
  System system;

  void set_residual(const Vector<Scalar, Rows>& z) { system.set_right(z); }
  auto cross() { return system.below(); }        // P H'
  auto covariance() { return system.matrix(); }  // S = H P H' + N, lower triangle
};

template <typename Scalar>
struct Correction {
  Status status = Status::kOk;
  Scalar chi_square = 0;  // z' S^-1 z, for as many degrees of freedom as rows
};

// Applies the update unless z' S^-1 z exceeds `gate` (0: no gate). On kRejected or kNotFinite the
// belief is as it was. Uses the innovation up. Only the lower triangle of P is read and written.
//
// With S = L D L', y = L^-1 z and W = P H' L^-T: e = W D^-1 y and P <- P - W D^-1 W'.
template <typename B, int Rows, int Anchors, typename Scalar = typename B::Scalar>
Correction<Scalar> correct(B& belief, Innovation<B, Rows, Anchors>& innovation, Scalar gate) {
  constexpr int kStates = Innovation<B, Rows, Anchors>::kStates;
  Correction<Scalar> result;
  auto& system = innovation.system;
  if (!system.factor()) {
    result.status = Status::kNotFinite;
    return result;
  }
  Sum<Scalar, kStates, Rows> error;
  for (int j = 0; j < Rows; ++j) {
    const Scalar weighted = system.inverse_diagonal()[j] * system.yd(j);
    result.chi_square += weighted * system.yd(j);
    error.add(weighted, system.wd(j));
  }
  if (!std::isfinite(result.chi_square)) {
    result.status = Status::kNotFinite;
    return result;
  }
  if (gate > 0 && result.chi_square > gate) {
    result.status = Status::kRejected;
    return result;
  }
  typename B::ErrorVector e = B::ErrorVector::Zero();
  error.store(&e[0]);
  auto w = innovation.cross();
  for (int j = 0; j < Rows; ++j) w.col(j) *= std::sqrt(system.inverse_diagonal()[j]);
  subtract_outer(belief.covariance, w, Rows, kStates);
  belief.retract(e);
  return result;
}

}  // namespace tensegrity::inekf
