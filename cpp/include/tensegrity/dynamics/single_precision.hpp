// A net simulated in single precision, for a filter in double precision.
//
// Twice as many simulations fit into a register. Ten metres from the origin a coordinate is rounded
// to 1e-6 m, which is 0.1 N in a rod of 1e5 N/m: far below what springs and masses leave out of a
// robot. The filter's own sums stay in double precision.
#pragma once

#include "tensegrity/dynamics/simulator.hpp"

namespace tensegrity::dynamics {

template <typename To, typename From>
Net<To> net_cast(const Net<From>& net) {
  const auto members = [](const std::vector<Member<From>>& from) {
    std::vector<Member<To>> to;
    for (const Member<From>& m : from) {
      to.push_back({m.from, m.to, To(m.stiffness), To(m.damping), To(m.rest_length)});
    }
    return to;
  };
  const Ground<From>& g = net.ground;
  Net<To> result;
  result.nodes = net.nodes;
  result.node_mass = To(net.node_mass);
  result.rods = members(net.rods);
  result.cables = members(net.cables);
  result.ground = {To(g.stiffness),        To(g.damping),         To(g.friction_stiffness),
                   To(g.friction_damping), To(g.friction_static), To(g.friction_kinetic)};
  result.gravity = net.gravity.template cast<To>();
  return result;
}

// `Simulator<float>` with the interface of `Simulator<double>`, for up to `capacity` simulations.
class SinglePrecision {
 public:
  SinglePrecision(const Net<double>& net, int capacity)
      : simulator_(net_cast<float>(net)),
        states_(capacity, 6 * net.nodes),
        rest_lengths_(Eigen::VectorXf::Zero(Eigen::Index(net.cables.size()))) {}

  // As Simulator::step; kOutOfRange for more simulations than `capacity`.
  Status step(Eigen::Ref<Eigen::MatrixXd> states,
              const Eigen::Ref<const Eigen::VectorXd>& rest_lengths, double dt, int steps) {
    if (states.rows() > states_.rows() || states.cols() != states_.cols() ||
        rest_lengths.size() != rest_lengths_.size()) {
      return Status::kOutOfRange;
    }
    auto used = states_.topRows(states.rows());
    used = states.cast<float>();
    rest_lengths_ = rest_lengths.cast<float>();
    const Status status = simulator_.step(used, rest_lengths_, float(dt), steps);
    states = used.cast<double>();
    return status;
  }

 private:
  Simulator<float> simulator_;
  Eigen::MatrixXf states_;
  Eigen::VectorXf rest_lengths_;
};

}  // namespace tensegrity::dynamics
