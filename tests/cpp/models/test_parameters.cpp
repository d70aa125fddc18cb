// What visit() says of the parameters of every registered model: each number by its own name.
#include <doctest/doctest.h>

#include <cstddef>
#include <set>
#include <string>

#include "auvest/registry.hpp"

namespace {

/// Sees each number's name and place.
struct Seen {
  int count = 0;
  std::set<std::string> names;
  std::set<const double*> places;

  void operator()(const char* name, const double& number) {
    ++count;
    names.insert(name);
    places.insert(&number);
  }
};

/// Of a model that suits.
template <bool Suits, class Model>
struct Check {
  static int run(const std::string& name) {
    CAPTURE(name);
    typename Model::Params params;
    Seen seen;
    params.visit(seen);
    CHECK(seen.names.size() == std::size_t(seen.count));
    CHECK(seen.places.size() == std::size_t(seen.count));
    return 1;
  }
};

template <class Model>
struct Check<false, Model> {
  static int run(const std::string&) { return 0; }
};

template <int N>
int check_sensors() {
  using namespace auvest;
  using Scalar = double;
  int models = 0;
#define CHECK_SENSOR(name, suits, ...) models += Check<(suits), __VA_ARGS__>::run(name);
  AUVEST_SENSORS(CHECK_SENSOR)
#undef CHECK_SENSOR
  return models;
}

TEST_CASE("parameters of models: every name is that of another number") {
  using namespace auvest;
  using Scalar = double;
  int models = 0;
#define CHECK_PROCESS(name, ...) models += Check<true, __VA_ARGS__>::run(name);
  AUVEST_PROCESSES(CHECK_PROCESS)
#undef CHECK_PROCESS
  CHECK(models == 12);
  CHECK(check_sensors<6>() == 8);
  CHECK(check_sensors<8>() == 5);
}

}  // namespace
