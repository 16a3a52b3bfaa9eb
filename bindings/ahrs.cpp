// The gradient-descent AHRS: sample by sample, and over recordings at C++ speed.
#include "tensegrity/ahrs/madgwick.hpp"

#include "bindings.hpp"

namespace tensegrity::bindings {

namespace {

using Filter = ahrs::Madgwick<double>;
using Settings = ahrs::MadgwickSettings<double>;
using V3 = Vector3<double>;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

void check_shape(const Doubles& a, const char* name, py::ssize_t rows, py::ssize_t columns) {
  const bool good = columns == 0 ? a.ndim() == 1 && a.shape(0) == rows
                                 : a.ndim() == 2 && a.shape(0) == rows && a.shape(1) == columns;
  if (!good) {
    throw py::value_error(std::string(name) + ": expected shape (" + std::to_string(rows) +
                          (columns == 0 ? ",)" : ", " + std::to_string(columns) + ")"));
  }
}

// Orientations (N, 4) as w, x, y, z, and statuses (N,) as numbers of Status.
std::pair<Doubles, py::array_t<std::uint8_t>> run(Filter& filter, const Doubles& gyro,
                                                  const Doubles& accel, const Doubles& dt) {
  const py::ssize_t samples = gyro.ndim() == 2 ? gyro.shape(0) : 0;
  check_shape(gyro, "gyro", samples, 3);
  check_shape(accel, "accel", samples, 3);
  check_shape(dt, "dt", samples, 0);
  Doubles orientations({samples, py::ssize_t(4)});
  py::array_t<std::uint8_t> statuses(samples);
  const double *rate = gyro.data(), *force = accel.data(), *interval = dt.data();
  double* to = orientations.mutable_data();
  std::uint8_t* status = statuses.mutable_data();
  for (py::ssize_t k = 0; k < samples; ++k, rate += 3, force += 3, to += 4) {
    status[k] = static_cast<std::uint8_t>(
        filter.update(Eigen::Map<const V3>(rate), Eigen::Map<const V3>(force), interval[k]));
    const Eigen::Quaterniond& q = filter.orientation();
    to[0] = q.w();
    to[1] = q.x();
    to[2] = q.y();
    to[3] = q.z();
  }
  return {orientations, statuses};
}

}  // namespace

void bind_ahrs(py::module_& m) {
  py::class_<Settings>(m, "MadgwickSettings", "Settings of the gradient-descent filter.")
      .def(py::init<>())
      .def_readwrite("gain", &Settings::gain, "step down the gradient [1/s]")
      .def_readwrite("largest_rate", &Settings::largest_rate, "of a measurement [rad/s]")
      .def_readwrite("largest_force", &Settings::largest_force, "of a measurement [m/s^2]")
      .def_readwrite("largest_interval", &Settings::largest_interval, "of one sample [s]");

  py::class_<Filter>(m, "Madgwick",
                     "Orientation of an IMU by gradient descent (Madgwick et al. 2011). "
                     "Quaternions are w, x, y, z, from the IMU's frame to the world, z up.")
      .def(py::init<const Settings&>(), py::arg_v("settings", Settings{}, "MadgwickSettings()"))
      .def("start", py::overload_cast<const V3&>(&Filter::start), py::arg("accel"),
           "Begins level with a specific force (3,) measured at rest [m/s^2].")
      .def(
          "start_at",
          [](Filter& filter, const Eigen::Vector4d& q) {
            return filter.start(Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
          },
          py::arg("orientation"), "Begins with a known orientation (4,).")
      .def("update", py::overload_cast<const V3&, const V3&, double>(&Filter::update),
           py::arg("gyro"), py::arg("accel"), py::arg("dt"),
           "One sample: rate (3,) [rad/s] and specific force (3,) [m/s^2] over dt [s].")
      .def("update", py::overload_cast<const V3&, const V3&, const V3&, double>(&Filter::update),
           py::arg("gyro"), py::arg("accel"), py::arg("field"), py::arg("dt"),
           "As above with the magnetic field (3,) in any unit.")
      .def("run", &run, py::arg("gyro"), py::arg("accel"), py::arg("dt"),
           "Updates with every row of gyro (N, 3), accel (N, 3) and dt (N,); returns the "
           "orientations after each (N, 4) and the statuses (N,) as numbers of Status.")
      .def_property_readonly("started", &Filter::started)
      .def_property_readonly("settings", &Filter::settings)
      .def_property_readonly(
          "orientation",
          [](const Filter& filter) {
            const Eigen::Quaterniond& q = filter.orientation();
            return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
          },
          "Quaternion (4,); identity before the start.")
      .def("inclination_cosine", &Filter::inclination_cosine,
           py::arg_v("axis", V3(V3::UnitZ()), "(0, 0, 1)"),
           "Cosine of the angle between the vertical (up) and an axis (3,) of the IMU's frame.");
}

}  // namespace tensegrity::bindings
