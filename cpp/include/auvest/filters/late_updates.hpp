// Measurements that arrive late, each taken at its own time: a filter with a short memory.
//
// The last events (predictions and updates) are kept, and the filter as it was before them. A late
// measurement goes in where it belongs and all that is kept is done again: the filter is then, to
// the bit, what it would be had the measurement come in time. The memory is bounded by `Capacity`
// events; what is older than they are is refused with kTimeBackwards. Each event is done twice, now
// and when it leaves the memory, and those in it once more per late measurement.
#pragma once

#include "auvest/filters/gaussian_filter.hpp"
#include "auvest/status.hpp"

namespace auvest {

template <class Filter, class Sensor, int Capacity>
class LateUpdates {
  static_assert(Capacity >= 2, "a prediction and an update");
  // Never defined: avr-gcc has no std::declval.
  static Filter& any_filter();
  static const typename Sensor::Measurement& any_measurement();
  static const Sensor& any_sensor();

 public:
  using Scalar = typename Filter::Scalar;
  using Input = typename Filter::Process::Input;
  using Measurement = typename Sensor::Measurement;
  using Report = decltype(any_filter().update(any_measurement(), any_sensor()));

  /// Goes on from where `filter` is.
  explicit LateUpdates(const Filter& filter) : filter_(filter), base_(filter), count_(0) {}

  /// Carries the filter dt >= 0 seconds forward with this input.
  Status predict(Scalar dt, const Input& input) {
    const Status status = filter_.predict(dt, input);
    if (status == Status::kOk) insert(count_, Event(dt, input));
    return status;
  }

  /// Corrects by what was measured `age` >= 0 seconds ago: at the end of the prediction that ended
  /// nearest to then. Reports what the update did there. On anything but kOk nothing has changed.
  Report update(const Measurement& z, const Sensor& sensor, Scalar age = Scalar(0)) {
    if (!math::is_finite(age) || age < Scalar(0)) {
      return Report(math::is_finite(age) ? Status::kTimeBackwards : Status::kNotFinite);
    }
    int at = count_;
    Scalar half = Scalar(0);  // of the first prediction that is kept
    for (int k = count_ - 1; k >= 0; --k) {
      if (events_[k].is_update) continue;
      half = Scalar(0.5) * events_[k].dt;
      if (!(age > half)) break;
      age = age - events_[k].dt;
      at = k;
    }
    if (age > half) return Report(Status::kTimeBackwards);

    if (at == count_) {
      const Report report = filter_.update(z, sensor);
      if (report.status == Status::kOk) insert(count_, Event(z, sensor));
      return report;
    }
    Filter again = base_;
    for (int k = 0; k < at; ++k) redo(events_[k], again);
    const Report report = again.update(z, sensor);
    if (report.status != Status::kOk) return report;
    for (int k = at; k < count_; ++k) {
      const Status status = redo(events_[k], again);
      if (status != Status::kOk) return Report(status);
    }
    filter_ = again;
    insert(at, Event(z, sensor));
    return report;
  }

  const Filter& filter() const { return filter_; }

 private:
  struct Event {
    bool is_update;
    Scalar dt;      // of a prediction
    Input input;    // of a prediction
    Measurement z;  // of an update, as the sensor
    Sensor sensor;

    Event() : is_update(false), dt(Scalar(0)) {}
    Event(Scalar step, const Input& u) : is_update(false), dt(step), input(u) { math::set_zero(z); }
    Event(const Measurement& value, const Sensor& model)
        : is_update(true), dt(Scalar(0)), z(value), sensor(model) {
      math::set_zero(input);
    }
  };

  static Status redo(const Event& event, Filter& filter) {
    return event.is_update ? filter.update(event.z, event.sensor).status
                           : filter.predict(event.dt, event.input);
  }

  /// Puts the event at place `at`; the first one leaves where there is no room.
  void insert(int at, const Event& event) {
    if (count_ == Capacity) {
      redo(at > 0 ? events_[0] : event, base_);
      if (at == 0) return;
      for (int k = 1; k < at; ++k) events_[k - 1] = events_[k];
      events_[at - 1] = event;
      return;
    }
    for (int k = count_; k > at; --k) events_[k] = events_[k - 1];
    events_[at] = event;
    ++count_;
  }

  Filter filter_;
  Filter base_;  ///< before the first event
  Event events_[Capacity];
  int count_;
};

}  // namespace auvest
