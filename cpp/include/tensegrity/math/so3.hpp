// Rotations: the group SO(3) and the integrals of its exponential.
//
// Every Lie group in this folder offers the same names: Dof, Tangent, Exp, Log, Adj, inverse,
// operator*, and the left Jacobian J_l with Exp(x + J_l(x)^-1 dx) ~ Exp(dx) Exp(x).
#pragma once

#include <cmath>

#include "tensegrity/math/packet.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity {

// The skew-symmetric matrix of a vector: hat(a) b = a x b.
template <typename Derived>
Matrix3<typename Derived::Scalar> hat(const Eigen::MatrixBase<Derived>& a) {
  Matrix3<typename Derived::Scalar> m;
  m << 0, -a(2), a(1), a(2), 0, -a(0), -a(1), a(0), 0;
  return m;
}

// The vector of a skew-symmetric matrix, the inverse of `hat`.
template <typename Derived>
Vector3<typename Derived::Scalar> vee(const Eigen::MatrixBase<Derived>& m) {
  return {m(2, 1), m(0, 2), m(1, 0)};
}

// c_m = sum_k (-a^2)^k / (2 k + m)! for the angle a: what the integrals of a rotation are made of.
template <typename Scalar>
struct RotationSeries {
  Scalar squared_angle;  // a^2
  Scalar c0, c1, c2, c3, c4;

  explicit RotationSeries(Scalar a2) : squared_angle(a2) {
    // Stable for small angles.
    if (a2 < small_angle_squared()) {
      c1 = cubic(a2, 1, over(-6), over(120), over(-5040));
      c2 = cubic(a2, over(2), over(-24), over(720), over(-40320));
      c3 = cubic(a2, over(6), over(-120), over(5040), over(-362880));
      c4 = cubic(a2, over(24), over(-720), over(40320), over(-3628800));
    } else {
      const Scalar a = std::sqrt(a2);
      c1 = std::sin(a) / a;
      c2 = (1 - std::cos(a)) / a2;
      c3 = (1 - c1) / a2;
      c4 = (Scalar(0.5) - c2) / a2;
    }
    c0 = 1 - a2 * c2;
  }

  // (dc_m/da) / a = (c_{m-1} - m c_m) / a^2, which cancels for small a: there by its series, whose
  // next term is below 1e-12 of it at a = 0.3.
  struct Slopes {
    Scalar c2, c3, c4;
  };
  Slopes slopes() const {
    const Scalar a2 = squared_angle;
    if (a2 < Scalar(0.1)) {
      return {cubic(a2, over(-12), over(180), over(-6720), over(453600)),
              cubic(a2, over(-60), over(1260), over(-60480), over(4989600)),
              cubic(a2, over(-360), over(10080), over(-604800), over(59875200))};
    }
    const Scalar inverse = 1 / a2;
    return {(c1 - 2 * c2) * inverse, (c2 - 3 * c3) * inverse, (c3 - 4 * c4) * inverse};
  }

  // Below this the series above is exact to rounding: the first omitted term is a^8 / 9! of one.
  static constexpr Scalar small_angle_squared() {
    return sizeof(Scalar) == sizeof(float) ? Scalar(0.05) : Scalar(0.01);
  }

 private:
  static constexpr Scalar over(int n) { return Scalar(1) / Scalar(n); }
  // k0 + k1 x + k2 x^2 + k3 x^3, in halves that do not wait for each other.
  static Scalar cubic(Scalar x, Scalar k0, Scalar k1, Scalar k2, Scalar k3) {
    return (k0 + k1 * x) + x * x * (k2 + k3 * x);
  }
};

// Gamma_m(x) = sum_k hat(x)^k / (k + m)!  (Bloesch et al. 2013; Hartley et al. 2020, eq. 33).
//
// Gamma_0 = Exp, Gamma_1 = left Jacobian, Gamma_2 appears in the position integral of a constant
// specific force. All three share one sine and cosine.
template <typename Scalar>
struct Gamma {
  Matrix3<Scalar> g0, g1, g2;

  explicit Gamma(const Vector3<Scalar>& x) {
    const RotationSeries<Scalar> s(x.squaredNorm());
    g0 = sum(x, 1, s.c1, s.c2);
    g1 = sum(x, 1, s.c2, s.c3);
    g2 = sum(x, Scalar(0.5), s.c3, s.c4);
  }

