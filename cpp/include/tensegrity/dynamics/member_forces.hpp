// Forces of rods and cables on the nodes they join.
#pragma once

#include <Eigen/Core>

#include "tensegrity/dynamics/lanes.hpp"

namespace tensegrity::dynamics {

// A member with what its force needs, ready for the loop over simulations.
template <typename Scalar>
struct MemberConstants {
  Eigen::Index from;    // first coordinate of the node
  Eigen::Index to;      // and of the other one
  Scalar stiffness;     // K [N/m]
  Scalar damping;       // c [N s/m]
  Scalar rest_tension;  // K L0 [N]
};

enum class Pushes { kYes, kNo };

// Adds the member's pull on its ends to `force` [N], all laid out as node * 3 + coordinate.
//
// The force density (C §IV-A)
//   q = K (1 - L0 / L) + (c / L) dL/dt,   dL/dt = U . V / L
// times the vector U = to - from pulls `from` toward `to`. (The paper prints the damping with the
// opposite sign, which would feed energy into the net.) A cable has no force while it is slack, and
// its damping never makes it push.
template <typename Scalar, Pushes pushes>
inline void add_member_force(const MemberConstants<Scalar>& m,
                             const typename Lanes<Scalar>::Vector* position,
                             const typename Lanes<Scalar>::Vector* velocity,
                             typename Lanes<Scalar>::Vector* force) {
  using L = Lanes<Scalar>;
  using Vector = typename L::Vector;
  const Vector *xa = position + m.from, *xb = position + m.to;
  const Vector *va = velocity + m.from, *vb = velocity + m.to;
  const Vector ux = xb[0] - xa[0], uy = xb[1] - xa[1], uz = xb[2] - xa[2];
  const Vector wx = vb[0] - va[0], wy = vb[1] - va[1], wz = vb[2] - va[2];
  // Ends that meet (within a micrometre) have no direction to push each other in: then U = 0 ends
  // the force, and the bound keeps it from becoming 0 / 0.
  const Vector square = L::max(ux * ux + uy * uy + uz * uz, L::fill(Scalar(1e-12)));
  const Vector inverse = L::inverse_sqrt(square);
  const Vector spring = m.stiffness - m.rest_tension * inverse;
  Vector density = spring + m.damping * (ux * wx + uy * wy + uz * wz) * (inverse * inverse);
  if constexpr (pushes == Pushes::kNo) {
    density = spring > Vector{} ? L::positive(density) : Vector{};
  }
  const Vector fx = density * ux, fy = density * uy, fz = density * uz;
  Vector *fa = force + m.from, *fb = force + m.to;
  fa[0] += fx;
  fa[1] += fy;
  fa[2] += fz;
  fb[0] -= fx;
  fb[1] -= fy;
  fb[2] -= fz;
}

}  // namespace tensegrity::dynamics
