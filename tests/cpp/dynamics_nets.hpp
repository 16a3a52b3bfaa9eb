// Nets and states for the tests of the dynamics.
#pragma once

#include <Eigen/Core>
#include <random>

#include "tensegrity/dynamics/simulator.hpp"

namespace dynamics_nets {

template <typename Scalar>
using Net = tensegrity::dynamics::Net<Scalar>;
template <typename Scalar>
using States = typename tensegrity::dynamics::Simulator<Scalar>::States;
template <typename Scalar>
using Lengths = typename tensegrity::dynamics::Simulator<Scalar>::Vector;

// Nodes of 2 kg without members, neither gravity nor ground.
template <typename Scalar>
Net<Scalar> free_nodes(int nodes) {
  Net<Scalar> net;
  net.nodes = nodes;
  net.node_mass = 2;
  net.ground.stiffness = net.ground.damping = 0;
  net.gravity.setZero();
  return net;
}

// One node of 2 kg on the ground.
template <typename Scalar>
Net<Scalar> node_on_ground() {
  Net<Scalar> net;
  net.nodes = 1;
  net.node_mass = 2;
  return net;
}

// Three rods and nine cables, neither gravity nor ground.
template <typename Scalar>
Net<Scalar> free_prism(Scalar cable_damping) {
  Net<Scalar> net = free_nodes<Scalar>(6);
  for (int i = 0; i < 6; i += 2) net.rods.push_back({i, i + 1, 2000, 0, Scalar(1.5)});
  const int ends[9][2] = {{0, 4}, {0, 2}, {2, 4}, {1, 5}, {1, 3}, {3, 5}, {1, 4}, {0, 3}, {2, 5}};
  for (const auto& e : ends) net.cables.push_back({e[0], e[1], 300, cable_damping, Scalar(0.5)});
  return net;
}

template <typename Scalar>
Lengths<Scalar> rest_lengths(const Net<Scalar>& net) {
  Lengths<Scalar> lengths(Eigen::Index(net.cables.size()));
  for (std::size_t k = 0; k < net.cables.size(); ++k) {
    lengths[Eigen::Index(k)] = net.cables[k].rest_length;
  }
  return lengths;
}

// Simulations of free_prism near its two triangles, with all cables taut, in motion.
template <typename Scalar>
States<Scalar> prism_states(int simulations) {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> noise(-0.05, 0.05);
  States<Scalar> states(simulations, 36);
  for (int row = 0; row < simulations; ++row) {
    for (int node = 0; node < 6; ++node) {
      const double angle = (120.0 * (node / 2) - (node % 2 ? 150 : 0)) * 3.14159265358979 / 180;
      const double place[3] = {0.55 * std::cos(angle), 0.55 * std::sin(angle),
                               node % 2 ? 1.0 : 2.0};
      for (int k = 0; k < 3; ++k) {
        states(row, 3 * node + k) = Scalar(place[k] + noise(generator));
        states(row, 18 + 3 * node + k) = Scalar(10 * noise(generator));
      }
    }
  }
  return states;
}

// Kinetic and elastic energy of one simulation [J], without gravity and ground.
inline double energy(const Net<double>& net, const States<double>& states, Eigen::Index row = 0) {
  const Eigen::Index n3 = 3 * net.nodes;
  double sum = 0.5 * net.node_mass * states.row(row).tail(n3).squaredNorm();
  const auto stretch = [&](const tensegrity::dynamics::Member<double>& m) {
    const auto vector =
        states.row(row).segment<3>(3 * m.to) - states.row(row).segment<3>(3 * m.from);
    return vector.norm() - m.rest_length;
  };
  for (const auto& rod : net.rods) sum += 0.5 * rod.stiffness * stretch(rod) * stretch(rod);
  for (const auto& cable : net.cables) {
    const double taut = std::max(0.0, stretch(cable));
    sum += 0.5 * cable.stiffness * taut * taut;
  }
  return sum;
}

}  // namespace dynamics_nets
