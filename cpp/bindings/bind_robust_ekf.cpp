#include "auvest/filters/ekf.hpp"
#include "robust_binder.hpp"

namespace auvest {
namespace bindings {
namespace {

struct MakeEkf {
  template <class Process>
  Ekf<Process> operator()(const Process& process, const py::dict& params) const {
    if (!params.empty()) throw py::key_error("the EKF has no parameters of its own");
    return Ekf<Process>(process);
  }
};

}  // namespace

void bind_robust_ekf(py::module_& m) { bind_robust<Ekf>(m, "RobustEkf", MakeEkf()); }

}  // namespace bindings
}  // namespace auvest
