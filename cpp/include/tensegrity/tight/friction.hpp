// Which of the feet on the ground stand still, decided by friction.
//
// The cables pull on all feet at once and their distances have to follow: of three feet on the
// ground at most one can stand still, in general. Coulomb friction says which. With loads N_i and
// slip velocities s_i the robot moves so that the dissipated power sum mu N_i |s_i| is least (the
// principle of least dissipation, for motion that is slow against mu g: 0.01 s at walking speed).
// That is a likelihood of the slips, given their differences from the shape:
//
//   p(s) ~ exp(- sum_i share_i |s_i| dt / b),   share_i = N_i / sum N the share of the load,
//
// with one length b, the path that a fully loaded foot slips between two independent decisions.
// Feet that carry more slip less. The most probable velocity is the load-weighted geometric median
// of the velocities that the single feet stand for: exactly on one foot if its load outweighs the
// directed sum of the others', in between if none does. No foot is ever switched on or off.
//
// On a slope the ground has to carry the weight's part along it as well: with t = g_t / (mu g_n),
// the gravity along the plane over the greatest friction, sum share_i s_i / |s_i| = t, which adds
// - share_i t . s_i to the exponents. Only here the coefficient mu of friction matters.
//
// In the filter |s| is majorised at its predicted value (iteratively reweighted least squares): a
// zero-velocity measurement with the variance
//   (creep^2 + b |s| / share) / dt.
// The majorant has the right gradient, but its curvature is false along s, where |s| is straight: a
// sliding foot pulls, yet does not inform. So P is reduced along the slip only by the fraction
//   v0 / (v0 + |s|),
// and by the whole across it, where |s| truly curves. Three sliding feet then move the mean to the
// balance of friction and leave it as uncertain as it is.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "tensegrity/tight/feet.hpp"
#include "tensegrity/tight/feet_update.hpp"

namespace tensegrity::tight {

template <typename Scalar>
struct FootNoise {
  Scalar creep;        // of a foot that stands still [m/sqrt(s)]
  Scalar slip_length;  // b [m]
  Scalar slip_speed;   // v0 [m/s]
  Scalar rise;         // velocity across the ground [m/sqrt(s)]
  Scalar height;       // above the plane [m sqrt(s)]
  Scalar friction;     // mu, coefficient of friction [1]
};

// Shares below this are taken as this much: the direction of a foot that is hardly loaded would
// otherwise have no say even where it alone stands still [1].
inline constexpr double kLeastShare = 0.1;

// What a foot said before it corrected.
template <typename Scalar>
struct FootResult {
  Scalar speed;              // of its slip [m/s]
  Scalar height;             // above the ground [m]
  Scalar height_chi_square;  // one degree of freedom
};

// The feet on the ground for `dt` [s], up to Feet::kMost of them, and what each said. Feet whose
// numbers are not finite are left out; chi_square of those, and of all if nothing could be
// corrected, is NaN.
//
// How much a foot is believed to touch at all grows with the square of its share, up to a third:
// the foot that is about to lift off carries little, and holding it down would bend the shape.
template <typename Scalar>
std::array<FootResult<Scalar>, Feet<Scalar>::kMost> correct_feet(
    Belief<Scalar>& belief, const Foot<Scalar>* on_ground, int count, const Prism<Scalar>& robot,
    const FootNoise<Scalar>& noise, Scalar dt) {
  using P = Packet<Scalar>;
  using V = VectorLanes<Scalar>;
  std::array<FootResult<Scalar>, Feet<Scalar>::kMost> results{};
  if (count == 0) return results;
  const Ground<Scalar> ground(belief);
  const Feet<Scalar> feet(belief, ground, on_ground, count, robot.endcap_radius, robot.rod_length);
  const V& normal = feet.normal();
  const P rise = V::dot(normal, feet.slip());
  const V slip = feet.slip() - rise * normal;
  const P speed = P::sqrt(V::dot(slip, slip));
  const V along =
      V::where_greater(speed, Scalar(1e-6), (1 / speed) * slip, V::all(ground.across_y));
  const V across = V::cross(normal, along);

  alignas(4 * sizeof(Scalar)) Scalar shares[4]{};
  for (int k = 0; k < count; ++k) shares[k] = on_ground[k].share;
  const P share(shares), one = P::all(1);
  const auto at_least = [](const P& x, Scalar least) {
    return P::where_greater(x, least, x, P::all(least));
  };
  P variance = P::all(noise.creep * noise.creep / dt);
  variance.add((noise.slip_length / dt) / at_least(share, Scalar(kLeastShare)), speed);
  // t = (n n.z - e_z) / (mu n.z), of which n has no part in the directions along the ground.
  const Scalar downhill = -1 / (noise.friction * ground.normal.z());
  P in_contact = at_least(3 * share, Scalar(0.005));
  in_contact = P::where_greater(in_contact, Scalar(1), one, in_contact);
  const P distrust = 1 / (dt * (in_contact * in_contact));

  FeetUpdate<Scalar> update;
  feet.rows(across, along, update.rows());
  P pull = speed;
  pull.subtract(downhill * along.z, speed);
  update.set_residuals((-downhill * across.z) * speed, pull, rise, feet.height());
  update.set_variances(variance, variance, noise.rise * noise.rise * distrust,
                       noise.height * noise.height * distrust);
  update.set_information(one, noise.slip_speed / (P::all(noise.slip_speed) + speed), one, one);
  const auto finite = [&](int k) { return std::isfinite(speed.at(k) + feet.height().at(k)); };
  for (int k = 0; k < count; ++k) {
    if (!finite(k)) update.silence(k);
  }
  const bool corrected = update.apply(belief, count);
  for (int k = 0; k < count; ++k) {
    results[std::size_t(k)] = {speed.at(k), feet.height().at(k),
                               corrected && finite(k) ? update.chi_square(4 * k + 3)
                                                      : std::numeric_limits<Scalar>::quiet_NaN()};
  }
  return results;
}

}  // namespace tensegrity::tight
