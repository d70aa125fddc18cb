// add_models(), for states_<N>.cpp, which compiles it for N states in both precisions.
#pragma once

#include "auvest/registry.hpp"
#include "desk/catalogue.hpp"

namespace auvest {
namespace desk {

#define AUVEST_ADD_PROCESS(name, ...) \
  if constexpr (__VA_ARGS__::kStates == N) add_process<__VA_ARGS__>(catalogue, name);
#define AUVEST_ADD_SENSOR(name, suits, ...) \
  if constexpr (suits) add_sensor<__VA_ARGS__>(catalogue, name);

template <int N, class Scalar>
void add_models(Catalogue<Scalar>& catalogue) {
  add_filters<N>(catalogue);
  AUVEST_PROCESSES(AUVEST_ADD_PROCESS)
  AUVEST_SENSORS(AUVEST_ADD_SENSOR)
}

#undef AUVEST_ADD_PROCESS
#undef AUVEST_ADD_SENSOR

}  // namespace desk
}  // namespace auvest
