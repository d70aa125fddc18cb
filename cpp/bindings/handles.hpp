// What Python holds of the family of filters: handles on what cpp/desk makes.
#pragma once

#include "binders.hpp"
#include "desk/filter.hpp"

namespace auvest {
namespace bindings {

/// A filter with the report of its last update. One thread at a time: `busy` while one is inside.
template <class Scalar>
struct FilterHandle {
  std::unique_ptr<desk::AnyFilter<Scalar>> filter;
  desk::Report<Scalar> report;
  Status status = Status::kOk;
  bool busy = false;
};

/// Marks the filter as busy; refuses the second thread. Calls that hold the GIL cannot meet, so a
/// plain flag serves.
template <class Scalar>
class Occupied {
 public:
  explicit Occupied(FilterHandle<Scalar>& handle) : handle_(handle) {
    if (handle.busy) {
      throw std::runtime_error("this filter is in use by another thread; use one per thread");
    }
    handle.busy = true;
  }
  ~Occupied() { handle_.busy = false; }
  Occupied(const Occupied&) = delete;

 private:
  FilterHandle<Scalar>& handle_;
};

template <class Scalar>
void require_idle(const FilterHandle<Scalar>& handle) {
  if (handle.busy) {
    throw std::runtime_error("this filter is in use by another thread; use one per thread");
  }
}

template <class Scalar>
using SensorHandle = std::shared_ptr<desk::AnySensor<Scalar>>;

/// The filter as the simulations need it: compiled for its number of states.
template <class Scalar, int N>
const desk::FilterFor<Scalar, N>& filter_for(const FilterHandle<Scalar>& handle) {
  if (handle.filter->states() != N)
    throw py::value_error("the filter has another number of states");
  return static_cast<const desk::FilterFor<Scalar, N>&>(*handle.filter);
}

template <class Model>
const Model& model_of(const SensorHandle<typename Model::Scalar>& sensor) {
  const auto* own = dynamic_cast<const desk::SensorOf<Model>*>(sensor.get());
  if (own == nullptr) throw py::value_error("the sensor is of another kind");
  return own->model();
}

}  // namespace bindings
}  // namespace auvest
