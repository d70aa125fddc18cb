// auvest._core: the C++ estimators, strict. The friendly layer is python/auvest.
#include "binders.hpp"

PYBIND11_MODULE(_core, m) {
  using namespace auvest::bindings;
  m.doc() = "The C++ core of auvest. Strict: use the auvest package.";
  bind_status(m);
  bind_math(m);
  bind_random(m);
  bind_intervals(m);
  bind_kernels(m);
  bind_filters(m);
  bind_function_models(m);
  bind_runs(m);
  bind_tracking(m);
  bind_slat(m);
  bind_cooperative(m);
  bind_guidance(m);
  bind_mission(m);
  bind_pilot(m);
  bind_vehicle(m);
  bind_self_test(m);
}
