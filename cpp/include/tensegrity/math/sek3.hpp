// SE_k(3): a rotation R and k vectors that it carries along (T eq. 2; Barrau & Bonnabel 2015).
//
// k = 1 is SE(3), k = 2 holds velocity and position, k = 2 + N adds N contact points. Tangents
// are ordered (rotation, column 1, ..., column k), each of three numbers.
#pragma once

#include "tensegrity/math/so3.hpp"

namespace tensegrity {

template <typename Scalar, int K>
class SEk3 {
 public:
  static constexpr int Dof = 3 + 3 * K;
  using Tangent = Vector<Scalar, Dof>;
  using Columns = Matrix<Scalar, 3, K>;

  SEk3() : rotation_(Matrix3<Scalar>::Identity()), columns_(Columns::Zero()) {}
  SEk3(const Matrix3<Scalar>& rotation, const Columns& columns)
      : rotation_(rotation), columns_(columns) {}

  static SEk3 Exp(const Tangent& x) {
    const Gamma<Scalar> gamma(x.template head<3>());
    return {gamma.g0, gamma.g1 * columns_of(x)};
  }

  Tangent Log() const {
    Tangent x;
    x.template head<3>() = SO3<Scalar>(rotation_).Log();
    const Matrix3<Scalar> inverse = SO3<Scalar>::left_jacobian_inverse(x.template head<3>());
    for (int k = 0; k < K; ++k) {
      x.template segment<3>(3 + 3 * k) = inverse * columns_.col(k);
    }
    return x;
  }

  SEk3 inverse() const { return {rotation_.transpose(), -rotation_.transpose() * columns_}; }
  SEk3 operator*(const SEk3& other) const {
    return {rotation_ * other.rotation_, (rotation_ * other.columns_) + columns_};
  }

  // Ad_X x = vee(X hat(x) X^-1).
  Matrix<Scalar, Dof> Adj() const {
    Matrix<Scalar, Dof> adjoint = Matrix<Scalar, Dof>::Zero();
    adjoint.template topLeftCorner<3, 3>() = rotation_;
    for (int k = 0; k < K; ++k) {
      adjoint.template block<3, 3>(3 + 3 * k, 0) = hat(columns_.col(k)) * rotation_;
      adjoint.template block<3, 3>(3 + 3 * k, 3 + 3 * k) = rotation_;
    }
    return adjoint;
  }

  static Matrix<Scalar, Dof> left_jacobian(const Tangent& x) {
    return assemble(x, SO3<Scalar>::left_jacobian(x.template head<3>()), /*inverse=*/false);
  }

  static Matrix<Scalar, Dof> left_jacobian_inverse(const Tangent& x) {
    return assemble(x, SO3<Scalar>::left_jacobian_inverse(x.template head<3>()), /*inverse=*/true);
  }

  Matrix<Scalar, 3 + K> matrix() const {
    Matrix<Scalar, 3 + K> m = Matrix<Scalar, 3 + K>::Identity();
    m.template topLeftCorner<3, 3>() = rotation_;
    m.template topRightCorner<3, K>() = columns_;
    return m;
  }

  const Matrix3<Scalar>& rotation() const { return rotation_; }
  const Columns& columns() const { return columns_; }

 private:
  static Columns columns_of(const Tangent& x) { return Eigen::Map<const Columns>(x.data() + 3); }

  // J_l of SE_k(3) is block lower triangular: J on the diagonal and Q(x_k, phi) in the first block
  // column; the inverse has J^-1 and -J^-1 Q J^-1 there.
  static Matrix<Scalar, Dof> assemble(const Tangent& x, const Matrix3<Scalar>& j, bool inverse) {
    Matrix<Scalar, Dof> jacobian = Matrix<Scalar, Dof>::Zero();
    jacobian.template topLeftCorner<3, 3>() = j;
    for (int k = 0; k < K; ++k) {
      const Matrix3<Scalar> q = cross_block(x.template segment<3>(3 + 3 * k), x.template head<3>());
      jacobian.template block<3, 3>(3 + 3 * k, 3 + 3 * k) = j;
      jacobian.template block<3, 3>(3 + 3 * k, 0) = inverse ? Matrix3<Scalar>(-j * q * j) : q;
    }
    return jacobian;
  }

  // Q(rho, phi) of Barfoot, State Estimation for Robotics, eq. (7.86b).
  static Matrix3<Scalar> cross_block(const Vector3<Scalar>& rho, const Vector3<Scalar>& phi) {
    const Scalar a2 = phi.squaredNorm();
    Scalar c1, c2, c3;
    // The closed forms lose about eps / a^5: the series takes over where it is the better one.
    if (a2 < (sizeof(Scalar) == sizeof(float) ? Scalar(0.25) : Scalar(0.01))) {
      c1 = (1 - a2 / 20 * (1 - a2 / 42 * (1 - a2 / 72))) / 6;
      c2 = (1 - a2 / 30 * (1 - a2 / 56 * (1 - a2 / 90))) / 24;
      c3 = (1 - a2 / 21 * (1 - a2 / 48 * (1 - a2 / Scalar(247.5)))) / 120;
    } else {
      const Scalar a = std::sqrt(a2);
      const Scalar s = std::sin(a), c = std::cos(a);
      c1 = (a - s) / (a2 * a);
      c2 = (a2 + 2 * c - 2) / (2 * a2 * a2);
      c3 = (2 * a - 3 * s + a * c) / (2 * a2 * a2 * a);
    }
    const Matrix3<Scalar> p = hat(phi), r = hat(rho);
    const Matrix3<Scalar> pr = p * r, rp = r * p, prp = pr * p;
    return r / 2 + c1 * (pr + rp + prp) + c2 * (p * pr + rp * p - 3 * prp) +
           c3 * (prp * p + p * prp);
  }

  Matrix3<Scalar> rotation_;
  Columns columns_;
};

}  // namespace tensegrity
