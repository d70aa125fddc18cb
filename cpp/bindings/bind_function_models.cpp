// Models written in Python. What a function raises goes to `keep`, and NaN to the core, which
// refuses the step; the Python layer then raises what the function raised.
#include <pybind11/stl.h>

#include "desk/function_models.hpp"
#include "handles.hpp"

namespace auvest {
namespace bindings {
namespace {

using Process = desk::AnyProcess<double>;
using Sensor = desk::AnySensor<double>;
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// A Python object that threads without the GIL may copy and drop.
std::shared_ptr<py::object> shared(const py::object& object) {
  return {new py::object(object), [](py::object* held) {
            const py::gil_scoped_acquire acquire;
            delete held;
          }};
}

/// Copies the numbers that `function` gives to `out`; NaN where it fails, with the exception to
/// `keep`.
template <class Call>
void call(const py::object& keep, double* out, std::vector<py::ssize_t> shape, const char* name,
          Call function) {
  py::ssize_t size = 1;
  for (const py::ssize_t extent : shape) size *= extent;
  try {
    const Numbers given(function());
    std::vector<py::ssize_t> have(given.shape(), given.shape() + given.ndim());
    if (have.empty() && size == 1) have = shape;  // one number may stand for itself
    if (have != shape) {
      py::tuple is(have.size()), must(shape.size());
      for (std::size_t i = 0; i < have.size(); ++i) is[i] = have[i];
      for (std::size_t i = 0; i < shape.size(); ++i) must[i] = shape[i];
      throw py::value_error(std::string(name) + " gave an array of shape " +
                            py::str(is).cast<std::string>() + ", expected " +
                            py::str(must).cast<std::string>());
    }
    std::copy_n(given.data(), size, out);
    return;
  } catch (py::error_already_set& error) {
    keep(error.value());
  } catch (const py::value_error& error) {
    keep(py::module_::import("builtins").attr("ValueError")(error.what()));
  }
  std::fill_n(out, size, std::numeric_limits<double>::quiet_NaN());
}

py::array_t<double> vector(const double* values, py::ssize_t size) {
  return py::array_t<double>(size, values);
}

std::shared_ptr<Process> make_process(int states, int inputs, const py::object& f,
                                      const py::object& q, const py::object& jacobian,
                                      const std::vector<int>& angles,
                                      const py::object& keep_raised) {
  const py::ssize_t n = states;
  const auto keep = shared(keep_raised);
  const auto driven = [n, inputs, keep](const std::shared_ptr<py::object>& function,
                                        std::vector<py::ssize_t> shape, const char* name) {
    return [=](const double* x, double dt, const double* input, double* out) {
      const py::gil_scoped_acquire acquire;
      call(*keep, out, shape, name, [&]() -> py::object {
        if (inputs == 0) return (*function)(vector(x, n), dt);
        return (*function)(vector(x, n), dt, vector(input, inputs));
      });
    };
  };
  desk::ProcessFunctions functions;
  functions.inputs = inputs;
  functions.f = driven(shared(f), {n}, "f");
  if (!jacobian.is_none()) functions.Phi = driven(shared(jacobian), {n, n}, "jacobian");
  const auto noise = shared(q);
  functions.Q = [noise, n, keep](double dt, const double*, double* out) {
    const py::gil_scoped_acquire acquire;
    call(*keep, out, {n, n}, "Q", [&]() -> py::object { return (*noise)(dt); });
  };
  for (const int i : angles) functions.angle.at(static_cast<std::size_t>(i)) = true;
  return std::const_pointer_cast<Process>(desk::function_process(states, functions));
}

std::shared_ptr<Sensor> make_sensor(int states, int size, const py::object& h,
                                    const py::array_t<double, py::array::c_style>& r,
                                    const py::object& jacobian, const std::vector<int>& angles,
                                    const py::object& keep_raised) {
  const py::ssize_t n = states;
  const auto keep = shared(keep_raised);
  const auto at = [n, keep](const std::shared_ptr<py::object>& function,
                            std::vector<py::ssize_t> shape, const char* name) {
    return [=](const double* x, double* out) {
      const py::gil_scoped_acquire acquire;
      call(*keep, out, shape, name, [&]() -> py::object { return (*function)(vector(x, n)); });
    };
  };
  desk::SensorFunctions functions;
  functions.h = at(shared(h), {size}, "h");
  if (!jacobian.is_none()) functions.H = at(shared(jacobian), {size, n}, "jacobian");
  require_shape<double>(r, {size, size}, "R");
  std::copy_n(r.data(), r.size(), functions.R.begin());
  for (const int i : angles) functions.angle.at(static_cast<std::size_t>(i)) = true;
  return desk::function_sensor(states, size, functions);
}

}  // namespace

void bind_function_models(py::module_& m) {
  m.attr("MAX_FUNCTION_STATES") = desk::kMaxFunctionStates;
  m.attr("MAX_FUNCTION_SIZE") = desk::kMaxFunctionSize;
  m.def("make_function_process", &make_process, py::arg("states"), py::arg("inputs"), py::arg("f"),
        py::arg("Q"), py::arg("jacobian"), py::arg("angles"), py::arg("keep"));
  m.def("make_function_sensor", &make_sensor, py::arg("states"), py::arg("size"), py::arg("h"),
        py::arg("R").noconvert(), py::arg("jacobian"), py::arg("angles"), py::arg("keep"));
}

}  // namespace bindings
}  // namespace auvest
