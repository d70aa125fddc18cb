// Filters and sensors for models that are functions, compiled for every size that they may have.
#include "desk/function_models.hpp"

namespace auvest {
namespace desk {
namespace {

template <int N>
std::shared_ptr<const AnyProcess<double>> make_process(int states,
                                                       const ProcessFunctions& functions) {
  if (states == N) {
    return std::make_shared<const ProcessOf<FunctionProcess<N>>>(FunctionProcess<N>(functions),
                                                                 functions.inputs);
  }
  if constexpr (N > 1) return make_process<N - 1>(states, functions);
  return nullptr;
}

template <int N, int M>
std::shared_ptr<AnySensor<double>> make_sensor(int states, int size,
                                               const SensorFunctions& functions) {
  if (states == N && size == M) {
    return std::make_shared<SensorOf<FunctionSensor<N, M>>>(FunctionSensor<N, M>(functions));
  }
  if constexpr (M > 1) {
    return make_sensor<N, M - 1>(states, size, functions);
  } else if constexpr (N > 1) {
    return make_sensor<N - 1, kMaxFunctionSize>(states, size, functions);
  }
  return nullptr;
}

}  // namespace

void add_function_filters(Catalogue<double>& catalogue) {
  add_filters<1>(catalogue);
  add_filters<5>(catalogue);
  add_filters<7>(catalogue);
  add_filters<9>(catalogue);
}

std::shared_ptr<const AnyProcess<double>> function_process(int states,
                                                           const ProcessFunctions& functions) {
  return make_process<kMaxFunctionStates>(states, functions);
}

std::shared_ptr<AnySensor<double>> function_sensor(int states, int size,
                                                   const SensorFunctions& functions) {
  return make_sensor<kMaxFunctionStates, kMaxFunctionSize>(states, size, functions);
}

}  // namespace desk
}  // namespace auvest
