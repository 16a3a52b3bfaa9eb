// What endcaps on the ground say about the state.
//
// An endcap is a sphere of radius r on a plane with unit normal n. The point of it that touches
// moves with
//   s = w_i - r Omega x n,
// Omega the angular velocity of its rod. Across the plane s is zero while it stays on the ground,
// along the plane it is the slip (friction.hpp). Omega follows from the rod's endcaps across the
// rod, u x (w_a - w_b) / L, and about its own axis from the gyro of the base rod: what the others
// do about theirs nothing measures, and they are taken to turn as the base rod does along it, for
// the cables hold them.
//
// All feet at once, one in each lane of the packets: of a single one nearly all of the time goes by
// in waiting for roots and divisions.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "tensegrity/math/vector_lanes.hpp"
#include "tensegrity/tight/foot_rows.hpp"

namespace tensegrity::tight {

// An endcap that is on the ground.
template <typename Scalar>
struct Foot {
  int endcap;
  Scalar share;  // of the weight [1]
  // Of a free rod about its own axis, toward its even endcap [rad/s], NaN: not measured.
  Scalar spin = std::numeric_limits<Scalar>::quiet_NaN();
};

// What the feet of one instant have in common.
template <typename Scalar>
struct Ground {
  using V3 = Vector3<Scalar>;

  explicit Ground(const Belief<Scalar>& belief)
      : height(belief.ground[0]),
        up(-belief.ground[1], -belief.ground[2], 1),
        steepness(std::sqrt(up.squaredNorm())),
        normal((1 / steepness) * up),
        across_y((1 / std::sqrt(1 + belief.ground[1] * belief.ground[1])) *
                 V3(1, 0, belief.ground[1])),
        base_rate(belief.rotation * belief.rate) {}

  Scalar height;     // m0
  V3 up;             // (-m1, -m2, 1)
  Scalar steepness;  // |up|
  V3 normal;         // n
  V3 across_y;       // unit vector along the ground, across the world's y
  V3 base_rate;      // angular velocity of the base rod, world [rad/s]
};

template <typename Scalar>
class Feet {
 public:
  using B = Belief<Scalar>;
  using P = Packet<Scalar>;
  using V = VectorLanes<Scalar>;
  static constexpr int kMost = kMostFeet;

  // Of `count` feet, from one to kMost. `belief` and `ground`, that of the belief, have to outlive
  // this.
  TENSEGRITY_INLINE Feet(const B& belief, const Ground<Scalar>& ground, const Foot<Scalar>* feet,
                         int count, Scalar radius, Scalar rod_length)
      : belief_(belief),
        ground_(ground),
        normal_(V::all(ground.normal)),
        radius_(radius),
        rolling_(radius / rod_length) {
    const auto foot = [&](int k) { return feet[std::min(k, count - 1)]; };  // the last, repeated
    const Motion a = motion(foot(0)), b = motion(foot(1)), c = motion(foot(2));
    const auto gather = [&](P Motion::* part) { return V::of(a.*part, b.*part, c.*part, c.*part); };
    offset_ = gather(&Motion::offset);
    center_ = gather(&Motion::center);
    slip_ = gather(&Motion::velocity);
    const V along = gather(&Motion::span), turns = gather(&Motion::turn);
    base_ = {a.base, b.base, c.base, c.base};
    by_spin_ = {a.by_spin, b.by_spin, c.by_spin, c.by_spin};
    const P spin(a.spin, b.spin, c.spin, c.spin);
    for (int k = 0; k < kMost; ++k) endcaps_[k] = foot(k).endcap;

    const P square = V::dot(along, along);
    axis_ = P::where_greater(square, Scalar(0), 1 / P::sqrt(square), P()) * along;
    about_ = V::cross(axis_, normal_);
    axis_normal_ = V::dot(axis_, normal_);
    const P about_itself =
        P::where_greater(by_spin_, Scalar(0.5), spin, V::dot(axis_, V::all(ground.base_rate)));
    // (u x turn) x n = turn (u . n) - u (turn . n)
    slip_.subtract(rolling_ * axis_normal_, turns);
    slip_.add(rolling_ * V::dot(turns, normal_), axis_);
    slip_.subtract(radius * about_itself, about_);
    height_ =
        V::dot(V::all(ground.up), center_) - P::all(ground.height + radius * ground.steepness);
  }

  const V& normal() const { return normal_; }
  // Velocities of the touching points, world [m/s].
  const V& slip() const { return slip_; }
  // Of their centres above the plane less the radius, along (-m1, -m2, 1): zero [m].
  const P& height() const { return height_; }

