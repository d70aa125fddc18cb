// The portable functions over whole arrays.
#include "auvest/math/angle.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/trigonometry.hpp"
#include "binders.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Scalar, class Function>
void bind_unary(py::module_& m, const char* name, const char* doc, Function function) {
  m.def(
      name,
      [function](const Array<Scalar>& x) {
        py::array_t<Scalar> result(x.size());
        Scalar* out = result.mutable_data();
        const Scalar* in = x.data();
        const py::ssize_t n = x.size();
        {
          py::gil_scoped_release release;
          for (py::ssize_t i = 0; i < n; ++i) out[i] = function(in[i]);
        }
        return result.reshape(std::vector<py::ssize_t>(x.shape(), x.shape() + x.ndim()));
      },
      py::arg("x").noconvert(), doc);
}

template <class Scalar>
void bind_functions(py::module_& m) {
  bind_unary<Scalar>(m, "sin", "sin(x), x in rad.", [](Scalar x) { return math::sin(x); });
  bind_unary<Scalar>(m, "cos", "cos(x), x in rad.", [](Scalar x) { return math::cos(x); });
  bind_unary<Scalar>(m, "exp", "exp(x).", [](Scalar x) { return math::exp(x); });
  bind_unary<Scalar>(m, "log", "Natural logarithm.", [](Scalar x) { return math::log(x); });
  bind_unary<Scalar>(m, "wrap", "Angle in rad, wrapped to (-pi, pi].",
                     [](Scalar x) { return math::wrap(x); });
  m.def(
      "atan2",
      [](const Array<Scalar>& y, const Array<Scalar>& x) {
        if (y.ndim() != x.ndim() || !std::equal(y.shape(), y.shape() + y.ndim(), x.shape())) {
          throw py::value_error("y and x must have the same shape");
        }
        py::array_t<Scalar> result(x.size());
        Scalar* out = result.mutable_data();
        for (py::ssize_t i = 0; i < x.size(); ++i) out[i] = math::atan2(y.data()[i], x.data()[i]);
        return result.reshape(std::vector<py::ssize_t>(x.shape(), x.shape() + x.ndim()));
      },
      py::arg("y").noconvert(), py::arg("x").noconvert(), "Angle of (x, y) in rad.");
}

}  // namespace

void bind_math(py::module_& m) {
  bind_functions<float>(m);
  bind_functions<double>(m);
}

}  // namespace bindings
}  // namespace auvest
