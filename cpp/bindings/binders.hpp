// What the binding files share: their entry points, the precisions by name, and strict arguments.
//
// The module _core is strict: arrays must have the exact dtype and shape, parameters come as a dict
// with known keys. The friendly layer in python/auvest converts and explains.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>

#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

/// Params that name their own members.
template <class Params, class Visitor>
auto visit(Params& params, Visitor&& visitor) -> decltype(params.visit(visitor)) {
  params.visit(visitor);
}

namespace bindings {

namespace py = pybind11;

void bind_status(py::module_& m);
void bind_math(py::module_& m);
void bind_random(py::module_& m);
void bind_kernels(py::module_& m);
void bind_intervals(py::module_& m);
void bind_filters(py::module_& m);
void bind_function_models(py::module_& m);
void bind_cooperative(py::module_& m);
void bind_guidance(py::module_& m);
void bind_mission(py::module_& m);
void bind_pilot(py::module_& m);
void bind_vehicle(py::module_& m);
void bind_runs(py::module_& m);
void bind_tracking(py::module_& m);
void bind_slat(py::module_& m);
void bind_self_test(py::module_& m);

template <class Scalar>
struct Precision;
template <>
struct Precision<float> {
  static constexpr const char* kName = "float32";
};
template <>
struct Precision<double> {
  static constexpr const char* kName = "float64";
};

template <class Scalar>
std::string named(const std::string& stem) {
  return stem + "_" + Precision<Scalar>::kName;
}

/// A C-contiguous array of this very dtype; pybind11 refuses all others without converting.
template <class Scalar>
using Array = py::array_t<Scalar, py::array::c_style>;

template <class Scalar>
void require_shape(const Array<Scalar>& array, std::initializer_list<py::ssize_t> shape,
                   const char* name) {
  bool same = array.ndim() == static_cast<py::ssize_t>(shape.size());
  py::ssize_t axis = 0;
  for (const py::ssize_t extent : shape) {
    if (same && extent >= 0) same = array.shape(axis) == extent;
    ++axis;
  }
  if (!same) throw py::value_error(std::string(name) + " has the wrong shape");
}

template <int Rows, int Cols, class Scalar>
Matrix<Scalar, Rows, Cols> to_matrix(const Array<Scalar>& array, const char* name) {
  if (Cols == 1) {
    require_shape(array, {Rows}, name);
  } else {
    require_shape(array, {Rows, Cols}, name);
  }
  Matrix<Scalar, Rows, Cols> matrix;
  for (int i = 0; i < Rows; ++i) {
    for (int j = 0; j < Cols; ++j) matrix(i, j) = array.data()[i * Cols + j];
  }
  return matrix;
}

template <class Scalar, int Rows, int Cols>
void copy_to(const Matrix<Scalar, Rows, Cols>& matrix, Scalar* out) {
  for (int i = 0; i < Rows; ++i) {
    for (int j = 0; j < Cols; ++j) out[i * Cols + j] = matrix(i, j);
  }
}

template <class Scalar, int Rows, int Cols>
py::array_t<Scalar> to_array(const Matrix<Scalar, Rows, Cols>& matrix) {
  py::array_t<Scalar> array =
      Cols == 1 ? py::array_t<Scalar>(Rows) : py::array_t<Scalar>({Rows, Cols});
  copy_to(matrix, array.mutable_data());
  return array;
}

/// Thrown where the core reports anything but kOk; becomes auvest._core.StatusError in Python.
struct StatusError : std::runtime_error {
  Status status;
  explicit StatusError(Status s) : std::runtime_error(describe(s)), status(s) {}
};

inline void require_ok(Status status) {
  if (status != Status::kOk) throw StatusError(status);
}

/// Params struct <-> dict, through visit(params, visitor), which names each member.
template <class Params>
py::dict to_dict(const Params& params) {
  py::dict result;
  Params copy = params;
  visit(copy, [&result](const char* name, auto& value) { result[name] = value; });
  return result;
}

template <class Params>
Params from_dict(const py::dict& values, Params params = Params()) {
  py::size_t known = 0;
  visit(params, [&](const char* name, auto& value) {
    if (!values.contains(name)) return;
    value = values[name].template cast<typename std::decay<decltype(value)>::type>();
    ++known;
  });
  if (known != values.size()) throw py::key_error("unknown parameter in the dict");
  return params;
}

}  // namespace bindings
}  // namespace auvest
