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
  using M3 = Matrix3<Scalar>;

  // `spin`: rate of a free rod about its own axis [rad/s], NaN: not measured.
  Foot(const B& belief, int endcap, Scalar radius, Scalar rod_length, const V3& normal,
       Scalar spin = std::numeric_limits<Scalar>::quiet_NaN())
      : even_(endcap / 2 * 2), base_(endcap < 2) {
    const M3& rotation = belief.rotation;
    if (base_) {
      const V3 arm = belief.base[std::size_t(endcap)];
      slip_ = belief.endcap_velocity(endcap) - radius * (rotation * belief.rate).cross(normal);
      by_gyro_bias_ = rotation * hat(arm) - radius * hat(normal) * rotation;
      by_even_ = M3::Identity();  // of v
      return;
    }
    const V3 u = (belief.endcap(even_) - belief.endcap(even_ + 1)).normalized();
    const V3 turn =
        (belief.endcap_velocity(even_) - belief.endcap_velocity(even_ + 1)) / rod_length;
    // (u x turn) x n = turn (u . n) - u (turn . n)
    const V3 about = u.cross(normal);
    const bool measured = !std::isnan(spin);
    const Scalar about_itself = measured ? spin : u.dot(rotation * belief.rate);
    slip_ = belief.endcap_velocity(endcap) -
            radius * (turn * u.dot(normal) - u * turn.dot(normal) + about_itself * about);
    by_even_ = -(radius / rod_length) * (u.dot(normal) * M3::Identity() - u * normal.transpose());
    by_odd_ = -by_even_;
    (endcap == even_ ? by_even_ : by_odd_) += M3::Identity();
    if (!measured) by_gyro_bias_ = radius * about * (u.transpose() * rotation);
  }

  // Velocity of the touching point, world [m/s].
  const V3& slip() const { return slip_; }

  // Row of slip . direction.
  Row<Scalar> along(const V3& direction) const {
    Row<Scalar> row;
    row.add(B::endcap_velocity_index(even_), by_even_.transpose() * direction);
    if (!base_) row.add(B::endcap_velocity_index(even_ + 1), by_odd_.transpose() * direction);
    row.add(B::kGyroBias, by_gyro_bias_.transpose() * direction);
    return row;
  }

 private:
  int even_;
  bool base_;
  V3 slip_;
  M3 by_even_ = M3::Zero(), by_odd_ = M3::Zero(), by_gyro_bias_ = M3::Zero();
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
