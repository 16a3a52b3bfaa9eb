// Linear algebra of matrices whose size is known at run time, without allocation.
//
// Eigen's decompositions of matrices of any size take temporary memory from the heap, and its
// products do when their packed operands pass 128 kB. Here decompositions are loops over columns,
// which lie next to each other in memory, and products go in panels small enough for the stack.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace tensegrity::ukf {

template <typename Scalar>
using MatrixX = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
template <typename Scalar>
using VectorX = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
template <typename Scalar>
using MatrixRef = Eigen::Ref<MatrixX<Scalar>>;
template <typename Scalar>
using ConstMatrixRef = Eigen::Ref<const MatrixX<Scalar>>;
template <typename Scalar>
using VectorRef = Eigen::Ref<VectorX<Scalar>>;
template <typename Scalar>
using ConstVectorRef = Eigen::Ref<const VectorX<Scalar>>;

constexpr int kPanel = 40;   // columns: two panels hold SUPERball's 72 states
constexpr int kDepth = 160;  // rows that are summed at once

// c <- c + factor * a' b. With `lower`, c is square and only panels that touch its lower triangle
// are formed.
template <typename Scalar>
void add_product(MatrixRef<Scalar> c, const ConstMatrixRef<Scalar>& a,
                 const ConstMatrixRef<Scalar>& b, Scalar factor, bool lower = false) {
  for (Eigen::Index j = 0; j < c.cols(); j += kPanel) {
    const Eigen::Index columns = std::min<Eigen::Index>(kPanel, c.cols() - j);
    for (Eigen::Index i = lower ? j : 0; i < c.rows(); i += kPanel) {
      const Eigen::Index rows = std::min<Eigen::Index>(kPanel, c.rows() - i);
      for (Eigen::Index k = 0; k < a.rows(); k += kDepth) {
        const Eigen::Index depth = std::min<Eigen::Index>(kDepth, a.rows() - k);
        c.block(i, j, rows, columns).noalias() +=
            factor * a.block(k, i, depth, rows).transpose() * b.block(k, j, depth, columns);
      }
    }
  }
}

// Copies the lower triangle to the upper one.
template <typename Scalar>
void mirror_lower(MatrixRef<Scalar> p) {
  for (Eigen::Index j = 1; j < p.cols(); ++j) {
    for (Eigen::Index i = 0; i < j; ++i) p(i, j) = p(j, i);
  }
}

// Lower triangular root with root root' = p; reads the lower triangle of p, writes zeros above the
// root's diagonal. A pivot that is zero to rounding, or below, gives a column of zeros: a
// semidefinite p has no variance in that direction. So does one whose root would have no square.
template <typename Scalar>
void cholesky(const ConstMatrixRef<Scalar>& p, MatrixRef<Scalar> root) {
  const Eigen::Index n = p.rows();
  using Limits = std::numeric_limits<Scalar>;
  const Scalar tiny = Scalar(n) * Limits::epsilon();
  constexpr Scalar kLeast = Limits::min() / Limits::epsilon();
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::Index rest = n - j;
    Scalar* column = &root(j, j);
    for (Eigen::Index i = 0; i < j; ++i) root(i, j) = 0;
    for (Eigen::Index i = 0; i < rest; ++i) column[i] = p(j + i, j);
    Eigen::Index k = 0;
    for (; k + 4 <= j; k += 4) {
      const Scalar *c0 = &root(j, k), *c1 = &root(j, k + 1), *c2 = &root(j, k + 2),
                   *c3 = &root(j, k + 3);
      const Scalar f0 = c0[0], f1 = c1[0], f2 = c2[0], f3 = c3[0];
      for (Eigen::Index i = 0; i < rest; ++i) {
        column[i] -= f0 * c0[i] + f1 * c1[i] + f2 * c2[i] + f3 * c3[i];
      }
    }
    for (; k < j; ++k) {
      const Scalar* c0 = &root(j, k);
      const Scalar f0 = c0[0];
      for (Eigen::Index i = 0; i < rest; ++i) column[i] -= f0 * c0[i];
    }
    const Scalar pivot = column[0];
    if (!(pivot > tiny * p(j, j)) || pivot < kLeast) {
      for (Eigen::Index i = 0; i < rest; ++i) column[i] = 0;
      continue;
    }
    const Scalar scale = 1 / std::sqrt(pivot);
    for (Eigen::Index i = 0; i < rest; ++i) column[i] *= scale;
  }
}

// b <- root^-1 b, for a lower triangular root without zeros on its diagonal.
template <typename Scalar>
void solve_lower(const ConstMatrixRef<Scalar>& root, MatrixRef<Scalar> b) {
  const Eigen::Index n = root.rows();
  for (Eigen::Index c = 0; c < b.cols(); ++c) {
    Scalar* x = &b(0, c);
    for (Eigen::Index j = 0; j < n; ++j) {
      x[j] /= root(j, j);
      const Scalar factor = x[j];
      const Scalar* column = root.data() + j * root.outerStride();
      for (Eigen::Index i = j + 1; i < n; ++i) x[i] -= factor * column[i];
    }
  }
}

// Upper triangular r with r' r = a' a, on the first a.cols() rows of a, by Householder reflections;
// zeros below. a has at least as many rows as columns.
template <typename Scalar>
void triangularise(MatrixRef<Scalar> a) {
  const Eigen::Index rows = a.rows();
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    Scalar* v = &a(0, j);
    auto tail = a.col(j).tail(rows - j);
    const Scalar norm = tail.norm();
    if (!(norm * norm > std::numeric_limits<Scalar>::min())) {  // its square is rounding
      tail.setZero();
      continue;
    }
    const Scalar diagonal = v[j] > 0 ? -norm : norm;
    v[j] -= diagonal;
    const Scalar factor = 1 / (diagonal * v[j]);  // -2 / |v|^2
    for (Eigen::Index c = j + 1; c < a.cols(); ++c) {
      auto other = a.col(c).tail(rows - j);
      other += (factor * tail.dot(other)) * tail;
    }
    tail.setZero();
    v[j] = diagonal;
  }
}

// root root' <- root root' + sign * x x' (sign = 1 or -1); x is used up. False when nothing
// positive would be left of a direction; only a part of x x' is subtracted then.
template <typename Scalar>
bool rank_one_update(MatrixRef<Scalar> root, VectorRef<Scalar> x, Scalar sign) {
  const Eigen::Index n = root.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    const Scalar d = root(j, j), squared = d * d + sign * x[j] * x[j];
    if (!(squared > 0)) {
      if (x[j] == 0) continue;  // no variance here, and none asked for
      return false;
    }
    const Scalar r = std::sqrt(squared);
    if (d == 0) {  // this direction had no variance: all of it comes from x
      for (Eigen::Index i = j; i < n; ++i) root(i, j) = x[i];
      if (root(j, j) < 0) root.col(j).tail(n - j) *= Scalar(-1);
      return true;
    }
    const Scalar c = r / d, s = x[j] / d;
    root(j, j) = r;
    for (Eigen::Index i = j + 1; i < n; ++i) {
      root(i, j) = (root(i, j) + sign * s * x[i]) / c;
      x[i] = c * x[i] - s * root(i, j);
    }
  }
  return true;
}

}  // namespace tensegrity::ukf
