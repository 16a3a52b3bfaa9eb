// The shape of the prism as two free rods (T §V).
//
// The base rod r01 is the body frame, so a shape is where rods r23 and r45 are: a centre c and a
// unit direction u (from the odd to the even endcap) each. That is 10 degrees of freedom, against
// 9 cable lengths. Every derivative here is with respect to the tangent vector
//
//   delta = (dc23, L/2 du23, dc45, L/2 du45)   dimensions 3 + 2 + 3 + 2, all in metres,
//
// where du is written in an orthonormal basis of the plane across the rod. With that scaling the
// endcaps of a free rod move by dc +- (L/2 du), and the tangent metric is Euclidean.
//
// All vectors are in the body frame, all lengths in metres.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "tensegrity/robot/prism.hpp"
#include "tensegrity/types.hpp"

namespace tensegrity::shape {

inline constexpr int kTangent = 10;

template <typename Scalar>
using Tangent = Vector<Scalar, kTangent>;
template <typename Scalar>
using TangentMatrix = Matrix<Scalar, kTangent>;
template <typename Scalar>
using EndcapJacobian = Matrix<Scalar, 18, kTangent>;  // dq/dtangent, q stacked by endcap
template <typename Scalar>
using LengthJacobian = Matrix<Scalar, 9, kTangent>;  // dl/dtangent

// Free rod an endcap belongs to (0: r23, 1: r45), or -1 for the base rod.
constexpr int free_rod(int endcap) { return endcap / 2 - 1; }
// +1 for the even end of a rod, -1 for the odd one.
constexpr int rod_side(int endcap) { return endcap % 2 == 0 ? 1 : -1; }

template <typename Scalar>
class Rods {
 public:
  struct Rod {
    Vector3<Scalar> centre;
    // Orthonormal and right-handed: two directions across the rod, then its direction u. The frame
    // travels with the rod, so that a tangent covariance keeps its meaning from step to step.
    Matrix3<Scalar> frame;

    auto direction() const { return frame.col(2); }
    auto across() const { return frame.template leftCols<2>(); }
  };

  // The endcaps need to be in the body frame; a rod length that differs from the prism's is
  // corrected about the rod's centre. Precondition: q2 != q3 and q4 != q5.
  Rods(const Prism<Scalar>& prism, const Endcaps<Scalar>& endcaps)
      : half_length_(prism.rod_length / 2), base_{prism.endcap0(), prism.endcap1()} {
    for (int k = 0; k < 2; ++k) {
      const Vector3<Scalar> even = endcaps.col(2 * k + 2);
      const Vector3<Scalar> odd = endcaps.col(2 * k + 3);
      rods_[std::size_t(k)].centre = (even + odd) / 2;
      const Vector3<Scalar> u = even - odd;
      // The axis least aligned with u gives a well-conditioned plane across the rod.
      int axis = 0;
      u.cwiseAbs().minCoeff(&axis);
      set_direction(rods_[std::size_t(k)], u, Vector3<Scalar>::Unit(axis));
    }
  }

  const Rod& rod(int k) const { return rods_[std::size_t(k)]; }
  Scalar half_length() const { return half_length_; }
  // Endcap 0 or 1, in the body frame [m].
  const Vector3<Scalar>& base(int endcap) const { return base_[std::size_t(endcap)]; }

  // Endcap centres in the body frame, one per column [m].
  Endcaps<Scalar> endcaps() const {
    Endcaps<Scalar> q;
    q.col(0) = base_[0];
    q.col(1) = base_[1];
    for (int k = 0; k < 2; ++k) {
      q.col(2 * k + 2) =
          rods_[std::size_t(k)].centre + half_length_ * rods_[std::size_t(k)].direction();
      q.col(2 * k + 3) =
          rods_[std::size_t(k)].centre - half_length_ * rods_[std::size_t(k)].direction();
    }
    return q;
  }

