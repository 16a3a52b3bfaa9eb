// The calibration of anchors and offsets: the problem as arrays, the solver.
#include "bindings.hpp"
#include "tensegrity/ranging/calibration.hpp"

namespace tensegrity::bindings {

namespace {

using Problem = ranging::CalibrationProblem<double>;
using Solver = ranging::CalibrationSolver<double>;
using Loss = ranging::RobustLoss<double>;
using ranging::CalibrationOptions;
using ranging::CalibrationStatus;
using ranging::LossKind;
using Integers = py::array_t<int, py::array::c_style | py::array::forcecast>;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

void require(bool good, const char* what) {
  if (!good) throw py::value_error(what);
}

template <typename T>
std::vector<T> vector_of(const py::array_t<T, py::array::c_style | py::array::forcecast>& array) {
  return {array.data(), array.data() + array.size()};
}

Problem make_problem(int anchors, int offset_terms, int rod_lengths, const Doubles& prior_mean,
                     const Doubles& prior_information, const Integers& strip_modules,
                     const Integers& strip_knots, const Integers& strip_rod,
                     const std::vector<Doubles>& motion_information, const Integers& indices,
                     const Doubles& blend, const Doubles& range_m, double range_std, double rod_std,
                     const std::array<double, 3>& knot_information) {
  Problem problem;
  problem.anchors = anchors;
  problem.offset_terms = offset_terms;
  problem.rod_lengths = rod_lengths;
  require(anchors >= 0 && offset_terms >= 0 && rod_lengths >= 0, "counts: expected at least 0");
  require(prior_mean.size() == problem.shared() && prior_information.size() == problem.shared(),
          "priors: expected one number per shared parameter");
  problem.prior_mean = vector_of(prior_mean);
  problem.prior_information = vector_of(prior_information);
  require(range_std > 0 && rod_std > 0, "standard deviations: expected more than 0 [m]");
  problem.range_std = range_std;
  problem.rod_std = rod_std;
  problem.knot_information = knot_information;

  const auto strips = static_cast<py::ssize_t>(motion_information.size());
  require(
      strip_modules.size() == strips && strip_knots.size() == strips && strip_rod.size() == strips,
      "strips: expected one number of each kind per strip");
  for (py::ssize_t i = 0; i < strips; ++i) {
    ranging::CalibrationStrip<double> strip;
    strip.modules = strip_modules.at(i);
    strip.knots = strip_knots.at(i);
    strip.rod_length = strip_rod.at(i);
    strip.motion_information = vector_of(motion_information[i]);
    require(strip.modules == 1 || strip.modules == 2, "strip_modules: expected 1 or 2");
    require(strip.knots > 0 && motion_information[i].size() == strip.knots - 1,
            "motion_information: expected one number between knots");
    require(-1 <= strip.rod_length && strip.rod_length < rod_lengths &&
                (strip.modules == 2 || strip.rod_length < 0),
            "strip_rod: no such rod length");
    problem.strips.push_back(std::move(strip));
  }

  const py::ssize_t count = range_m.size();
  require(indices.ndim() == 2 && indices.shape(0) == count && indices.shape(1) == 8 &&
              blend.size() == count,
          "indices: expected (N, 8) for N ranges: strip, module, knot, anchor, offset terms");
  problem.ranges.resize(count);
  for (py::ssize_t i = 0; i < count; ++i) {
    auto& range = problem.ranges[i];
    const int* index = indices.data(i, 0);
    range.strip = index[0];
    range.module = index[1];
    range.knot = index[2];
    range.anchor = index[3];
    range.blend = blend.at(i);
    range.range = range_m.at(i);
    std::copy_n(index + 4, 4, range.offset_terms.begin());
    bool good = 0 <= index[0] && index[0] < strips && 0 <= index[3] && index[3] < anchors &&
                0 <= range.blend && range.blend <= 1;
    for (int term : range.offset_terms) good = good && -1 <= term && term < offset_terms;
    require(good, "indices or blend: out of range");
    const auto& strip = problem.strips[index[0]];
    require(0 <= index[1] && index[1] < strip.modules && 0 <= index[2] && index[2] < strip.knots,
            "indices: module or knot out of range");
  }
  return problem;
}

py::array_t<double> positions(Solver& solver, std::size_t strip) {
  require(strip < solver.strips(), "no such strip");
  const auto& values = solver.positions(strip);
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

void set_positions(Solver& solver, std::size_t strip, const Doubles& values) {
  require(strip < solver.strips(), "no such strip");
  auto& to = solver.positions(strip);
  require(values.size() == static_cast<py::ssize_t>(to.size()),
          "positions: expected (knots, modules, 3) numbers [m]");
  std::copy_n(values.data(), values.size(), to.begin());
}

}  // namespace

void bind_ranging_calibration(py::module_& m) {
  py::native_enum<LossKind>(m, "RangeLoss", "enum.Enum", "Loss of a range's whitened residual.")
      .value("squares", LossKind::kSquares)
      .value("huber", LossKind::kHuber)
      .value("cauchy", LossKind::kCauchy)
      .finalize();
  py::native_enum<CalibrationStatus>(m, "CalibrationStatus", "enum.Enum", "How a solution ended.")
      .value("converged", CalibrationStatus::kConverged)
      .value("iteration_limit", CalibrationStatus::kIterationLimit)
      .value("stuck", CalibrationStatus::kStuck)
      .finalize();

  py::class_<Solver>(m, "RangeCalibrationSolver",
                     "Levenberg-Marquardt over shared parameters [anchors 3A | offset terms | rod "
                     "lengths] and the knots of the trajectories, strip by strip.")
      .def(py::init([](int anchors, int offset_terms, int rod_lengths, const Doubles& prior_mean,
                       const Doubles& prior_information, const Integers& strip_modules,
                       const Integers& strip_knots, const Integers& strip_rod,
                       const std::vector<Doubles>& motion_information, const Integers& indices,
                       const Doubles& blend, const Doubles& range_m, double range_std,
                       double rod_std, const std::array<double, 3>& knot_information) {
             return Solver(make_problem(anchors, offset_terms, rod_lengths, prior_mean,
                                        prior_information, strip_modules, strip_knots, strip_rod,
                                        motion_information, indices, blend, range_m, range_std,
                                        rod_std, knot_information));
           }),
           py::kw_only(), py::arg("anchors"), py::arg("offset_terms"), py::arg("rod_lengths"),
           py::arg("prior_mean"), py::arg("prior_information"), py::arg("strip_modules"),
           py::arg("strip_knots"), py::arg("strip_rod"), py::arg("motion_information"),
           py::arg("indices"), py::arg("blend"), py::arg("range_m"), py::arg("range_std"),
           py::arg("rod_std"), py::arg("knot_information"))
      .def_property(
          "shared", [](const Solver& solver) { return Eigen::VectorXd(solver.shared()); },
          [](Solver& solver, const Eigen::VectorXd& shared) {
            require(shared.size() == solver.shared().size(), "shared: wrong length");
            solver.shared() = shared;
          },
          "Shared parameters [m].")
      .def("positions", &positions, py::arg("strip"),
           "Positions of a strip, flat: (knots, modules, 3) [m].")
      .def("set_positions", &set_positions, py::arg("strip"), py::arg("positions"))
      .def(
          "cost",
          [](const Solver& solver, LossKind loss, double scale) {
            return solver.cost(Loss{loss, scale});
          },
          py::arg("loss"), py::arg("scale"), "Half the sum of losses and squared priors.")
      .def(
          "solve",
          [](Solver& solver, LossKind loss, double scale, int max_iterations, double tolerance) {
            py::gil_scoped_release release;
            const auto report =
                solver.solve(Loss{loss, scale}, CalibrationOptions{max_iterations, tolerance});
            return std::make_tuple(report.status, report.iterations, report.cost);
          },
          py::arg("loss"), py::arg("scale"), py::arg("max_iterations"), py::arg("tolerance"),
          "Minimises from the current state; returns status, iterations and the cost.")
      .def(
          "reduced_information",
          [](Solver& solver, LossKind loss, double scale) {
            Eigen::MatrixXd information;
            if (!solver.reduced_information(Loss{loss, scale}, information)) {
              throw py::value_error("the trajectory is not determined");
            }
            return information;
          },
          py::arg("loss"), py::arg("scale"),
          "Information of the shared parameters, trajectory marginalised [1/m^2].")
      .def(
          "residuals",
          [](const Solver& solver) {
            std::vector<double> out(solver.ranges());
            solver.residuals(out);
            return py::array_t<double>(static_cast<py::ssize_t>(out.size()), out.data());
          },
          "Predicted minus measured ranges in standard deviations, (N,).")
      .def(
          "weights",
          [](const Solver& solver, LossKind loss, double scale) {
            std::vector<double> out(solver.ranges());
            solver.residuals(out);
            for (double& value : out) value = Loss{loss, scale}.weight(value * value);
            return py::array_t<double>(static_cast<py::ssize_t>(out.size()), out.data());
          },
          py::arg("loss"), py::arg("scale"), "Weights that the loss gives the ranges, (N,).");
}

}  // namespace tensegrity::bindings
