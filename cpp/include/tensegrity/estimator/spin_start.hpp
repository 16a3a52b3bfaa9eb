// The spin angle at rest, from gravity and the contacts there.
//
// Cables do not see the spin phi of the shape about the base rod. A robot at rest does: the
// endcaps on the ground are level, up . R_z(phi) (q_i - q_j) = 0.
#pragma once

#include <array>

#include "tensegrity/math/so3.hpp"
#include "tensegrity/robot/prism.hpp"

namespace tensegrity {

template <typename Scalar>
struct SpinStart {
  bool found = false;
  Scalar angle = 0;     // phi [rad]
  Scalar variance = 0;  // [rad^2]
};

template <typename Scalar>
Endcaps<Scalar> spun(const Endcaps<Scalar>& q, Scalar angle) {
  const Scalar c = std::cos(angle), s = std::sin(angle);
  Endcaps<Scalar> h;
  h.row(0) = c * q.row(0) - s * q.row(1);
  h.row(1) = s * q.row(0) + c * q.row(1);
  h.row(2) = q.row(2);
  return h;
}

// `up`: the world's vertical in the body frame. `contacts`: endcaps known to be on the ground; all
// false: the lowest three of each candidate are taken, and the levellest candidate wins.
// `height_std`: how well the reconstructed heights are known [m].
template <typename Scalar>
SpinStart<Scalar> find_spin(const Endcaps<Scalar>& q, const Vector3<Scalar>& up,
                            const std::array<bool, 6>& contacts, Scalar height_std) {
  const auto lowest_three = [](const Vector<Scalar, 6>& heights) {
    std::array<bool, 6> low{};
    for (int k = 0; k < 3; ++k) {
      int best = -1;
      for (int i = 0; i < 6; ++i) {
        if (!low[std::size_t(i)] && (best < 0 || heights[i] < heights[best])) best = i;
      }
      low[std::size_t(best)] = true;
    }
    return low;
  };
  int given = 0;
  for (const bool contact : contacts) given += contact;
  if (given == 1) return {};  // one point is always level

  struct Level {
    Scalar spread;     // sum of squared deviations from the mean height [m^2]
    Scalar slope;      // half its derivative
    Scalar curvature;  // Gauss-Newton approximation of half its second derivative
  };
  const auto level = [&](Scalar angle) {
    const Endcaps<Scalar> h = spun(q, angle);
    const Vector<Scalar, 6> heights = h.transpose() * up;
    // d(up . R_z q)/d(phi) = up . (e_z x h)
    const Vector<Scalar, 6> rates = (h.row(0) * up.y() - h.row(1) * up.x()).transpose();
    const std::array<bool, 6> on = given > 0 ? contacts : lowest_three(heights);
    Scalar n = 0, mean = 0, mean_rate = 0;
    for (int i = 0; i < 6; ++i) {
      if (!on[std::size_t(i)]) continue;
      n += 1;
      mean += heights[i];
      mean_rate += rates[i];
    }
    mean /= n;
    mean_rate /= n;
    Level result{0, 0, 0};
    for (int i = 0; i < 6; ++i) {
      if (!on[std::size_t(i)]) continue;
      result.spread += (heights[i] - mean) * (heights[i] - mean);
      result.slope += (heights[i] - mean) * (rates[i] - mean_rate);
      result.curvature += (rates[i] - mean_rate) * (rates[i] - mean_rate);
    }
    return result;
  };

  const Scalar two_pi = Scalar(6.283185307179586);
  constexpr int kGrid = 120;
  Scalar angle = 0, best = std::numeric_limits<Scalar>::max();
  for (int k = 0; k < kGrid; ++k) {
    const Scalar candidate = two_pi * (Scalar(k) / kGrid - Scalar(0.5));
    const Scalar spread = level(candidate).spread;
    if (spread < best) {
      best = spread;
      angle = candidate;
    }
  }
  for (int k = 0; k < 10; ++k) {
    const Level at = level(angle);
    if (!(at.curvature > 0)) return {};  // up is along the base rod: no spin is visible
    angle -= at.slope / at.curvature;
  }
  const Level at = level(angle);
  if (!(at.curvature > 0)) return {};
  return {true, angle, height_std * height_std / at.curvature};
}

}  // namespace tensegrity
