#include "auvest/filters/ukf.hpp"
#include "filter_binder.hpp"

namespace auvest {
namespace bindings {
namespace {

struct MakeUkf {
  template <class Process>
  Ukf<Process> operator()(const Process& process, const py::dict& params) const {
    const Ukf<Process> filter(process, from_dict<typename Ukf<Process>::Params>(params));
    require_ok(filter.check());
    return filter;
  }
};

}  // namespace

void bind_ukf(py::module_& m) { bind_filter<Ukf>(m, "Ukf", MakeUkf()); }

}  // namespace bindings
}  // namespace auvest
