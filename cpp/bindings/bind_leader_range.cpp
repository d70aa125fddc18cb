#include "auvest/models/leader_range.hpp"
#include "binders.hpp"
#include "params.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Scalar>
void bind_precision(py::module_& m) {
  using Model = PlanarLeaderRange<Scalar>;
  py::class_<Model>(m, named<Scalar>("LeaderRange").c_str(),
                    "Range to a leader of known position, Eqs. (4)-(5).")
      .def(py::init([](const py::dict& params) {
             const Model model(from_dict<typename Model::Params>(params));
             require_ok(model.check());
             return model;
           }),
           py::arg("params"))
      .def_property_readonly("params", [](const Model& model) { return to_dict(model.params); })
      .def(
          "h",
          [](const Model& model, const Array<Scalar>& x) {
            require_shape(x, {-1, 2}, "x");
            py::array_t<Scalar> z(x.shape(0));
            for (py::ssize_t i = 0; i < x.shape(0); ++i) {
              typename Model::State state;
              for (int j = 0; j < 2; ++j) state(j) = x.at(i, j);
              *z.mutable_data(i) = model.h(state)(0);
            }
            return z;
          },
          py::arg("x").noconvert(), "Noise-free ranges (K,) of the positions (K, 2).");
}

}  // namespace

void bind_leader_range(py::module_& m) {
  bind_precision<float>(m);
  bind_precision<double>(m);
  m.def("leader_range_defaults", [] { return to_dict(PlanarLeaderRange<double>::Params()); });
}

}  // namespace bindings
}  // namespace auvest