  // Rows of slip . first, slip . second, slip . n and of the height, of kMost feet.
  TENSEGRITY_INLINE void rows(const V& first, const V& second, FootRows<Scalar>* out) const {
    const P zero;
    const V none{};
    // Of its own velocity a free rod's turn takes r/L ((u . n) d - (u . d) n), of the other's as
    // much with the other sign. The endcaps of the base rod move with the body.
    const P rolling = P::where_greater(base_, Scalar(0.5), zero, P::all(rolling_));
    const P by_direction = rolling * axis_normal_;
    const auto by_other = [&](const V& d) {
      V h = by_direction * d;
      h.subtract(rolling * V::dot(axis_, d), normal_);
      return h;
    };
    const V other_first = by_other(first), other_second = by_other(second);
    // Base rod: d . (R hat(b) - r hat(n) R) = ((r R' n - b) x R' d)'; free rods: about themselves.
    const V body_normal = in_body(normal_);
    const V base_arm = P::all(radius_) * body_normal - offset_;
    const V free_arm =
        P::where_greater(by_spin_, Scalar(0.5), zero, P::all(radius_)) * in_body(axis_);
    const auto by_gyro = [&](const V& d) {
      return V::where_greater(base_, Scalar(0.5), V::cross(base_arm, in_body(d)),
                              V::dot(about_, d) * free_arm);
    };
    const V gyro_across =
        V::where_greater(base_, Scalar(0.5), V::cross(base_arm, body_normal), none);
    const V lever = V::cross(center_, V::all(ground_.up));

    set_slip(out, 0, first - other_first, second - other_second, normal_);
    set_slip(out, 1, by_gyro(first), by_gyro(second), gyro_across);
    set_slip(out, 2, other_first, other_second, none);
    P by_rotation[4] = {lever.x, lever.y, lever.z, zero};
    P::transpose(by_rotation[0], by_rotation[1], by_rotation[2], by_rotation[3]);
    P by_ground[4] = {P::all(-1), zero - center_.x, zero - center_.y, zero};
    P::transpose(by_ground[0], by_ground[1], by_ground[2], by_ground[3]);
    const P up(ground_.up);
#pragma GCC unroll 3
    for (int k = 0; k < kMost; ++k) {
      out[k].set_height(0, B::endcap_index(endcaps_[k]), up);
      out[k].set_height(1, B::kRotation, by_rotation[k]);
      out[k].set_height(2, B::kGround, by_ground[k]);
      const bool base = endcaps_[k] < 2;
      out[k].limit(base ? 2 : 3, base ? 2 : 1);
    }
  }

 private:
  // Of one foot, vectors in the world if nothing else is said.
  struct Motion {
    P center, velocity;  // of its centre
    P span, turn;        // both less those of the other end of its rod
    P offset;            // b_i, body, of the base rod
    Scalar base, by_spin, spin;
  };
  TENSEGRITY_INLINE Motion motion(const Foot<Scalar>& foot) const {
    const int own = foot.endcap, other = own ^ 1;
    // Their fourth numbers do not matter.
    const auto packet = [](const auto& v) { return P(v[0], v[1], v[2], v[2]); };
    const auto column = [&](int c) { return packet(belief_.columns.col(c)); };
    if (own >= 2) {
      const P center = column(own), velocity = column(own + 4);
      const bool by_spin = !std::isnan(foot.spin);
      return {center, velocity,  center - column(other), velocity - column(other + 4),
              P(),    Scalar(0), Scalar(by_spin),        own < other ? foot.spin : -foot.spin};
    }
    const Block<Scalar> rotation = {packet(belief_.rotation.col(0)),
                                    packet(belief_.rotation.col(1)),
                                    packet(belief_.rotation.col(2))};
    const Vector3<Scalar>& b = belief_.base[std::size_t(own)];
    const Vector3<Scalar> along = b - belief_.base[std::size_t(other)];
    return {column(1) + multiply(rotation, b),
            column(0) + multiply(rotation, belief_.rate.cross(b)),
            multiply(rotation, along),
            multiply(rotation, belief_.rate.cross(along)),
            packet(b),
            Scalar(1),
            Scalar(0),
            Scalar(0)};
  }

  V in_body(const V& v) const { return V::transposed_times(belief_.rotation, v); }

  // A block of three columns of the slip's rows.
  TENSEGRITY_INLINE void set_slip(FootRows<Scalar>* out, int block, const V& first, const V& second,
                                  const V& across) const {
    P x[4] = {first.x, second.x, across.x, P()};
    P y[4] = {first.y, second.y, across.y, P()};
    P z[4] = {first.z, second.z, across.z, P()};
    P::transpose(x[0], x[1], x[2], x[3]);
    P::transpose(y[0], y[1], y[2], y[3]);
    P::transpose(z[0], z[1], z[2], z[3]);
#pragma GCC unroll 3
    for (int k = 0; k < kMost; ++k) {
      const int at = block == 1
                         ? B::kGyroBias
                         : B::endcap_velocity_index(block == 0 ? endcaps_[k] : endcaps_[k] ^ 1);
      out[k].set_slip(block, at, x[k], y[k], z[k]);
    }
  }

  const B& belief_;
  const Ground<Scalar>& ground_;
  int endcaps_[kMost];
  V normal_, center_, slip_;
  P height_;
  // Of each rod: its direction u toward this endcap, u x n, u . n; r, r/L.
  V axis_, about_;
  P axis_normal_;
  Scalar radius_, rolling_;
  V offset_;          // of endcaps of the base rod, body
  P base_, by_spin_;  // 1: of the base rod; of a rod whose spin is measured
};

}  // namespace tensegrity::tight
