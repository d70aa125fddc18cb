// What can be made by name: processes, and sensors for a number of states, from their parameters as
// numbers in the order in which Params::visit names them.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "desk/filter.hpp"

namespace auvest {
namespace desk {

/// Names and defaults of a model's parameters.
struct Parameters {
  std::vector<std::string> names;
  std::vector<double> defaults;
};

template <class Scalar, class Made>
struct Entry {
  Parameters parameters;
  /// Null where check() refuses the parameters; `status` then says why.
  std::function<std::shared_ptr<Made>(const Scalar*, Status& status)> make;
};

template <class Scalar>
struct Catalogue {
  std::map<std::string, Entry<Scalar, const AnyProcess<Scalar>>> processes;
  /// By name and number of states.
  std::map<std::pair<std::string, int>, Entry<Scalar, AnySensor<Scalar>>> sensors;
  /// By number of states.
  std::map<int, decltype(&make_filter<Scalar, 2>)> filters;
};

template <class Params>
Parameters parameters_of() {
  Parameters result;
  Params params;
  params.visit([&result](const char* name, const auto& value) {
    result.names.emplace_back(name);
    result.defaults.push_back(static_cast<double>(value));
  });
  return result;
}

template <class Params, class Scalar>
Params params_from(const Scalar* values) {
  Params params;
  params.visit([&values](const char*, Scalar& value) { value = *values++; });
  return params;
}

/// A model with these parameters: from its constructor, or with its member `params`.
template <class Model>
Model model_from(const ParamsOf<Model>& params) {
  if constexpr (std::is_constructible<Model, const ParamsOf<Model>&>::value) {
    return Model(params);
  } else {
    Model model;
    if constexpr (!std::is_same<ParamsOf<Model>, NoParams>::value) model.params = params;
    return model;
  }
}

template <class Process, class Scalar>
void add_process(Catalogue<Scalar>& catalogue, const std::string& name) {
  using Params = ParamsOf<Process>;
  auto& entry = catalogue.processes[name];
  entry.parameters = parameters_of<Params>();
  entry.make = [](const Scalar* values,
                  Status& status) -> std::shared_ptr<const AnyProcess<Scalar>> {
    const Process process = model_from<Process>(params_from<Params>(values));
    status = process.check();
    if (status != Status::kOk) return nullptr;
    return std::make_shared<const ProcessOf<Process>>(process);
  };
}

template <class Model, class Scalar>
void add_sensor(Catalogue<Scalar>& catalogue, const std::string& name) {
  using Params = ParamsOf<Model>;
  auto& entry = catalogue.sensors[{name, Model::kStates}];
  entry.parameters = parameters_of<Params>();
  entry.make = [](const Scalar* values, Status& status) -> std::shared_ptr<AnySensor<Scalar>> {
    const Model model = model_from<Model>(params_from<Params>(values));
    status = model.check();
    if (status != Status::kOk) return nullptr;
    return std::make_shared<SensorOf<Model>>(model);
  };
}

/// The filters of N states; they are compiled once, whatever the process.
template <int N, class Scalar>
void add_filters(Catalogue<Scalar>& catalogue) {
  catalogue.filters[N] = &make_filter<Scalar, N>;
}

/// The filters and the models of the registry for N states: states_<N>.cpp, by desk/states.hpp.
template <int N, class Scalar>
void add_models(Catalogue<Scalar>& catalogue);

}  // namespace desk
}  // namespace auvest
