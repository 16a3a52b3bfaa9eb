// What the files of this folder share: one function each, called by module.cpp.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/native_enum.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <cstddef>

#include "tensegrity/types.hpp"

// A status is the result of every streaming call. py::native_enum makes it by a call into Python,
// which takes longer than all else of the binding; the members are looked up once and kept. Here,
// because every file of the module has to see the same caster.
namespace pybind11::detail {

template <>
struct type_caster_enum_type_enabled<tensegrity::Status> : std::false_type {};

template <>
class type_caster<tensegrity::Status> {
  using Status = tensegrity::Status;
  using General = type_caster_enum_type<Status>;

 public:
  static constexpr auto name = General::name;
  template <typename T>
  using cast_op_type = detail::cast_op_type<T>;

  bool load(handle source, bool convert) { return general_.load(source, convert); }
  operator Status*() { return general_; }
  operator Status&() { return general_; }

  static handle cast(Status status, return_value_policy policy, handle parent) {
    static std::array<PyObject*, std::size_t(Status::kWrongChirality) + 1> members{};
    PyObject*& member = members[std::size_t(status)];
    if (member == nullptr) member = General::cast(status, policy, parent).ptr();
    return handle(member).inc_ref();
  }

 private:
  General general_;
};

}  // namespace pybind11::detail

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
