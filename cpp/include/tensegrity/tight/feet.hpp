// What an endcap on the ground says about the state.
//
// An endcap is a sphere of radius r on a plane with unit normal n. The point of it that touches
// moves with
//   s = w_i - r Omega x n,
// Omega the angular velocity of its rod. Across the plane s is zero while it stays on the ground,
// along the plane it is the slip (friction.hpp). Omega of the base rod is the gyro's. For the
// others the part across the rod follows from its endcaps, u x (w_a - w_b) / L; about its own axis,
// which nothing measures, a rod is taken to turn as the base rod does along it: the cables hold
// them.
#pragma once

#include <limits>

#include "tensegrity/tight/sequential_update.hpp"

namespace tensegrity::tight {

template <typename Scalar>
class Foot {
 public:
  using B = Belief<Scalar>;
  using V3 = Vector3<Scalar>;

  // `spin`: rate of a free rod about its own axis, toward its even endcap [rad/s], NaN: not
  // measured.
  Foot(const B& belief, int endcap, Scalar radius, Scalar rod_length, const V3& normal,
       Scalar spin = std::numeric_limits<Scalar>::quiet_NaN())
      : endcap_(endcap), normal_(normal), to_body_(belief.rotation.transpose()) {
    const V3 base_rate = belief.rotation * belief.rate;
    slip_ = belief.endcap_velocity(endcap);
    if (base()) {
      slip_ -= radius * base_rate.cross(normal);
      arm_ = radius * (to_body_ * normal) - belief.base[std::size_t(endcap)];
      return;
    }
    const int other = endcap ^ 1;
    axis_ = (belief.endcap(endcap) - belief.endcap(other)).normalized();
    const V3 turn = (slip_ - belief.endcap_velocity(other)) / rod_length;
    // (u x turn) x n = turn (u . n) - u (turn . n)
    about_ = axis_.cross(normal);
    by_gyro_ = std::isnan(spin);
    const Scalar about_itself = by_gyro_ ? axis_.dot(base_rate) : endcap < other ? spin : -spin;
    slip_ -= radius * (turn * axis_.dot(normal) - axis_ * turn.dot(normal) + about_itself * about_);
    rolling_ = radius / rod_length;
    arm_ = radius * (to_body_ * axis_);
  }

  // Velocity of the touching point, world [m/s].
  const V3& slip() const { return slip_; }

  // Row of slip . d.
  Row<Scalar> along(const V3& d) const {
    Row<Scalar> row;
    if (base()) {
      // d . (R hat(b) - r hat(n) R) = ((r R' n - b) x R' d)'
      row.add(B::kVelocity, d);
      row.add(B::kGyroBias, arm_.cross(to_body_ * d));
      return row;
    }
    // Of its own velocity the rod's turn takes r/L ((u . n) d - (u . d) n), of the other's as much
    // with the other sign.
    const V3 other = rolling_ * (axis_.dot(normal_) * d - axis_.dot(d) * normal_);
    row.add(B::endcap_velocity_index(endcap_), d - other);
    row.add(B::endcap_velocity_index(endcap_ ^ 1), other);
    if (by_gyro_) row.add(B::kGyroBias, about_.dot(d) * arm_);
    return row;
  }
  // Row of slip . n: across the plane the touching point of a free rod moves as its endcap does.
  Row<Scalar> rise() const {
    if (base()) return along(normal_);
    Row<Scalar> row;
    row.add(B::endcap_velocity_index(endcap_), normal_);
    return row;
  }

 private:
  bool base() const { return endcap_ < 2; }

  int endcap_;
  V3 normal_;
  Matrix3<Scalar> to_body_;  // R'
  V3 slip_;
  V3 arm_;  // of the base rod r R' n - b, of a free one r R' u
  // Of a free rod: its direction u toward this endcap, u x n, r/L, and whether the base rod's gyro
  // stands for its spin.
  V3 axis_, about_;
  Scalar rolling_;
  bool by_gyro_;
};

// Height of a touching endcap above the ground plane, along (-m1, -m2, 1): zero [m].
template <typename Scalar>
Scalar height(const Belief<Scalar>& belief, int endcap, Scalar radius) {
  const Vector3<Scalar> up(-belief.ground[1], -belief.ground[2], 1);
  return up.dot(belief.endcap(endcap)) - belief.ground[0] - radius * up.norm();
}

template <typename Scalar>
Row<Scalar> height_row(const Belief<Scalar>& belief, int endcap) {
  using B = Belief<Scalar>;
  const Vector3<Scalar> up(-belief.ground[1], -belief.ground[2], 1);
  const Vector3<Scalar> q = belief.endcap(endcap);
  Row<Scalar> row;
  row.add(B::endcap_index(endcap), up);
  row.add(B::kRotation, q.cross(up));
  row.add(B::kGround, Vector3<Scalar>(-1, -q.x(), -q.y()));
  return row;
}

}  // namespace tensegrity::tight
