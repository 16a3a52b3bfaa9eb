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

#include "tensegrity/tight/feet.hpp"
#include "tensegrity/tight/sequential_update.hpp"

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

// One foot on the ground for `dt` [s]. `spin` as in feet.hpp.
//
// How much a foot is believed to touch at all grows with the square of its share, up to a third:
// the foot that is about to lift off carries little, and holding it down would bend the shape.
template <typename Scalar>
FootResult<Scalar> correct_foot(SequentialUpdate<Scalar>& update, const Belief<Scalar>& belief,
                                const Ground<Scalar>& ground, int endcap, Scalar share,
                                const Prism<Scalar>& robot, const FootNoise<Scalar>& noise,
                                Scalar dt, Scalar spin = std::numeric_limits<Scalar>::quiet_NaN()) {
  using P = Packet<Scalar>;
  const P& normal = ground.normal;
  const Foot<Scalar> foot(belief, ground, endcap, robot.endcap_radius, robot.rod_length, spin);
  const Scalar rise = P::dot(normal, foot.slip());
  P slip = foot.slip();
  slip.subtract(rise, normal);
  const Scalar speed = std::sqrt(P::dot(slip, slip));
  const P along = speed > Scalar(1e-6) ? (1 / speed) * slip : ground.across_y;
  const P across = P::cross(normal, along);

  const Scalar variance = (noise.creep * noise.creep +
                           noise.slip_length * speed / std::max(share, Scalar(kLeastShare))) /
                          dt;
  // t = (n n.z - e_z) / (mu n.z), of which n has no part in the directions along the ground.
  const Scalar downhill = -1 / (noise.friction * normal.at(2));
  const Scalar belief_in_contact = std::min(std::max(3 * share, Scalar(0.005)), Scalar(1));
  const Scalar distrust = 1 / (dt * belief_in_contact * belief_in_contact);
  const P chi_squares = update.correct(
      foot.rows(across, along),
      {-speed * downhill * across.at(2), speed * (1 - downhill * along.at(2)), rise, foot.height()},
      {variance, variance, noise.rise * noise.rise * distrust,
       noise.height * noise.height * distrust},
      {Scalar(1), noise.slip_speed / (noise.slip_speed + speed), Scalar(1), Scalar(1)});
  return {speed, foot.height(), chi_squares.at(3)};
}

}  // namespace tensegrity::tight
