#include "auvest/filters/sigma_points.hpp"
#include "binders.hpp"
#include "params.hpp"

namespace auvest {
namespace bindings {

void bind_sigma_points(py::module_& m) {
  m.def("sigma_points_defaults", [] { return to_dict(SigmaPoints<double>::Params()); });
}

}  // namespace bindings
}  // namespace auvest
