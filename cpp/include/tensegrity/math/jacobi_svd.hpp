// Singular value decomposition of small matrices of fixed size in a bounded number of steps, by the
// one-sided Jacobi method (Hestenes 1958), which finds small singular values as exactly relative to
// themselves as large ones (Demmel & Veselic 1992).
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include "tensegrity/types.hpp"

namespace tensegrity {

// A = U diag(s) V' with orthogonal U and V and s in descending order, not negative. A matrix that
// is not finite gives a result that is not finite.
template <typename Scalar, int N>
class JacobiSvd {
 public:
  explicit JacobiSvd(const Matrix<Scalar, N>& a) : u_(a) {
    // Convergence is quadratic: six sweeps are usual for ten columns in double precision.
    for (int sweep = 0; sweep < kMostSweeps && !orthogonalise(); ++sweep) {
    }
    sort();
    normalise();
  }

  const Vector<Scalar, N>& singular_values() const { return singular_values_; }
  const Matrix<Scalar, N>& u() const { return u_; }
  const Matrix<Scalar, N>& v() const { return v_; }

 private:
  static constexpr int kMostSweeps = 12;

  // Turns every pair of columns of A V = U diag(s) once, so that they are orthogonal; true when all
  // of them were, to the rounding of their scalar product.
  bool orthogonalise() {
    constexpr Scalar kOrthogonal = N * std::numeric_limits<Scalar>::epsilon();
    bool orthogonal = true;
    for (int i = 0; i < N - 1; ++i) {
      for (int j = i + 1; j < N; ++j) {
        const Scalar ii = u_.col(i).squaredNorm(), jj = u_.col(j).squaredNorm();
        const Scalar ij = u_.col(i).dot(u_.col(j));
        if (!(std::abs(ij) > kOrthogonal * std::sqrt(ii) * std::sqrt(jj))) continue;
        orthogonal = false;
        // The smaller root t = tan of t^2 + 2 zeta t - 1 = 0.
        const Scalar zeta = (jj - ii) / (2 * ij);
        const Scalar t = std::copysign(1 / (std::abs(zeta) + std::hypot(Scalar(1), zeta)), zeta);
        const Scalar c = 1 / std::hypot(Scalar(1), t), s = c * t;
        turn(u_, i, j, c, s);
        turn(v_, i, j, c, s);
      }
    }
    return orthogonal;
  }

  static void turn(Matrix<Scalar, N>& m, int i, int j, Scalar c, Scalar s) {
    const Vector<Scalar, N> column = m.col(i);
    m.col(i) = c * column - s * m.col(j);
    m.col(j) = s * column + c * m.col(j);
  }

  void sort() {
    for (int j = 0; j < N; ++j) singular_values_[j] = u_.col(j).norm();
    for (int j = 0; j < N - 1; ++j) {
      int largest = j;
      for (int k = j + 1; k < N; ++k) {
        if (singular_values_[k] > singular_values_[largest]) largest = k;
      }
      if (largest == j) continue;
      std::swap(singular_values_[j], singular_values_[largest]);
      u_.col(j).swap(u_.col(largest));
      v_.col(j).swap(v_.col(largest));
    }
  }

  // However small it is, a column that is orthogonal to the others has a direction. One that is
  // nothing but rounding can be left parallel to them, and one whose square is below the range of
  // numbers has no direction: there any column that completes U will do.
  void normalise() {
    constexpr Scalar kSmallestSquare =
        std::numeric_limits<Scalar>::min() / std::numeric_limits<Scalar>::epsilon();
    for (int j = 0; j < N; ++j) {
      if (u_.col(j).squaredNorm() > kSmallestSquare) {
        u_.col(j) /= singular_values_[j];
        remove_previous(j);
      }
      if (!(u_.col(j).squaredNorm() > Scalar(0.5))) {
        u_.col(j) = Vector<Scalar, N>::Unit(least_spanned(j));
        remove_previous(j);
        remove_previous(j);  // what rounding left
      }
      u_.col(j).normalize();
    }
  }

  // The axis that the columns of U before `j` span least of.
  int least_spanned(int j) const {
    int axis = 0;
    Scalar least = std::numeric_limits<Scalar>::max();
    for (int i = 0; i < N; ++i) {
      Scalar spanned = 0;
      for (int k = 0; k < j; ++k) spanned += u_(i, k) * u_(i, k);
      if (spanned < least) {
        least = spanned;
        axis = i;
      }
    }
    return axis;
  }

  void remove_previous(int j) {
    for (int k = 0; k < j; ++k) u_.col(j) -= u_.col(k).dot(u_.col(j)) * u_.col(k);
  }

  Matrix<Scalar, N> u_;  // A V until it is normalised
  Matrix<Scalar, N> v_ = Matrix<Scalar, N>::Identity();
  Vector<Scalar, N> singular_values_;
};

}  // namespace tensegrity
