// auvest._core: the C++ estimators, strict. The friendly layer is python/auvest.
#include "binders.hpp"

PYBIND11_MODULE(_core, m) {
  using namespace auvest::bindings;
  m.doc() = "The C++ core of auvest. Strict: use the auvest package.";
  bind_status(m);
  bind_math(m);
  bind_random(m);
  bind_range_bearing(m);
  bind_constant_acceleration(m);
  bind_leader_range(m);
  bind_dead_reckoning(m);
  bind_intervals(m);
  bind_kernels(m);
  bind_sigma_points(m);
  bind_tracking(m);
  bind_ekf(m);
  bind_ukf(m);
  bind_slat(m);
  bind_robust_ekf(m);
  bind_robust_ukf(m);
  bind_cooperative(m);
  bind_self_test(m);
}
