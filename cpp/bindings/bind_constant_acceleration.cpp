#include "auvest/models/constant_acceleration.hpp"
#include "binders.hpp"
#include "params.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Model>
void bind_model(py::module_& m, const char* stem, const char* doc) {
  using Scalar = typename Model::Scalar;
  using Params = typename Model::Params;
  py::class_<Model>(m, named<Scalar>(stem).c_str(), doc)
      .def(py::init([](const py::dict& params) {
             const Model model(from_dict<Params>(params));
             require_ok(model.check());
             return model;
           }),
           py::arg("params"))
      .def_property_readonly("params", [](const Model& model) { return to_dict(model.params); })
      .def(
          "Phi",
          [](const Model& model, Scalar dt) {
            return to_array(model.Phi(typename Model::State(), dt));
          },
          py::arg("dt"), "Transition matrix (6, 6) of dt seconds.")
      .def(
          "Q", [](const Model& model, Scalar dt) { return to_array(model.Q(dt)); }, py::arg("dt"),
          "Process noise covariance (6, 6) of dt seconds.");
}

template <class Scalar>
void bind_precision(py::module_& m) {
  bind_model<EulerAcceleration<Scalar>>(m, "EulerAcceleration",
                                        "Constant acceleration exactly as Eq. (4).");
  bind_model<ExactAcceleration<Scalar>>(m, "ExactAcceleration",
                                        "Constant acceleration, exactly discretised.");
}

}  // namespace

void bind_constant_acceleration(py::module_& m) {
  bind_precision<float>(m);
  bind_precision<double>(m);
  m.def("constant_acceleration_defaults",
        [] { return to_dict(ExactAcceleration<double>::Params()); });
}

}  // namespace bindings
}  // namespace auvest
