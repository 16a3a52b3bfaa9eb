// A tensegrity as a spring-mass net (C §IV-A; C = Caluwaerts et al. 2016): point masses at the
// nodes, joined by rods and cables with linear stiffness and damping, over flat ground.
#pragma once

#include <cmath>
#include <vector>

#include "tensegrity/types.hpp"

namespace tensegrity::dynamics {

// A rod or a cable between the nodes `from` and `to`.
template <typename Scalar>
struct Member {
  int from = 0;
  int to = 0;
  Scalar stiffness = 0;    // [N/m]
  Scalar damping = 0;      // [N s/m]
  Scalar rest_length = 0;  // [m]
};

// The plane z = 0, see ground.hpp. Without stiffness and damping there is no ground.
template <typename Scalar>
struct Ground {
  Scalar stiffness = Scalar(1e4);           // normal force per depth [N/m]
  Scalar damping = Scalar(2e3);             // normal force per depth and speed [N s/m^2]
  Scalar friction_stiffness = Scalar(1e4);  // of a standing node [N/m]
  Scalar friction_damping = Scalar(200);    // of a standing node [N s/m]
  Scalar friction_static = Scalar(0.64);
  Scalar friction_kinetic = Scalar(0.54);
};

template <typename Scalar>
struct Net {
  int nodes = 0;
  Scalar node_mass = 1;  // of every node [kg]
  std::vector<Member<Scalar>> rods;
  std::vector<Member<Scalar>> cables;  // pull, never push
  Ground<Scalar> ground;
  Vector3<Scalar> gravity{0, 0, Scalar(-9.81)};  // [m/s^2]
};

// Whether the numbers describe a net: finite, of the right sign, with members between its nodes.
template <typename Scalar>
bool valid(const Net<Scalar>& net) {
  const auto not_negative = [](Scalar value) { return std::isfinite(value) && value >= 0; };
  const auto members_valid = [&](const std::vector<Member<Scalar>>& members) {
    for (const Member<Scalar>& m : members) {
      if (m.from < 0 || m.from >= net.nodes || m.to < 0 || m.to >= net.nodes || m.from == m.to) {
        return false;
      }
      if (!not_negative(m.stiffness) || !not_negative(m.damping) || !not_negative(m.rest_length)) {
        return false;
      }
    }
    return true;
  };
  const Ground<Scalar>& g = net.ground;
  return net.nodes > 0 && std::isfinite(net.node_mass) && net.node_mass > 0 &&
         members_valid(net.rods) && members_valid(net.cables) && not_negative(g.stiffness) &&
         not_negative(g.damping) && std::isfinite(g.friction_stiffness) &&
         g.friction_stiffness > 0 && not_negative(g.friction_damping) &&
         not_negative(g.friction_kinetic) && std::isfinite(g.friction_static) &&
         g.friction_static >= g.friction_kinetic && net.gravity.allFinite();
}

}  // namespace tensegrity::dynamics
