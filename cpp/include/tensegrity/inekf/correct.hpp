// The measurement update (T eqs. 12-14) for any linearised measurement z = H e + n.
//
// A measurement says what it sees through two products, P H^T and H (P H^T); the structure of H
// stays with the model that knows it (contacts select blocks, cables will touch a few columns).
#pragma once

#include <Eigen/Cholesky>

#include "tensegrity/inekf/belief.hpp"

namespace tensegrity::inekf {

// Sized at run time within a fixed capacity: nothing on the heap.
template <typename Scalar, int MaxRows>
using BoundedVector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1, 0, MaxRows, 1>;
template <typename Scalar, int MaxRows, int MaxCols = MaxRows>
using BoundedMatrix =
    Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic,
                  (MaxRows == 1 && MaxCols != 1) ? Eigen::RowMajor : Eigen::ColMajor, MaxRows,
                  MaxCols>;

// A linearised measurement of up to MaxRows rows.
template <typename B, int MaxRows>
struct Innovation {
  using Scalar = typename B::Scalar;
  BoundedVector<Scalar, MaxRows> residual;             // z = H e + n
  BoundedMatrix<Scalar, B::MaxDim, MaxRows> cross;     // P H^T
  BoundedMatrix<Scalar, MaxRows, MaxRows> covariance;  // S = H P H^T + N

  void resize(int dim, int rows) {
    residual.resize(rows);
    cross.resize(dim, rows);
    covariance.resize(rows, rows);
  }
};

struct Correction {
  Status status = Status::kOk;
  double chi_square = 0;  // z^T S^-1 z, for as many degrees of freedom as rows
};

// Applies the update unless z^T S^-1 z exceeds `gate` (0: no gate). On kRejected or kNotFinite the
// belief is as it was.
//
// The covariance update is Joseph's form (I - K H) P (I - K H)^T + K N K^T written with P H^T:
// A = P - K (P H^T)^T, then A - (P H^T - K S) K^T; the last bracket is the rounding error of K.
template <typename B, int MaxRows, typename Scalar = typename B::Scalar>
Correction correct(B& belief, const Innovation<B, MaxRows>& innovation, Scalar gate) {
  Correction result;
  const Eigen::LLT<BoundedMatrix<Scalar, MaxRows, MaxRows>> llt(innovation.covariance);
  if (llt.info() != Eigen::Success) {
    result.status = Status::kNotFinite;
    return result;
  }
  const int n = belief.dim();
  using Gain = BoundedMatrix<Scalar, B::MaxDim, MaxRows>;
  const BoundedVector<Scalar, MaxRows> whitened = llt.matrixL().solve(innovation.residual);
  const Scalar chi_square = whitened.squaredNorm();
  result.chi_square = double(chi_square);
  if (!std::isfinite(chi_square)) {
    result.status = Status::kNotFinite;
    return result;
  }
  if (gate > 0 && chi_square > gate) {
    result.status = Status::kRejected;
    return result;
  }
  // K = P H^T S^-1
  Gain gain = innovation.cross;
  llt.matrixU().template solveInPlace<Eigen::OnTheRight>(gain);
  llt.matrixL().template solveInPlace<Eigen::OnTheRight>(gain);
  const typename B::ErrorVector error = gain * innovation.residual;

  auto p = belief.covariance.topLeftCorner(n, n);
  p.noalias() -= gain * innovation.cross.transpose();
  Gain rounding = innovation.cross;
  rounding.noalias() -= gain * innovation.covariance;
  p.noalias() -= rounding * gain.transpose();
  belief.symmetrize();
  belief.retract(error);
  return result;
}

}  // namespace tensegrity::inekf
