// Small arrays of fixed size as arguments of calls whose own cost counts.
//
// pybind11 takes a NumPy array to an Eigen matrix through a new array object and a table of
// strides, which takes longer than a step of some filters. An array that has the type and shape
// already is read where it is; everything else goes pybind11's way, with its conversions and its
// errors.
#pragma once

#include "bindings.hpp"

namespace tensegrity::bindings {

// Rows x Cols numbers, valid during the call; `*numbers` is the matrix.
template <int Rows, int Cols = 1>
class Numbers {
 public:
  // The layout of a NumPy array: rows one after the other.
  static constexpr int kOrder = Cols == 1 ? Eigen::ColMajor : Eigen::RowMajor;
  using Matrix = Eigen::Matrix<double, Rows, Cols, kOrder>;

  explicit Numbers(const double* data) : data_(data) {}
  Eigen::Map<const Matrix> operator*() const { return Eigen::Map<const Matrix>(data_); }

 private:
  const double* data_;
};

}  // namespace tensegrity::bindings

namespace pybind11::detail {

template <int Rows, int Cols>
class type_caster<tensegrity::bindings::Numbers<Rows, Cols>> {
  using Numbers = tensegrity::bindings::Numbers<Rows, Cols>;
  using Matrix = typename Numbers::Matrix;
  using General = make_caster<Matrix>;

 public:
  static constexpr auto name = General::name;
  template <typename>
  using cast_op_type = Numbers;

  bool load(handle source, bool convert) {
    if (take(source)) return true;
    if (!general_.load(source, convert)) return false;
    data_ = static_cast<Matrix&>(general_).data();
    return true;
  }
  operator Numbers() const { return Numbers(data_); }

 private:
  bool take(handle source) {
    // NumPy has one object for each of its own types; a type that only equals it goes the other
    // way. It lives as long as NumPy.
    static const PyObject* const float64 = dtype::of<double>().release().ptr();
    if (!npy_api::get().PyArray_Check_(source.ptr())) return false;
    const PyArray_Proxy* a = array_proxy(source.ptr());
    const bool shaped = Cols == 1
                            ? a->nd == 1 && a->dimensions[0] == Rows
                            : a->nd == 2 && a->dimensions[0] == Rows && a->dimensions[1] == Cols;
    if (!shaped || a->descr != float64 || (a->flags & npy_api::NPY_ARRAY_ALIGNED_) == 0) {
      return false;
    }
    if ((a->flags & npy_api::NPY_ARRAY_C_CONTIGUOUS_) != 0) {
      data_ = reinterpret_cast<const double*>(a->data);
      return true;
    }
    if (Cols != 1) return false;
    // A row of a recording that was read column by column.
    Matrix& copy = static_cast<Matrix&>(general_);
    for (int k = 0; k < Rows; ++k) {
      copy(k) = *reinterpret_cast<const double*>(a->data + k * a->strides[0]);
    }
    data_ = copy.data();
    return true;
  }

  const double* data_ = nullptr;
  General general_;
};

}  // namespace pybind11::detail
