// What the files of this folder share: one function each, called by module.cpp.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/native_enum.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

namespace tensegrity::bindings {

namespace py = pybind11;

void bind_robot(py::module_& m);
void bind_shape(py::module_& m);
void bind_inekf(py::module_& m);
void bind_contact(py::module_& m);
void bind_estimator(py::module_& m);
void bind_dynamics(py::module_& m);
void bind_ranging_calibration(py::module_& m);
void bind_ahrs(py::module_& m);
void bind_ranging(py::module_& m);
void bind_ukf(py::module_& m);

}  // namespace tensegrity::bindings
