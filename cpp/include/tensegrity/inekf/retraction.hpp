// Takes an estimated error out of the group part of a mean: X <- Exp(-xi) X (T eq. 13).
#pragma once

#include "tensegrity/math/so3.hpp"

namespace tensegrity::inekf {

// Column by column: R <- Gamma_0 R, x <- Gamma_0 x - Gamma_1 xi_x, with Gamma_m of -xi_R.
template <typename Scalar>
class Retraction {
 public:
  using P = Packet<Scalar>;

  // `xi_r`: error of the rotation, three numbers.
  explicit Retraction(const Scalar* xi_r) {
    const Vector3<Scalar> x(-xi_r[0], -xi_r[1], -xi_r[2]);
    const RotationSeries<Scalar> c(x.squaredNorm());
    // Column k of Gamma_m: c_m e_k + c_{m+1} x cross e_k + c_{m+2} x_k x.
    const P axis(x);
    const Block<Scalar> unit = {P::constant(1, 0, 0, 0), P::constant(0, 1, 0, 0),
                                P::constant(0, 0, 1, 0)};
    for (int k = 0; k < 3; ++k) {
      const std::size_t column = std::size_t(k);
      const P across = P::cross(axis, unit[column]), along = x[k] * axis;
      turn_[column] = c.c0 * unit[column];
      turn_[column].add(c.c1, across), turn_[column].add(c.c2, along);
      shift_[column] = c.c1 * unit[column];
      shift_[column].add(c.c2, across), shift_[column].add(c.c3, along);
    }
  }

  void move(Matrix3<Scalar>& rotation) const {
    store_block(orthonormalized(Block<Scalar>{multiply(turn_, rotation.col(0)),
                                              multiply(turn_, rotation.col(1)),
                                              multiply(turn_, rotation.col(2))}),
                rotation);
  }
  // A column x of the group and its error.
  template <typename Column>
  void move(Column&& column, const Scalar* error) const {
    (multiply(turn_, column) - multiply(shift_, error)).store_vector(column);
  }

 private:
  Block<Scalar> turn_, shift_;  // Gamma_0, Gamma_1
};

}  // namespace tensegrity::inekf