  // Moves the shape by a tangent vector [m]. The direction is moved in the plane across the rod and
  // normalised: this agrees with the great circle to second order, so that the derivatives below
  // are exact to second order as well.
  void retract(const Tangent<Scalar>& delta) {
    for (int k = 0; k < 2; ++k) {
      Rod& rod = rods_[std::size_t(k)];
      const Scalar a = delta[5 * k + 3] / half_length_, b = delta[5 * k + 4] / half_length_;
      Vector3<Scalar> u;
      for (int i = 0; i < 3; ++i) {
        rod.centre[i] += delta[5 * k + i];
        u[i] = rod.frame(i, 2) + a * rod.frame(i, 0) + b * rod.frame(i, 1);
      }
      set_direction(rod, u, rod.frame.col(0));
    }
  }

  // Turns both free rods about the body z axis [rad]. Changes no cable length.
  void rotate_about_z(Scalar angle) { rotate_about_z(std::cos(angle), std::sin(angle)); }
  void rotate_about_z(Scalar cosine, Scalar sine) {
    const auto turn = [&](auto&& v) {
      const Scalar x = v[0], y = v[1];
      v[0] = cosine * x - sine * y;
      v[1] = sine * x + cosine * y;
    };
    for (Rod& rod : rods_) {
      turn(rod.centre);
      for (int k = 0; k < 3; ++k) turn(rod.frame.col(k));
    }
  }

  // Mirror image, y -> -y. Changes no cable length, but turns every mutual moment around.
  void reflect() {
    for (Rod& rod : rods_) {
      rod.centre.y() = -rod.centre.y();
      rod.frame.row(1) = -rod.frame.row(1);
      rod.frame.col(1) = -rod.frame.col(1);  // back to a right-handed frame
    }
  }

  // D = dq/dtangent, 18 x 10; the rows of endcap i are 3i..3i+2, the first six are zero.
  EndcapJacobian<Scalar> endcap_jacobian() const {
    EndcapJacobian<Scalar> jacobian = EndcapJacobian<Scalar>::Zero();
    for (int endcap = 2; endcap < 6; ++endcap) {
      const int k = free_rod(endcap);
      jacobian.template block<3, 3>(3 * endcap, 5 * k).setIdentity();
      jacobian.template block<3, 2>(3 * endcap, 5 * k + 3) =
          Scalar(rod_side(endcap)) * rods_[std::size_t(k)].across();
    }
    return jacobian;
  }

  static Matrix3<Scalar> rotation_about_z(Scalar angle) {
    return Eigen::AngleAxis<Scalar>(angle, Vector3<Scalar>::UnitZ()).toRotationMatrix();
  }

 private:
  // `along` is the rod's direction, of any length, `hint` any vector that is not parallel to it:
  // its part across becomes the first axis.
  static void set_direction(Rod& rod, const Vector3<Scalar>& along, const Vector3<Scalar>& hint) {
    // By components: Eigen's packets of two would wait for what is stored one by one. Both norms
    // come from dot products of what is given, |x|^2 |h - (h . x) x / |x|^2|^2 = |x|^2 |h|^2 -
    // (h . x)^2, so that neither root waits for the other.
    const auto dot = [](const Vector3<Scalar>& a, const Vector3<Scalar>& b) {
      return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const Scalar squared = dot(along, along), common = dot(along, hint);
    const Scalar by_length = 1 / std::sqrt(squared);
    const Scalar by_area = 1 / std::sqrt(squared * dot(hint, hint) - common * common);
    const Scalar scale = by_length * by_area;
    Vector3<Scalar> u, first;
    for (int i = 0; i < 3; ++i) {
      u[i] = by_length * along[i];
      first[i] = scale * (squared * hint[i] - common * along[i]);
    }
    rod.frame << first[0], u[1] * first[2] - u[2] * first[1], u[0],  //
        first[1], u[2] * first[0] - u[0] * first[2], u[1],           //
        first[2], u[0] * first[1] - u[1] * first[0], u[2];
  }

  Scalar half_length_;
  std::array<Vector3<Scalar>, 2> base_;  // q0, q1
  std::array<Rod, 2> rods_;
};

}  // namespace tensegrity::shape