 private:
  // a I + b hat(x) + c hat(x)^2
  static Matrix3<Scalar> sum(const Vector3<Scalar>& v, Scalar a, Scalar b, Scalar c) {
    const Scalar x = v[0], y = v[1], z = v[2];
    const Scalar cxy = c * x * y, cxz = c * x * z, cyz = c * y * z;
    Matrix3<Scalar> m;
    m << a - c * (y * y + z * z), cxy - b * z, cxz + b * y,  //
        cxy + b * z, a - c * (x * x + z * z), cyz - b * x,   //
        cxz - b * y, cyz + b * x, a - c * (x * x + y * y);
    return m;
  }
};

template <typename Scalar>
class SO3 {
 public:
  static constexpr int Dof = 3;
  using Tangent = Vector3<Scalar>;  // rotation vector [rad]

  SO3() : rotation_(Matrix3<Scalar>::Identity()) {}
  explicit SO3(const Matrix3<Scalar>& rotation) : rotation_(rotation) {}

  static SO3 Exp(const Tangent& x) { return SO3(Gamma<Scalar>(x).g0); }

  Tangent Log() const {
    const Matrix3<Scalar>& r = rotation_;
    const Tangent axis = vee(r - r.transpose()) / 2;  // sin(angle) * axis
    const Scalar sine = axis.norm();
    const Scalar cosine = (r.trace() - 1) / 2;
    const Scalar angle = std::atan2(sine, cosine);
    if (cosine < Scalar(-0.99)) {  // near half a turn the axis is in the symmetric part
      const Matrix3<Scalar> s = (r + r.transpose()) / 2 - cosine * Matrix3<Scalar>::Identity();
      int k = 0;
      s.diagonal().maxCoeff(&k);
      const Tangent direction = s.col(k).normalized();
      return direction.dot(axis) < 0 ? Tangent(-angle * direction) : Tangent(angle * direction);
    }
    if (sine < Scalar(1e-4)) {
      return axis * (1 + sine * sine / 6);
    }
    return axis * (angle / sine);
  }

  SO3 inverse() const { return SO3(rotation_.transpose()); }
  SO3 operator*(const SO3& other) const { return SO3(rotation_ * other.rotation_); }
  Vector3<Scalar> operator*(const Vector3<Scalar>& point) const { return rotation_ * point; }

  Matrix3<Scalar> Adj() const { return rotation_; }
  const Matrix3<Scalar>& matrix() const { return rotation_; }

  static Matrix3<Scalar> left_jacobian(const Tangent& x) { return Gamma<Scalar>(x).g1; }

  static Matrix3<Scalar> left_jacobian_inverse(const Tangent& x) {
    const Scalar a2 = x.squaredNorm();
    Scalar c;
    if (a2 < RotationSeries<Scalar>::small_angle_squared()) {
      c = (1 + a2 / 60 * (1 + a2 / 42)) / 12;
    } else {
      const Scalar a = std::sqrt(a2);
      c = 1 / a2 - std::cos(a / 2) / (2 * a * std::sin(a / 2));
    }
    const Matrix3<Scalar> w = hat(x);
    return Matrix3<Scalar>::Identity() - w / 2 + c * w * w;
  }

 private:
  Matrix3<Scalar> rotation_;
};

// The rotation that takes the unit vector `from` to the unit vector `to` without spinning about it.
template <typename Scalar>
Matrix3<Scalar> shortest_rotation(const Vector3<Scalar>& from, const Vector3<Scalar>& to) {
  const Vector3<Scalar> axis = from.cross(to);
  const Scalar sine = axis.norm(), cosine = from.dot(to);
  if (sine < Scalar(1e-6)) {
    if (cosine > 0) return Matrix3<Scalar>::Identity();
    const Vector3<Scalar> any = from.unitOrthogonal();  // half a turn about it
    return 2 * any * any.transpose() - Matrix3<Scalar>::Identity();
  }
  return SO3<Scalar>::Exp(axis / sine * std::atan2(sine, cosine)).matrix();
}

// Pulls a matrix that has drifted by rounding back onto SO(3): one Newton step of the polar
// decomposition, exact to second order in the drift.
template <typename Scalar>
Block<Scalar> orthonormalized(const Block<Scalar>& r) {
  using P = Packet<Scalar>;
  // (R + R^-T) / 2 with R^-T the cofactors over their determinant 1 + d, to second order 1 - d.
  const Block<Scalar> cofactors = {P::cross(r[1], r[2]), P::cross(r[2], r[0]),
                                   P::cross(r[0], r[1])};
  const P volume = r[0] * cofactors[0];
  const Scalar inverse = 2 - (volume.at(0) + volume.at(1) + volume.at(2));
  Block<Scalar> out;
  for (std::size_t j = 0; j < 3; ++j) out[j] = Scalar(0.5) * r[j] + (inverse / 2) * cofactors[j];
  return out;
}

}  // namespace tensegrity
