// Contact of a node with the plane z = 0 by penalty, with Coulomb friction.
//
// Normal force: a spring whose damping grows with the depth d,
//   N = max(0, d (k - c dz/dt)),
// so that it sets in and ends without a jump, and never pulls.
//
// Friction after Yamane & Nakamura 2006, "Stable penalty-based model of frictional contacts": a
// node stands on a spring and a damper between it and its anchor a, the point where it came to
// stand,
//   t = -k_t (x - a) - c_t dx/dt,
// as long as t lies in the cone of static friction, |t| <= mu_s N. Beyond, it slides: the friction
// is mu_k N in the direction of t, and the anchor is dragged along, no farther behind than the
// spring can pull with mu_k N. The force is a continuous function of the velocity through zero:
// nothing chatters. Anchors move between steps alone, so that all stages of one step see one right
// side.
//
// An anchor is memory beside positions and velocities, which sigma points, drawn anew at every
// update, do not have. They start with the anchor under the node, the spring unloaded: friction
// then remembers for one prediction. A loaded foot yields by |t| / k_t (2 mm for 20 N) per
// prediction, where a law of the velocity alone, with a slope that explicit steps can integrate,
// would let it creep as long as it is loaded.
#pragma once

#include "tensegrity/dynamics/lanes.hpp"
#include "tensegrity/dynamics/net.hpp"

namespace tensegrity::dynamics {

enum class Anchors { kStay, kFollow };

// Adds the ground's force on one node to `force` (x, y, z) [N]. `position` [m] and `velocity` [m/s]
// are its three coordinates, `anchor` its two. With Anchors::kFollow the anchor is moved as the
// state demands: once at the begin of every step.
template <typename Scalar, Anchors anchors>
inline void add_ground_force(const Ground<Scalar>& ground,
                             const typename Lanes<Scalar>::Vector* position,
                             const typename Lanes<Scalar>::Vector* velocity,
                             typename Lanes<Scalar>::Vector* anchor,
                             typename Lanes<Scalar>::Vector* force) {
  using L = Lanes<Scalar>;
  using Vector = typename L::Vector;
  if (!L::any_negative(position[2])) {  // most nodes are in the air, in all simulations alike
    if constexpr (anchors == Anchors::kFollow) {
      anchor[0] = position[0];
      anchor[1] = position[1];
    }
    return;
  }
  // Keeps 0 / 0 out of directions that do not matter: forces of 1e-12 N, lengths of 1e-12 m.
  const Vector tiny = L::fill(Scalar(1e-24));
  const Vector depth = L::positive(-position[2]);
  const Vector normal = L::positive(depth * (ground.stiffness - ground.damping * velocity[2]));
  const Vector ex = position[0] - anchor[0], ey = position[1] - anchor[1];
  const Vector tx = -ground.friction_stiffness * ex - ground.friction_damping * velocity[0];
  const Vector ty = -ground.friction_stiffness * ey - ground.friction_damping * velocity[1];
  const Vector square = tx * tx + ty * ty;
  const Vector cone = ground.friction_static * normal;
  const auto stands = square <= cone * cone;
  const Vector kinetic = ground.friction_kinetic * normal;
  const Vector scale = stands ? L::fill(1) : kinetic * L::inverse_sqrt(L::max(square, tiny));
  force[0] += scale * tx;
  force[1] += scale * ty;
  force[2] += normal;
  if constexpr (anchors == Anchors::kFollow) {
    const Vector stretch = kinetic * (1 / ground.friction_stiffness) *
                           L::inverse_sqrt(L::max(ex * ex + ey * ey, tiny));
    const Vector kept = stands ? L::fill(1) : L::min(stretch, L::fill(1));
    anchor[0] = position[0] - kept * ex;
    anchor[1] = position[1] - kept * ey;
  }
}

}  // namespace tensegrity::dynamics
