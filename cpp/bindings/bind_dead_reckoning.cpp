// The process models that are driven by an input: speed and heading, odometry.
#include "auvest/models/odometry.hpp"
#include "auvest/models/speed_heading.hpp"
#include "binders.hpp"
#include "params.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Model>
void bind_model(py::module_& m, const char* stem, const char* doc) {
  using Scalar = typename Model::Scalar;
  constexpr int kStates = Model::kStates;
  const auto driven = [](Model model, const Array<Scalar>& input) {
    model.input = to_matrix<3, 1>(input, "motion");
    return model;
  };
  py::class_<Model>(m, named<Scalar>(stem).c_str(), doc)
      .def(py::init([](const py::dict& params) {
             const Model model(from_dict<typename Model::Params>(params));
             require_ok(model.check());
             return model;
           }),
           py::arg("params"))
      .def_property_readonly("params", [](const Model& model) { return to_dict(model.params); })
      .def(
          "f",
          [driven](const Model& model, const Array<Scalar>& x, Scalar dt,
                   const Array<Scalar>& input) {
            return to_array(driven(model, input).f(to_matrix<kStates, 1>(x, "x"), dt));
          },
          py::arg("x").noconvert(), py::arg("dt"), py::arg("motion").noconvert(),
          "The state (n,) after dt seconds with this input (3,).")
      .def(
          "Phi",
          [driven](const Model& model, const Array<Scalar>& x, Scalar dt,
                   const Array<Scalar>& input) {
            return to_array(driven(model, input).Phi(to_matrix<kStates, 1>(x, "x"), dt));
          },
          py::arg("x").noconvert(), py::arg("dt"), py::arg("motion").noconvert(),
          "Jacobian (n, n) of f.")
      .def(
          "Q",
          [driven](const Model& model, Scalar dt, const Array<Scalar>& input) {
            return to_array(driven(model, input).Q(dt));
          },
          py::arg("dt"), py::arg("motion").noconvert(), "Process noise covariance (n, n).");
}

template <class Scalar>
void bind_precision(py::module_& m) {
  bind_model<SpeedHeading<Scalar>>(m, "SpeedHeading", "State (x, y), Eqs. (1)-(3).");
  bind_model<SpeedHeading<Scalar, true>>(m, "SpeedHeadingBias", "With the heading bias.");
  bind_model<SpeedHeading<Scalar, false, true>>(m, "SpeedHeadingScale", "With the speed scale.");
  bind_model<SpeedHeading<Scalar, true, true>>(m, "SpeedHeadingBiasScale", "With both.");
  bind_model<Odometry<Scalar>>(m, "Odometry", "State (x, y, theta), driven by increments.");
}

}  // namespace

void bind_dead_reckoning(py::module_& m) {
  bind_precision<float>(m);
  bind_precision<double>(m);
  m.def("speed_heading_defaults", [] { return to_dict(SpeedHeading<double>::Params()); });
  m.def("odometry_defaults", [] { return to_dict(Odometry<double>::Params()); });
}

}  // namespace bindings
}  // namespace auvest
