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

#include "tensegrity/tight/foot_rows.hpp"

namespace tensegrity::tight {

// What the feet of one instant have in common. Packets are vectors of three.
template <typename Scalar>
struct Ground {
  using P = Packet<Scalar>;

  explicit Ground(const Belief<Scalar>& belief)
      : height(belief.ground[0]),
        up(Vector3<Scalar>(-belief.ground[1], -belief.ground[2], 1)),
        steepness(std::sqrt(P::dot(up, up))),
        normal((1 / steepness) * up),
        across_y(Vector3<Scalar>(1, 0, belief.ground[1])),
        base_rate(Vector3<Scalar>(belief.rotation * belief.rate)) {
    across_y = (1 / std::sqrt(P::dot(across_y, across_y))) * across_y;
    for (int k = 0; k < 3; ++k) {
      to_body[std::size_t(k)] = P(Vector3<Scalar>(belief.rotation.row(k).transpose()));
    }
  }

  // R' x
  P in_body(const P& x) const {
    P y = x.at(0) * to_body[0];
    y.add(x.at(1), to_body[1]);
    y.add(x.at(2), to_body[2]);
    return y;
  }

  Scalar height;          // m0
  P up;                   // (-m1, -m2, 1)
  Scalar steepness;       // |up|
  P normal;               // n
  P across_y;             // unit vector along the ground, across the world's y
  P base_rate;            // angular velocity of the base rod, world [rad/s]
  Block<Scalar> to_body;  // R'
};

template <typename Scalar>
class Foot {
 public:
  using B = Belief<Scalar>;
  using P = Packet<Scalar>;

  // `ground`: that of the belief; it has to outlive the foot. `spin`: rate of a free rod about its
  // own axis, toward its even endcap [rad/s], NaN: not measured.
  Foot(const B& belief, const Ground<Scalar>& ground, int endcap, Scalar radius, Scalar rod_length,
       Scalar spin = std::numeric_limits<Scalar>::quiet_NaN())
      : ground_(ground),
        endcap_(endcap),
        center_(belief.endcap(endcap)),
        slip_(belief.endcap_velocity(endcap)),
        height_(P::dot(ground.up, center_) - ground.height - radius * ground.steepness) {
    const P& n = ground.normal;
    if (base()) {
      slip_.subtract(radius, P::cross(ground.base_rate, n));
      arm_ = radius * ground.in_body(n) - P(belief.base[std::size_t(endcap)]);
      return;
    }
    const int other = endcap ^ 1;
    const P span = center_ - P(belief.endcap(other));
    const Scalar length = std::sqrt(P::dot(span, span));
    if (length > 0) axis_ = (1 / length) * span;
    const P turn = slip_ - P(belief.endcap_velocity(other));  // times the rod's length
    about_ = P::cross(axis_, n);
    by_gyro_ = std::isnan(spin);
    const Scalar about_itself = by_gyro_         ? P::dot(axis_, ground.base_rate)
                                : endcap < other ? spin
                                                 : -spin;
    // (u x turn) x n = turn (u . n) - u (turn . n)
    rolling_ = radius / rod_length;
    slip_.subtract(rolling_ * P::dot(axis_, n), turn);
    slip_.add(rolling_ * P::dot(turn, n), axis_);
    slip_.subtract(radius * about_itself, about_);
    arm_ = radius * ground.in_body(axis_);
  }

  // Velocity of the touching point, world [m/s].
  const P& slip() const { return slip_; }
  // Of its centre above the plane less the radius, along (-m1, -m2, 1): zero [m].
  Scalar height() const { return height_; }

  // Rows of slip . first, slip . second, slip . n and of the height.
  FootRows<Scalar> rows(const P& first, const P& second) const {
    const P& n = ground_.normal;
    FootRows<Scalar> rows;
    if (base()) {
      // d . (R hat(b) - r hat(n) R) = ((r R' n - b) x R' d)'
      const auto by_gyro = [&](const P& d) { return P::cross(arm_, ground_.in_body(d)); };
      rows.add_slip(B::kVelocity, first, second, n);
      rows.add_slip(B::kGyroBias, by_gyro(first), by_gyro(second), by_gyro(n));
      rows.limit_across(2);
    } else {
      // Of its own velocity the rod's turn takes r/L ((u . n) d - (u . d) n), of the other's as
      // much with the other sign.
      const P by_normal = rolling_ * n;
      const Scalar by_direction = rolling_ * P::dot(axis_, n);
      const auto by_other = [&](const P& d) {
        P h = by_direction * d;
        h.subtract(P::dot(axis_, d), by_normal);
        return h;
      };
      const P other_first = by_other(first), other_second = by_other(second);
      rows.add_slip(B::endcap_velocity_index(endcap_), first - other_first, second - other_second,
                    n);
      rows.add_slip(B::endcap_velocity_index(endcap_ ^ 1), other_first, other_second);
      if (by_gyro_) {
        rows.add_slip(B::kGyroBias, P::dot(about_, first) * arm_, P::dot(about_, second) * arm_);
      }
    }
    rows.set_height(0, B::endcap_index(endcap_), ground_.up);
    rows.set_height(1, B::kRotation, P::cross(center_, ground_.up));
    rows.set_height(2, B::kGround, {Scalar(-1), -center_.at(0), -center_.at(1), Scalar(1)});
    return rows;
  }

 private:
  bool base() const { return endcap_ < 2; }

  const Ground<Scalar>& ground_;
  int endcap_;
  P center_, slip_;
  Scalar height_;
  P arm_;  // of the base rod r R' n - b, of a free one r R' u
  // Of a free rod: its direction u toward this endcap, u x n, r/L, and whether the base rod's gyro
  // stands for its spin.
  P axis_, about_;
  Scalar rolling_ = 0;
  bool by_gyro_ = false;
};

}  // namespace tensegrity::tight
