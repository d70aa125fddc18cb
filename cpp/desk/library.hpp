// What the file that load_models generates is made of: it adds the models of a header to the
// catalogues of both precisions, and says what they are like.
#pragma once

#include "desk/catalogue.hpp"

namespace auvest {
namespace desk {

/// The optional names in a model: words, separated by spaces.
#define AUVEST_NAMES_OF(member)                                                        \
  template <class Model>                                                               \
  constexpr auto member##_of(int)->decltype(static_cast<const char*>(Model::member)) { \
    return Model::member;                                                              \
  }                                                                                    \
  template <class Model>                                                               \
  constexpr const char* member##_of(long) {                                            \
    return "";                                                                         \
  }

AUVEST_NAMES_OF(kStateNames)
AUVEST_NAMES_OF(kInputNames)
AUVEST_NAMES_OF(kMeasureNames)

#undef AUVEST_NAMES_OF

/// Whether a sensor of `least` leading states can be for n of them; asked per Scalar, so that what
/// does not suit is not compiled.
template <class Scalar>
constexpr bool suits(int n, int least) {
  return n >= least;
}

/// Whether the Python module brings the filters of n states in this precision.
template <class Scalar>
constexpr bool has_filters(int n) {
  const bool for_functions = std::is_same<Scalar, double>::value && n <= 9;
  return n == 2 || n == 3 || n == 4 || n == 6 || for_functions;
}

template <class Scalar>
class Library {
 public:
  /// Models are called prefix + name. `description` takes a line of words for each, separated by
  /// tabs.
  Library(Catalogue<Scalar>& catalogue, const char* prefix, std::string& description)
      : catalogue_(catalogue), prefix_(prefix), description_(description) {}

  template <class Process>
  void process(const char* name) {
    constexpr int kStates = Process::kStates;
    if constexpr (CheckProcess<Process>::kComplete && check_params<Process>()) {
      add_process<Process>(catalogue_, prefix_ + name);
      if constexpr (!has_filters<Scalar>(kStates)) add_filters<kStates>(catalogue_);
      say("process", name, kStates, input_size<Process>(), 0, 0, propagates<Process>(),
          kStateNames_of<Process>(0), kInputNames_of<Process>(0));
    }
  }

  template <class Model>
  void sensor(const char* name) {
    if constexpr (CheckSensor<Model>::kComplete && check_params<Model>()) {
      add_sensor<Model>(catalogue_, prefix_ + name);
      say("sensor", name, Model::kStates, Model::kSize, Model::kObserved, Model::kPlace,
          has_H<Model>(), kStateNames_of<Model>(0), kMeasureNames_of<Model>(0));
    }
  }

 private:
  void say(const char* kind, const char* name, int states, int size, int observed, int place,
           bool jacobian, const char* state_names, const char* names) {
    description_ += std::string(kind) + '\t' + name + '\t' + std::to_string(states) + '\t' +
                    std::to_string(size) + '\t' + std::to_string(observed) + '\t' +
                    std::to_string(place) + '\t' + (jacobian ? '1' : '0') + '\t' + state_names +
                    '\t' + names + '\n';
  }

  Catalogue<Scalar>& catalogue_;
  std::string prefix_;
  std::string& description_;
};

}  // namespace desk
}  // namespace auvest

/// What the module looks for in a library; `add_to` is a function template over Library<Scalar>&.
#define AUVEST_LIBRARY(prefix, add_to)                                                     \
  extern "C" __attribute__((visibility("default"))) void auvest_add_models(                \
      auvest::desk::Catalogue<float>& floats, auvest::desk::Catalogue<double>& doubles) {  \
    std::string unused;                                                                    \
    auvest::desk::Library<float> in_float(floats, prefix, unused);                         \
    add_to(in_float);                                                                      \
    auvest::desk::Library<double> in_double(doubles, prefix, unused);                      \
    add_to(in_double);                                                                     \
  }                                                                                        \
  extern "C" __attribute__((visibility("default"))) const char* auvest_describe_models() { \
    static const std::string text = [] {                                                   \
      std::string description;                                                             \
      auvest::desk::Catalogue<double> catalogue;                                           \
      auvest::desk::Library<double> library(catalogue, prefix, description);               \
      add_to(library);                                                                     \
      return description;                                                                  \
    }();                                                                                   \
    return text.c_str();                                                                   \
  }
