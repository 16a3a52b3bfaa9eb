// The generic unscented filter with processes and measurements in Python.
#include "bindings.hpp"
#include "tensegrity/ukf/unscented_filter.hpp"

namespace tensegrity::bindings {

namespace {

using Filter = ukf::UnscentedFilter<double>;
using Settings = ukf::UnscentedSettings<double>;
using Matrix = ukf::MatrixX<double>;
using VectorD = ukf::VectorX<double>;

Matrix call(const py::function& function, const ukf::ConstMatrixRef<double>& points,
            Eigen::Index columns, const char* what) {
  const Matrix result = function(Matrix(points)).cast<Matrix>();
  if (result.rows() != points.rows() || result.cols() != columns) {
    throw py::value_error(std::string(what) + ": expected an array of shape (" +
                          std::to_string(points.rows()) + ", " + std::to_string(columns) + ")");
  }
  return result;
}

Status predict(Filter& filter, const py::function& process, const Matrix& noise) {
  if (noise.rows() != filter.dimension() || noise.cols() != filter.dimension()) {
    throw py::value_error("noise: expected a square matrix of the filter's dimension");
  }
  const auto in_place = [&](ukf::MatrixRef<double> points) {
    points = call(process, points, filter.dimension(), "process");
    return true;
  };
  return filter.predict(in_place, noise);
}

Status correct(Filter& filter, const py::function& measure, const VectorD& z,
               const VectorD& variances, double gate) {
  if (variances.size() != z.size()) {
    throw py::value_error("variances: expected as many as z has rows");
  }
  if (z.size() > filter.capacity()) {
    throw py::value_error("z: more rows than the filter's capacity");
  }
  const auto in_place = [&](const ukf::ConstMatrixRef<double>& points,
                            ukf::MatrixRef<double> predicted) {
    predicted = call(measure, points, predicted.cols(), "measure");
  };
  return filter.correct(in_place, z, variances, gate);
}

std::vector<bool> accepted(const Filter& filter) {
  std::vector<bool> result;
  for (int r = 0; r < filter.rows(); ++r) result.push_back(filter.accepted(r));
  return result;
}

}  // namespace

void bind_ukf(py::module_& m) {
  py::native_enum<ukf::Weights>(m, "SigmaWeights", "enum.Enum", "How sigma points count.")
      .value("SCALED", ukf::Weights::kScaled)
      .value("UNIFORM", ukf::Weights::kUniform)
      .finalize();
  py::native_enum<ukf::Form>(m, "FilterForm", "enum.Enum", "What an unscented filter keeps.")
      .value("COVARIANCE", ukf::Form::kCovariance)
      .value("SQUARE_ROOT", ukf::Form::kSquareRoot)
      .finalize();

  py::class_<Settings>(m, "UnscentedSettings", "Sigma points and form of an unscented filter.")
      .def(py::init<>())
      .def_readwrite("alpha", &Settings::alpha, "spread of the points")
      .def_readwrite("beta", &Settings::beta, "2 for Gaussian states")
      .def_readwrite("kappa", &Settings::kappa)
      .def_readwrite("weights", &Settings::weights)
      .def_readwrite("form", &Settings::form)
      .def_readwrite("redraw", &Settings::redraw,
                     "draw new points from the predicted covariance before a correction");

  py::class_<Filter>(m, "UnscentedFilter",
                     "Unscented Kalman filter with additive noise, measurements that come and go.")
      .def(py::init<int, int, const Settings&>(), py::arg("dimension"), py::arg("capacity"),
           py::arg_v("settings", Settings{}, "UnscentedSettings()"))
      .def(
          "set",
          [](Filter& filter, const VectorD& mean, const Matrix& covariance) {
            return filter.set(mean, covariance);
          },
          py::arg("mean"), py::arg("covariance"), "Starts from a mean (L,) and covariance (L, L).")
      .def("predict", &predict, py::arg("process"), py::arg("noise"),
           "`process` maps sigma points (2L+1, L) to new ones; `noise` (L, L) is added.")
      .def(
          "correct", &correct, py::arg("measure"), py::arg("z"), py::arg("variances"),
          py::arg_v("gate", std::numeric_limits<double>::infinity(), "float('inf')"),
          "`measure` maps sigma points (2L+1, L) to measurements (2L+1, rows); z and variances are "
          "(rows,); rows with a squared innovation above `gate` variances are left out.")
      .def_property_readonly("mean", [](const Filter& filter) { return VectorD(filter.mean()); })
      .def_property_readonly("covariance", [](const Filter& filter) { return filter.covariance(); })
      .def_property_readonly("accepted", &accepted, "Of the rows of the last correction.")
      .def_property_readonly("squared_distance", &Filter::squared_distance,
                             "Chi-square of the rows used last.")
      .def_property_readonly("dimension", &Filter::dimension)
      .def_property_readonly("capacity", &Filter::capacity);
}

}  // namespace tensegrity::bindings
