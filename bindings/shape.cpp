// Shape reconstruction: the real-time solver, the tracker, the Ipopt reference, and what the
// constraints of T eq. (15) say about a shape. Endcaps are (6, 3) NumPy arrays in the body frame
// [m].
#include <cmath>
#include <limits>
#include <string>

#include "bindings.hpp"
#include "tensegrity/shape/cables.hpp"
#include "tensegrity/shape/constraints.hpp"
#include "tensegrity/shape/fold.hpp"
#include "tensegrity/shape/gauge.hpp"
#include "tensegrity/shape/solver.hpp"
#include "tensegrity/shape/tracker.hpp"
#ifdef TENSEGRITY_WITH_IPOPT
#include "tensegrity/shape/ipopt_solver.hpp"
#endif

namespace tensegrity::bindings {

namespace {

using EndcapRows = Eigen::Matrix<double, 6, 3>;
using Lengths = CableLengths<double>;
using Covariance = Matrix<double, 18>;
using Robot = Prism<double>;

// What a class with `endcaps()` returns, as rows.
template <typename Source>
EndcapRows endcap_rows(const Source& source) {
  return source.endcaps().transpose();
}

shape::Rods<double> rods_of(const Robot& robot, const EndcapRows& endcaps) {
  if (!endcaps.allFinite() || endcaps.row(2) == endcaps.row(3) ||
      endcaps.row(4) == endcaps.row(5)) {
    throw py::value_error("endcaps: expected finite positions with two distinct ends per rod");
  }
  return {robot, endcaps.transpose()};
}

Covariance covariance_of(const shape::Solver<double>& solver, double cable_std, double prior_std) {
  Covariance out;
  const Status status = std::isinf(prior_std) && prior_std > 0
                            ? solver.covariance(cable_std, out)
                            : solver.covariance(cable_std, prior_std, out);
  if (!used(status)) {
    throw py::value_error(std::string("covariance: ") + to_string(status) +
                          " (solve first; standard deviations are positive lengths in metres)");
  }
  return out;
}

Eigen::VectorXd inequality_values(const Robot& robot, const EndcapRows& endcaps,
                                  shape::ConstraintSet set) {
  const shape::InequalitySet<double> inequalities(set, robot.moment_sign());
  Eigen::VectorXd values(inequalities.size());
  for (int i = 0; i < inequalities.size(); ++i)
    values[i] = inequalities[i].value(endcaps.transpose());
  return values;
}

void bind_functions(py::module_& m) {
  m.def(
      "cable_lengths",
      [](const EndcapRows& endcaps) { return shape::cable_lengths<double>(endcaps.transpose()); },
      py::arg("endcaps"), "Distances (9,) of endcaps (6, 3) in the order of PRISM_CABLES [m].");
  m.def(
      "length_jacobian",
      [](const Robot& robot, const EndcapRows& endcaps) {
        return shape::length_jacobian(rods_of(robot, endcaps));
      },
      py::arg("robot"), py::arg("endcaps"),
      "dl/dtangent (9, 10) at endcaps (6, 3) in the body frame; the tangent is (dc23, L/2 du23, "
      "dc45, L/2 du45), all in metres.");
  m.def(
      "endcap_jacobian",
      [](const Robot& robot, const EndcapRows& endcaps) {
        return rods_of(robot, endcaps).endcap_jacobian();
      },
      py::arg("robot"), py::arg("endcaps"),
      "dq/dtangent (18, 10) of the stacked endcaps, same tangent as `length_jacobian`.");
  m.def(
      "fold",
      [](const Robot& robot, const EndcapRows& endcaps) {
        return shape::fold(rods_of(robot, endcaps), robot.moment_sign());
      },
      py::arg("robot"), py::arg("endcaps"),
      "Side and distance of the fold of the shape equations: positive on the branch a standing "
      "robot takes, zero where two branches meet. Dimensionless.");
  m.def(
      "spin_angle",
      [](const EndcapRows& endcaps, const EndcapRows& reference) {
        return shape::spin_angle<double>(endcaps.transpose(), reference.transpose());
      },
      py::arg("endcaps"), py::arg("reference"),
      "Angle about body z by which `reference` has to be turned to fit `endcaps` best over "
      "endcaps 2 to 5 [rad].");
  m.def(
      "in_body_frame",
      [](const Robot& robot, const EndcapRows& endcaps) -> EndcapRows {
        return shape::in_procrustes_gauge<double>(robot.in_body_frame(endcaps.transpose()),
                                                  robot.undeformed())
            .transpose();
      },
      py::arg("robot"), py::arg("endcaps"),
      "Endcaps (6, 3) given in any frame, moved rigidly to the body frame and turned about z to "
      "fit the undeformed robot best [m].");
  m.def(
      "mutual_moments",
      [](const EndcapRows& endcaps) { return shape::mutual_moments<double>(endcaps.transpose()); },
      py::arg("endcaps"),
      "m_ij = (c_j - c_i) . (u_i x u_j) (3,) of the rod pairs (01, 23), (23, 45), (45, 01) [m]: "
      "all negative for a counter-clockwise robot, zero where two rod axes cross.");
  m.def("inequality_values", &inequality_values, py::arg("robot"), py::arg("endcaps"),
        py::arg("constraints"),
        "Left-hand sides of the inequalities of T eq. (15) [m, m^2 or m^3], all positive for a "
        "shape that satisfies them. Printed and corrected set: 15d (2), 15e (2), 15g to 15l; "
        "mutual moments: three.");
}

void bind_solver(py::module_& m) {
  using Solver = shape::Solver<double>;
  py::class_<Solver>(m, "ShapeSolver",
                     "Cable lengths -> endcaps by nonlinear least squares (T eq. 15a), in real "
                     "time. Warm from the last solution; cold after `reset`.")
      .def(py::init([](const Robot& robot, int max_iterations, int max_cold_iterations,
                       double tolerance) {
             return Solver(robot, {max_iterations, max_cold_iterations, tolerance});
           }),
           py::arg("robot"), py::kw_only(),
           py::arg("max_iterations") = shape::SolverOptions<double>{}.max_iterations,
           py::arg("max_cold_iterations") = shape::SolverOptions<double>{}.max_cold_iterations,
           py::arg("tolerance") = shape::SolverOptions<double>{}.tolerance)
      .def("solve", &Solver::solve, py::arg("lengths"),
           "Solves for lengths (9,) [m]; unless OK or NOT_CONVERGED the shape is unchanged.")
      .def("reset", &Solver::reset, "Forgets the last solution.")
      .def("covariance", &covariance_of, py::arg("cable_std"), py::kw_only(),
           py::arg("prior_std") = std::numeric_limits<double>::infinity(),
           "Covariance (18, 18) of the stacked endcaps for cable errors of `cable_std` [m], "
           "optionally with a prior of `prior_std` [m] in every tangent direction [m^2].")
      .def_property_readonly("endcaps", &endcap_rows<Solver>,
                             "(6, 3) in the body frame, spin fitted to the undeformed robot [m].")
      .def_property_readonly("cost", &Solver::cost, "Sum of squared length residuals [m^2].")
      .def_property_readonly("iterations", &Solver::iterations, "Of the last call.");
}

void bind_tracker(py::module_& m) {
  using Tracker = shape::Tracker<double>;
  using Options = shape::TrackerOptions<double>;
  py::class_<Tracker>(m, "ShapeTracker",
                      "The shape over time: an extended Kalman filter on the two free rods that "
                      "stays on the branch of the shape equations a loaded robot takes.")
      .def(py::init([](const Robot& robot, double gate, int max_dropped, int max_rejections,
                       double fold_threshold, double fold_std) {
             return Tracker(robot,
                            Options{gate, max_dropped, max_rejections, fold_threshold, fold_std});
           }),
           py::arg("robot"), py::kw_only(), py::arg("gate") = Options{}.gate,
           py::arg("max_dropped") = Options{}.max_dropped,
           py::arg("max_rejections") = Options{}.max_rejections,
           py::arg("fold_threshold") = Options{}.fold_threshold,
           py::arg("fold_std") = Options{}.fold_std)
      .def("reset", &Tracker::reset, py::arg("lengths"), py::arg("cable_std") = 0.002,
           "Starts from lengths (9,) alone [m]; on failure nothing changes.")
      .def("predict", &Tracker::predict, py::arg("displacement_std"),
           "Lets the shape drift for one step [m].")
      .def(
          "correct",
          [](Tracker& tracker, const Lengths& lengths, double cable_std,
             const std::array<bool, 9>& valid) {
            return tracker.correct(lengths, cable_std, valid);
          },
          py::arg("lengths"), py::arg("cable_std"),
          py::arg("valid") =
              std::array<bool, 9>{true, true, true, true, true, true, true, true, true},
          "Uses those of the lengths (9,) [m] that are valid, finite and credible.")
      .def_property_readonly("endcaps", &endcap_rows<Tracker>,
                             "(6, 3) in the body frame, spin fitted to the undeformed robot [m].")
      .def_property_readonly("covariance", &Tracker::covariance,
                             "(18, 18) of the stacked endcaps [m^2].")
      .def_property_readonly("initialized", &Tracker::initialized)
      .def_property_readonly("fold", &Tracker::fold, "See the function `fold`.");
}

#ifdef TENSEGRITY_WITH_IPOPT
void bind_ipopt(py::module_& m) {
  using Solver = shape::IpoptSolver;
  using Options = shape::IpoptOptions;
  py::class_<Solver>(m, "IpoptShapeSolver",
                     "Cable lengths -> endcaps by T eq. (15) with Ipopt: the reference for "
                     "ShapeSolver, about a thousand times slower.")
      .def(py::init([](const Robot& robot, shape::ConstraintSet constraints, double tolerance,
                       int max_iterations) {
             return Solver(robot, Options{constraints, tolerance, max_iterations});
           }),
           py::arg("robot"), py::kw_only(),
           py::arg_v("constraints", shape::ConstraintSet::kMutualMoment,
                     "ConstraintSet.MUTUAL_MOMENT"),
           py::arg("tolerance") = Options{}.tolerance,
           py::arg("max_iterations") = Options{}.max_iterations)
      .def("solve", &Solver::solve, py::arg("lengths"),
           "Solves for lengths (9,) [m]; unless OK the shape is unchanged.")
      .def("reset", &Solver::reset, "Forgets the last solution.")
      .def_property_readonly("endcaps", &endcap_rows<Solver>,
                             "(6, 3) in the body frame, spin fitted to the undeformed robot [m].")
      .def_property_readonly("cost", &Solver::cost, "Sum of squared length residuals [m^2].")
      .def_property_readonly("iterations", &Solver::iterations, "Of the last call, all starts.");
}
#endif

}  // namespace

void bind_shape(py::module_& m) {
  py::native_enum<shape::ConstraintSet>(m, "ConstraintSet", "enum.Enum",
                                        "Which inequalities of T eq. (15) a shape has to satisfy.")
      .value("AS_PRINTED", shape::ConstraintSet::kAsPrinted)
      .value("CORRECTED", shape::ConstraintSet::kCorrected)
      .value("MUTUAL_MOMENT", shape::ConstraintSet::kMutualMoment)
      .finalize();
  bind_functions(m);
  bind_solver(m);
  bind_tracker(m);
#ifdef TENSEGRITY_WITH_IPOPT
  bind_ipopt(m);
#endif
}

}  // namespace tensegrity::bindings
