#include "auvest/models/range_bearing.hpp"
#include "binders.hpp"
#include "params.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Scalar>
void bind_precision(py::module_& m) {
  using Model = PlanarRangeBearing<Scalar>;
  using Params = typename Model::Params;
  py::class_<Model>(m, named<Scalar>("RangeBearing").c_str(),
                    "Range and bearing from a fixed station, Eq. (6).")
      .def(py::init([](const py::dict& params) {
             const Model model(from_dict<Params>(params));
             require_ok(model.check());
             return model;
           }),
           py::arg("params"))
      .def_property_readonly("params", [](const Model& model) { return to_dict(model.params); })
      .def(
          "h",
          [](const Model& model, const Array<Scalar>& x) {
            require_shape(x, {-1, Model::kStates}, "x");
            py::array_t<Scalar> z({x.shape(0), py::ssize_t(Model::kSize)});
            for (py::ssize_t i = 0; i < x.shape(0); ++i) {
              typename Model::State state;
              for (int j = 0; j < Model::kStates; ++j) state(j) = x.at(i, j);
              copy_to(model.h(state), z.mutable_data(i, 0));
            }
            return z;
          },
          py::arg("x").noconvert(), "Noise-free measurements (K, 2) of the states (K, 6).");
}

}  // namespace

void bind_range_bearing(py::module_& m) {
  bind_precision<float>(m);
  bind_precision<double>(m);
  m.def("range_bearing_defaults", [] { return to_dict(PlanarRangeBearing<double>::Params()); });
}

}  // namespace bindings
}  // namespace auvest
