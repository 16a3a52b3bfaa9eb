// From the right-invariant error of a column of the group to its error in the world.
#pragma once

#include "tensegrity/inekf/body_error.hpp"
#include "tensegrity/math/so3.hpp"

namespace tensegrity::inekf {

// The block of three on the diagonal at `at`, of which the lower triangle is read.
template <typename Covariance>
Matrix3<typename Covariance::Scalar> symmetric_block(const Covariance& covariance, int at) {
  return covariance.template block<3, 3>(at, at).template selfadjointView<Eigen::Lower>();
}

// Covariance of the world error of a column x (a velocity or a position) whose invariant error xi_x
// starts at `at` of `covariance`, after that of the rotation: dx = xi_x - x x xi_R.
template <typename Covariance, typename Column>
auto column_covariance(const Covariance& covariance, const Column& column, int at) {
  using M3 = Matrix3<typename Covariance::Scalar>;
  const M3 c = hat(column);
  const M3 cross = covariance.template block<3, 3>(at, BodyError::kRotation) * c.transpose();
  return M3(symmetric_block(covariance, at) - cross - cross.transpose() +
            c * symmetric_block(covariance, BodyError::kRotation) * c.transpose());
}

}  // namespace tensegrity::inekf
