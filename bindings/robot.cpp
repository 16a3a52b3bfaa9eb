#include "tensegrity/robot/prism.hpp"

#include "bindings.hpp"

namespace tensegrity::bindings {

void bind_robot(py::module_& m) {
  py::native_enum<Status>(m, "Status", "enum.Enum", "What a call did with its input.")
      .value("OK", Status::kOk)
      .value("NOT_INITIALIZED", Status::kNotInitialized)
      .value("NOT_FINITE", Status::kNotFinite)
      .value("OUT_OF_RANGE", Status::kOutOfRange)
      .value("DUPLICATE", Status::kDuplicate)
      .value("OUT_OF_ORDER", Status::kOutOfOrder)
      .value("TOO_LATE", Status::kTooLate)
      .value("GAP", Status::kGap)
      .value("REJECTED", Status::kRejected)
      .value("NOT_CONVERGED", Status::kNotConverged)
      .value("WRONG_CHIRALITY", Status::kWrongChirality)
      .finalize();

  py::native_enum<Chirality>(m, "Chirality", "enum.Enum", "The sense in which the rods twist.")
      .value("COUNTER_CLOCKWISE", Chirality::kCounterClockwise)
      .value("CLOCKWISE", Chirality::kClockwise)
      .finalize();

  py::class_<Prism<double>>(m, "Prism", "Geometry of a 3-bar prism [m].")
      .def(py::init([](double rod_length, double imu_offset, double endcap_radius,
                       double side_length, Chirality chirality) {
             return Prism<double>{rod_length, imu_offset, endcap_radius, side_length, chirality};
           }),
           py::kw_only(), py::arg("rod_length") = 1.45, py::arg("imu_offset") = 0.02,
           py::arg("endcap_radius") = 0.038, py::arg("side_length") = 0.98,
           py::arg_v("chirality", Chirality::kCounterClockwise, "Chirality.COUNTER_CLOCKWISE"))
      .def_readonly("rod_length", &Prism<double>::rod_length)
      .def_readonly("imu_offset", &Prism<double>::imu_offset)
      .def_readonly("endcap_radius", &Prism<double>::endcap_radius)
      .def_readonly("side_length", &Prism<double>::side_length)
      .def_readonly("chirality", &Prism<double>::chirality)
      .def(
          "undeformed",
          [](const Prism<double>& robot) -> Eigen::Matrix<double, 6, 3> {
            return robot.undeformed().transpose();
          },
          "Endcaps (6, 3) of the undeformed robot in the body frame [m].");

  py::list cables;
  for (const Cable& cable : kPrismCables) cables.append(py::make_tuple(cable.from, cable.to));
  m.attr("PRISM_CABLES") = py::tuple(cables);
}

}  // namespace tensegrity::bindings
