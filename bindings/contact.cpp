// The built-in contact detector: sample by sample, and over a recording for tuning and evaluation.
#include "bindings.hpp"
#include "tensegrity/contact/detector.hpp"

namespace tensegrity::bindings {

namespace {

using Detector = contact::Detector<double>;
using Parameters = contact::DetectorParameters<double>;
using EndcapRows = Eigen::Matrix<double, 6, 3>;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

Doubles probabilities(Detector& detector, const Doubles& endcaps, double dt) {
  if (endcaps.ndim() != 3 || endcaps.shape(1) != 6 || endcaps.shape(2) != 3) {
    throw py::value_error("endcaps: expected shape (N, 6, 3), centres in the world [m]");
  }
  const py::ssize_t samples = endcaps.shape(0);
  Doubles result({samples, py::ssize_t(6)});
  const double* from = endcaps.data();
  double* to = result.mutable_data();
  for (py::ssize_t k = 0; k < samples; ++k, from += 18, to += 6) {
    detector.update(Eigen::Map<const Endcaps<double>>(from), dt);
    std::copy(detector.probability().begin(), detector.probability().end(), to);
  }
  return result;
}

}  // namespace

void bind_contact(py::module_& m) {
  py::class_<Parameters>(m, "ContactDetectorParameters",
                         "Weights of the geometry and rates of the two-state Markov process; the "
                         "defaults are the fitted ones.")
      .def(py::init<>())
      .def_readwrite("intercept", &Parameters::intercept,
                     "log odds of the lowest, the second, and the third and higher endcaps, (3,)")
      .def_readwrite("height_weight", &Parameters::height_weight,
                     "log odds per height above the lowest endcap in rod lengths")
      .def_readwrite("share_weight", &Parameters::share_weight, "log odds per share of the weight")
      .def_readwrite("touch_down_rate", &Parameters::touch_down_rate, "[1/s]")
      .def_readwrite("lift_off_rate", &Parameters::lift_off_rate, "[1/s]")
      .def_readwrite("evidence_time", &Parameters::evidence_time,
                     "how long errors of the endcap positions persist [s]");

  py::class_<Detector>(m, "ContactDetector",
                       "Which endcaps carry load, from their positions alone. Endcaps are (6, 3) "
                       "centres in any frame with z up [m].")
      .def(py::init<const Prism<double>&, const Parameters&>(), py::arg("robot"),
           py::arg_v("parameters", Parameters{}, "ContactDetectorParameters()"))
      .def(
          "update",
          [](Detector& detector, const EndcapRows& endcaps, double dt) {
            return detector.update(endcaps.transpose(), dt);
          },
          py::arg("endcaps"), py::arg("dt"),
          "One sample, dt [s] after the last one; returns six flags. Input that is not finite, or "
          "a negative dt, keeps the last decision.")
      .def("probabilities", &probabilities, py::arg("endcaps"), py::arg("dt"),
           "Updates with every sample of endcaps (N, 6, 3), dt [s] apart; returns (N, 6).")
      .def_property_readonly("probability", &Detector::probability,
                             "Of being loaded, six numbers after the last update.")
      .def("reset", &Detector::reset, "Forgets everything before the next update.");
}

}  // namespace tensegrity::bindings
