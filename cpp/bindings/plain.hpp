// Arguments as users give them, taken without a detour through NumPy where they are plain: Python's
// numbers, lists and tuples of them, arrays of float32, float64 or int64 of the very shape (of
// several axes: C-contiguous), all within the range of the filter's precision.
//
// What is not plain (another type, another shape, a number that is not finite) is left to the
// Python layer, which converts it, or says what is wrong with it.
#pragma once

#include <cmath>
#include <cstring>
#include <limits>

#include "binders.hpp"

namespace auvest {
namespace bindings {
namespace plain {

/// True for numpy.ndarray itself: a masked array is one, too, and means something else.
inline bool is_array(py::handle value) {
  return reinterpret_cast<PyObject*>(Py_TYPE(value.ptr())) ==
         reinterpret_cast<PyObject*>(py::detail::npy_api::get().PyArray_Type_);
}

/// A number of any value.
inline bool take_any(py::handle value, double& number) {
  if (PyFloat_Check(value.ptr())) {
    number = PyFloat_AS_DOUBLE(value.ptr());
    return true;
  }
  if (!PyLong_CheckExact(value.ptr())) return false;  // bool is no number
  number = PyLong_AsDouble(value.ptr());
  if (!(number == -1.0 && PyErr_Occurred() != nullptr)) return true;
  PyErr_Clear();
  return false;
}

template <class Element>
bool take_elements(py::handle value, py::ssize_t count, double* numbers) {
  if (!py::isinstance<py::array_t<Element, 0>>(value)) return false;
  const auto array = py::reinterpret_borrow<py::array>(value);
  if (array.size() != count) return false;
  if (array.ndim() != 1 && !py::isinstance<Array<Element>>(value)) return false;
  const py::ssize_t step = array.ndim() == 1 ? array.strides(0) : py::ssize_t(sizeof(Element));
  const char* from = static_cast<const char*>(array.data());
  for (py::ssize_t i = 0; i < count; ++i) {
    Element element;  // need not be aligned there
    std::memcpy(&element, from + i * step, sizeof(Element));
    numbers[i] = static_cast<double>(element);
  }
  return true;
}

/// `count` numbers of any value: an array of one axis, a list or a tuple.
inline bool take_any(py::handle value, py::ssize_t count, double* numbers) {
  if (is_array(value)) {
    return py::reinterpret_borrow<py::array>(value).ndim() == 1 &&
           (take_elements<double>(value, count, numbers) ||
            take_elements<float>(value, count, numbers));
  }
  const bool list = PyList_CheckExact(value.ptr()) != 0;
  if ((!list && PyTuple_CheckExact(value.ptr()) == 0) || Py_SIZE(value.ptr()) != count) {
    return false;
  }
  for (py::ssize_t i = 0; i < count; ++i) {
    PyObject* item = list ? PyList_GET_ITEM(value.ptr(), i) : PyTuple_GET_ITEM(value.ptr(), i);
    if (!take_any(py::handle(item), numbers[i])) return false;
  }
  return true;
}

/// Rounds to the filter's precision, if that can hold the number.
template <class Scalar>
bool narrow(double number, Scalar& result) {
  if (!(std::fabs(number) <= static_cast<double>(std::numeric_limits<Scalar>::max()))) return false;
  result = static_cast<Scalar>(number);
  return true;
}

/// A finite number.
template <class Scalar>
bool take(py::handle value, Scalar& result) {
  double number;
  return take_any(value, number) && narrow(number, result);
}

/// A vector of finite numbers.
template <class Scalar, int N>
bool take(py::handle value, Vector<Scalar, N>& result) {
  double numbers[N];
  bool fits = take_any(value, N, numbers);
  for (int i = 0; i < N && fits; ++i) fits = narrow(numbers[i], result(i));
  return fits;
}

}  // namespace plain
}  // namespace bindings
}  // namespace auvest
