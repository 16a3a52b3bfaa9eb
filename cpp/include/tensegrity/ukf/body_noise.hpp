// Random displacements of a robot of rods: as one body, and of every node on its own, but never
// along a rod, whose ends keep their distance.
#pragma once

#include <array>
#include <vector>

#include "tensegrity/math/so3.hpp"
#include "tensegrity/types.hpp"
#include "tensegrity/ukf/dense.hpp"

namespace tensegrity::ukf {

// out <- covariance (3n x 3n) of the displacements of n nodes at `positions` (3n):
//   body^2 of a translation, and of a rotation about the centre that moves a node at the root mean
//   square radius as far; node^2 of each node, without the part that stretches its rod.
template <typename Scalar>
void displacement_covariance(const ConstVectorRef<Scalar>& positions,
                             const std::vector<std::array<int, 2>>& rods, Scalar body, Scalar node,
                             MatrixRef<Scalar> out) {
  const int n = int(positions.size() / 3);
  Vector3<Scalar> centre = Vector3<Scalar>::Zero();
  for (int i = 0; i < n; ++i) centre += positions.template segment<3>(3 * i) / Scalar(n);
  Scalar radius = 0;
  for (int i = 0; i < n; ++i) {
    radius += (positions.template segment<3>(3 * i) - centre).squaredNorm() / Scalar(n);
  }
  const Scalar turn = radius > 0 ? body * body / radius : Scalar(0);
  for (int j = 0; j < n; ++j) {
    const Vector3<Scalar> b = positions.template segment<3>(3 * j) - centre;
    for (int i = 0; i < n; ++i) {
      const Vector3<Scalar> a = positions.template segment<3>(3 * i) - centre;
      // hat(a) hat(b)' = (a . b) I - b a'
      Matrix3<Scalar> block = -turn * b * a.transpose();
      block.diagonal().array() += turn * a.dot(b) + body * body;
      out.template block<3, 3>(3 * i, 3 * j) = block;
    }
  }
  for (int i = 0; i < 3 * n; ++i) out(i, i) += node * node;
  for (const auto& rod : rods) {
    const Vector3<Scalar> axis =
        (positions.template segment<3>(3 * rod[1]) - positions.template segment<3>(3 * rod[0]))
            .normalized();
    const Matrix3<Scalar> stretch = (node * node / 2) * axis * axis.transpose();
    for (const int i : rod) {
      for (const int j : rod) {
        auto block = out.template block<3, 3>(3 * i, 3 * j);
        block += i == j ? Matrix3<Scalar>(-stretch) : stretch;
      }
    }
  }
}

// The covariance (6n x 6n) of positions and velocities after white accelerations of covariance
// `density` (3n x 3n) per second have acted for `duration` seconds on free nodes. `density` is
// the top left block of `out`.
template <typename Scalar>
void integrate_acceleration(MatrixRef<Scalar> out, Scalar duration) {
  const Eigen::Index n = out.rows() / 2;
  const Scalar t = duration;
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i) {
      const Scalar density = out(i, j);
      out(i, j) = density * t * t * t / 3;
      out(n + i, j) = out(i, n + j) = density * t * t / 2;
      out(n + i, n + j) = density * t;
    }
  }
}

}  // namespace tensegrity::ukf
