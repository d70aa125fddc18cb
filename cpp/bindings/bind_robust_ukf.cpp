#include "auvest/filters/ukf.hpp"
#include "robust_binder.hpp"

namespace auvest {
namespace bindings {
namespace {

struct MakeUkf {
  template <class Process>
  Ukf<Process> operator()(const Process& process, const py::dict& params) const {
    const Ukf<Process> filter(process, from_dict(params, Ukf<Process>::default_params()));
    require_ok(filter.check());
    return filter;
  }
};

}  // namespace

void bind_robust_ukf(py::module_& m) { bind_robust<Ukf>(m, "RobustUkf", MakeUkf()); }

}  // namespace bindings
}  // namespace auvest
