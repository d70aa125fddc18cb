#include "auvest/robust/rejection_streak.hpp"
#include "auvest/robust/robust_update.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "binders.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Kernel>
AnyKernel<typename Kernel::Scalar> make(const py::dict& params) {
  const Kernel kernel(from_dict<typename Kernel::Params>(params));
  require_ok(kernel.check());
  return AnyKernel<typename Kernel::Scalar>(kernel);
}

/// A function of the residual, element by element.
template <class Scalar, class Function>
py::array_t<Scalar> map(const Array<Scalar>& t, Function function) {
  require_shape(t, {-1}, "t");
  py::array_t<Scalar> result(t.shape(0));
  for (py::ssize_t i = 0; i < t.shape(0); ++i) *result.mutable_data(i) = function(*t.data(i));
  return result;
}

template <class Scalar>
void bind_kernel(py::module_& m) {
  using Any = AnyKernel<Scalar>;
  py::class_<Any>(m, named<Scalar>("Kernel").c_str(), "A robust kernel.")
      .def_static("unit", &make<Unit<Scalar>>, py::arg("params"), "Least squares.")
      .def_static("huber", &make<Huber<Scalar>>, py::arg("params"), "Huber (1964).")
      .def_static("hampel", &make<Hampel<Scalar>>, py::arg("params"), "Hampel (1972).")
      .def_static("igg", &make<Igg<Scalar>>, py::arg("params"), "Zhou (1989), Eq. (20).")
      .def(
          "weight",
          [](const Any& kernel, const Array<Scalar>& t) {
            return map<Scalar>(t, [&kernel](Scalar v) { return kernel.weight(v); });
          },
          py::arg("t").noconvert(), "psi(t) / t of residuals (K,) in sigma.")
      .def(
          "rho",
          [](const Any& kernel, const Array<Scalar>& t) {
            return map<Scalar>(t, [&kernel](Scalar v) { return kernel.rho(v); });
          },
          py::arg("t").noconvert(), "Loss of residuals (K,) in sigma.");
}

}  // namespace

void bind_kernels(py::module_& m) {
  bind_kernel<float>(m);
  bind_kernel<double>(m);
  m.def("kernel_defaults", [] {
    py::dict result;
    result["unit"] = to_dict(Unit<double>::Params());
    result["huber"] = to_dict(Huber<double>::Params());
    result["hampel"] = to_dict(Hampel<double>::Params());
    result["igg"] = to_dict(Igg<double>::Params());
    return result;
  });
  m.def("robust_update_defaults", [] {
    const RobustUpdate<Unit<double>>::Params update;
    py::dict result;
    result["max_iterations"] = update.max_iterations;
    result["tolerance"] = update.tolerance;
    result["rejections"] = RejectionStreak<double>::Params().rejections;
    return result;
  });
  py::enum_<Decision>(m, "Decision", "What became of a measurement.")
      .value("accepted", Decision::kAccepted)
      .value("downweighted", Decision::kDownweighted)
      .value("rejected", Decision::kRejected);
}

}  // namespace bindings
}  // namespace auvest
