// Simulations of spring-mass nets, in double and single precision.
#include "bindings.hpp"
#include "tensegrity/dynamics/simulator.hpp"

namespace tensegrity::bindings {

namespace {

using dynamics::Ground;
using dynamics::Integrator;
using dynamics::Member;
using dynamics::Net;

std::vector<Member<double>> members(
    const Eigen::Ref<const Eigen::Matrix<int, Eigen::Dynamic, 2>>& ends,
    const Eigen::VectorXd& stiffness, const Eigen::VectorXd& damping,
    const Eigen::VectorXd& rest_length) {
  if (stiffness.size() != ends.rows() || damping.size() != ends.rows() ||
      rest_length.size() != ends.rows()) {
    throw py::value_error("stiffness, damping and rest_length: expected one number per member");
  }
  std::vector<Member<double>> result;
  for (Eigen::Index k = 0; k < ends.rows(); ++k) {
    result.push_back({ends(k, 0), ends(k, 1), stiffness[k], damping[k], rest_length[k]});
  }
  return result;
}

template <typename Scalar>
std::vector<Member<Scalar>> cast(const std::vector<Member<double>>& members) {
  std::vector<Member<Scalar>> result;
  for (const Member<double>& m : members) {
    result.push_back({m.from, m.to, Scalar(m.stiffness), Scalar(m.damping), Scalar(m.rest_length)});
  }
  return result;
}

template <typename Scalar>
Net<Scalar> cast(const Net<double>& net) {
  const Ground<double>& g = net.ground;
  return {net.nodes,
          Scalar(net.node_mass),
          cast<Scalar>(net.rods),
          cast<Scalar>(net.cables),
          {Scalar(g.stiffness), Scalar(g.damping), Scalar(g.friction_stiffness),
           Scalar(g.friction_damping), Scalar(g.friction_static), Scalar(g.friction_kinetic)},
          net.gravity.cast<Scalar>()};
}

template <typename Scalar>
void bind_simulator(py::module_& m, const char* name, const char* summary) {
  using Simulator = dynamics::Simulator<Scalar>;
  using States = typename Simulator::States;
  using Lengths = typename Simulator::Vector;
  py::class_<Simulator>(m, name, summary)
      .def(py::init([](const Net<double>& net) {
             if (!dynamics::valid(net)) {
               throw py::value_error(
                   "net: a number that is not finite or has the wrong sign, or a member that joins "
                   "no two nodes");
             }
             return Simulator(cast<Scalar>(net));
           }),
           py::arg("net"))
      .def(
          "step",
          [](Simulator& simulator, Eigen::Ref<States> states, const Lengths& rest_lengths,
             Scalar dt, int steps, Integrator integrator) {
            return simulator.step(states, rest_lengths, dt, steps, integrator);
          },
          py::arg("states").noconvert(), py::arg("rest_lengths"), py::arg("dt"), py::arg("steps"),
          py::arg_v("integrator", Integrator::kRungeKutta4, "Integrator.RUNGE_KUTTA_4"),
          py::call_guard<py::gil_scoped_release>(),
          "Moves the states (simulations, 6n), in Fortran order, by steps of dt [s] in place. "
          "Friction remembers for this call alone.")
      .def(
          "step",
          [](Simulator& simulator, Eigen::Ref<States> states, Eigen::Ref<States> anchors,
             const Lengths& rest_lengths, Scalar dt, int steps, Integrator integrator) {
            return simulator.step(states, anchors, rest_lengths, dt, steps, integrator);
          },
          py::arg("states").noconvert(), py::arg("anchors").noconvert(), py::arg("rest_lengths"),
          py::arg("dt"), py::arg("steps"),
          py::arg_v("integrator", Integrator::kRungeKutta4, "Integrator.RUNGE_KUTTA_4"),
          py::call_guard<py::gil_scoped_release>(),
          "The same with the points where nodes stand (simulations, 2n), in Fortran order, moved "
          "along.")
      .def_property_readonly("failures", &Simulator::failures,
                             "Simulations that the last step left as they were.");
}

}  // namespace

void bind_dynamics(py::module_& m) {
  py::native_enum<Integrator>(m, "Integrator", "enum.Enum", "Of the equations of motion.")
      .value("RUNGE_KUTTA_4", Integrator::kRungeKutta4)
      .value("SEMI_IMPLICIT_EULER", Integrator::kSemiImplicitEuler)
      .finalize();

  py::class_<Ground<double>>(m, "NetGround", "The plane z = 0 that a net rests on.")
      .def(py::init<>())
      .def_readwrite("stiffness", &Ground<double>::stiffness, "[N/m]; 0 with damping 0: no ground")
      .def_readwrite("damping", &Ground<double>::damping, "[N s/m^2]")
      .def_readwrite("friction_stiffness", &Ground<double>::friction_stiffness, "[N/m]")
      .def_readwrite("friction_damping", &Ground<double>::friction_damping, "[N s/m]")
      .def_readwrite("friction_static", &Ground<double>::friction_static)
      .def_readwrite("friction_kinetic", &Ground<double>::friction_kinetic);

  py::class_<Net<double>>(m, "Net", "Point masses joined by rods and cables.")
      .def(py::init([](int nodes, double node_mass, const Ground<double>& ground,
                       const Vector3<double>& gravity) {
             Net<double> net;
             net.nodes = nodes;
             net.node_mass = node_mass;
             net.ground = ground;
             net.gravity = gravity;
             return net;
           }),
           py::arg("nodes"), py::arg("node_mass"), py::arg("ground"), py::arg("gravity"))
      .def(
          "set_rods",
          [](Net<double>& net, const Eigen::Matrix<int, Eigen::Dynamic, 2>& ends,
             const Eigen::VectorXd& stiffness, const Eigen::VectorXd& damping,
             const Eigen::VectorXd& rest_length) {
            net.rods = members(ends, stiffness, damping, rest_length);
          },
          py::arg("ends"), py::arg("stiffness"), py::arg("damping"), py::arg("rest_length"),
          "ends (rods, 2): indices of nodes; stiffness [N/m], damping [N s/m], rest_length [m]")
      .def(
          "set_cables",
          [](Net<double>& net, const Eigen::Matrix<int, Eigen::Dynamic, 2>& ends,
             const Eigen::VectorXd& stiffness, const Eigen::VectorXd& damping,
             const Eigen::VectorXd& rest_length) {
            net.cables = members(ends, stiffness, damping, rest_length);
          },
          py::arg("ends"), py::arg("stiffness"), py::arg("damping"), py::arg("rest_length"),
          "ends (cables, 2), as set_rods");

  bind_simulator<double>(m, "NetSimulator", "Many simulations of one net at once.");
  bind_simulator<float>(m, "NetSimulatorFloat",
                        "NetSimulator in single precision: twice as many per SIMD register.");
}

}  // namespace tensegrity::bindings
