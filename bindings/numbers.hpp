// Small arrays of fixed size as arguments of calls whose own cost counts.
//
// pybind11 takes a NumPy array to an Eigen matrix through a new array object and a table of
// strides, about half a microsecond each. An array that already has the type, order and size is
// copied from its buffer here; everything else goes the general way.
#pragma once

#include <cstring>

#include "bindings.hpp"

namespace tensegrity::bindings {

// `values` has the layout of a NumPy array: rows one after the other.
template <int Rows, int Cols = 1>
struct Numbers {
  static constexpr int kOrder = Cols == 1 ? Eigen::ColMajor : Eigen::RowMajor;
  using Values = Eigen::Matrix<double, Rows, Cols, kOrder>;
  Values values;

  operator const Values&() const { return values; }
};

}  // namespace tensegrity::bindings

namespace pybind11::detail {

template <int Rows, int Cols>
struct type_caster<tensegrity::bindings::Numbers<Rows, Cols>> {
  using Numbers = tensegrity::bindings::Numbers<Rows, Cols>;
  using General = make_caster<typename Numbers::Values>;

  PYBIND11_TYPE_CASTER(Numbers, General::name);

  bool load(handle source, bool convert) {
    if (copy(source)) return true;
    General general;
    if (!general.load(source, convert)) return false;
    value.values = static_cast<typename Numbers::Values&>(general);
    return true;
  }

 private:
  bool copy(handle source) {
    if (!isinstance<array>(source)) return false;
    const auto given = reinterpret_borrow<array>(source);
    const bool shaped = Cols == 1
                            ? given.ndim() == 1 && given.shape(0) == Rows
                            : given.ndim() == 2 && given.shape(0) == Rows && given.shape(1) == Cols;
    if (!shaped || (given.flags() & array::c_style) == 0) return false;
    const dtype type = given.dtype();
    if (type.num() != dtype::num_of<double>() || type.byteorder() != '=') return false;
    std::memcpy(value.values.data(), given.data(), sizeof(double) * Rows * Cols);
    return true;
  }
};

}  // namespace pybind11::detail
