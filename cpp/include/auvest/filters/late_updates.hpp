// Measurements that arrive late, each taken at its own time: a filter with a short memory.
//
// The last events (predictions and updates) are kept, and the filter as it was before them. A late
// measurement goes in where it belongs and all that is kept is done again: the filter is then, to
// the bit, what it would be had the measurement come in time. The memory is bounded; what is older
// than it is refused with kTimeBackwards. Each event is done twice, now and when it leaves the
// memory, and those in it once more per late measurement.
//
// LateMemory works beside a filter, LateUpdates holds one and remembers `Capacity` events.
#pragma once

#include "auvest/filters/gaussian_filter.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// A prediction or an update, as it can be done again.
template <class Filter, class Sensor>
struct LateEvent {
  using Scalar = typename Filter::Scalar;
  using Input = typename InputOf<typename Filter::Process>::Type;
  using Measurement = typename Sensor::Measurement;

  bool is_update;
  Scalar dt;      ///< of a prediction [s]
  Input input;    ///< of a prediction
  Measurement z;  ///< of an update, as the sensor
  Sensor sensor;

  LateEvent() : is_update(false), dt(Scalar(0)) {
    clear(input);
    math::set_zero(z);
  }
  LateEvent(Scalar step, const Input& u) : is_update(false), dt(step), input(u) {
    math::set_zero(z);
  }
  LateEvent(const Measurement& value, const Sensor& model)
      : is_update(true), dt(Scalar(0)), z(value), sensor(model) {
    clear(input);
  }

  Status redo(Filter& filter) const {
    return is_update ? filter.update(z, sensor).status : step(filter, dt, input);
  }

  /// A prediction, of whatever process.
  template <class Given>
  static Status step(Filter& filter, Scalar dt, const Given& input) {
    return filter.predict(dt, input);
  }
  static Status step(Filter& filter, Scalar dt, const NoInput&) { return filter.predict(dt); }

 private:
  template <class Given>
  static void clear(Given& input) {
    math::set_zero(input);
  }
  static void clear(NoInput&) {}
};

/// The last `Capacity` events in order, in place.
template <class Event, int Capacity>
class EventArray {
  static_assert(Capacity >= 2, "a prediction and an update");

 public:
  EventArray() : count_(0) {}

  int size() const { return count_; }
  const Event& operator[](int k) const { return events_[k]; }
  /// True where the first event must leave before another comes.
  bool full() const { return count_ == Capacity; }

  void insert(int at, const Event& event) {
    for (int k = count_; k > at; --k) events_[k] = events_[k - 1];
    events_[at] = event;
    ++count_;
  }

  void remove_first() {
    for (int k = 1; k < count_; ++k) events_[k - 1] = events_[k];
    --count_;
  }

 private:
  Event events_[Capacity];
  int count_;
};

/// Where in the events what was measured `age` seconds ago belongs: kTimeBackwards where that is
/// before all of them.
template <class Events, class Scalar>
Status place_of(const Events& events, Scalar age, int& at) {
  if (!math::is_finite(age)) return Status::kNotFinite;
  if (age < Scalar(0)) return Status::kTimeBackwards;
  const int count = events.size();
  at = count;
  Scalar half = Scalar(0);  // of the first prediction that is kept
  for (int k = count - 1; k >= 0; --k) {
    if (events[k].is_update) continue;
    half = Scalar(0.5) * events[k].dt;
    if (!(age > half)) break;
    age = age - events[k].dt;
    at = k;
  }
  return age > half ? Status::kTimeBackwards : Status::kOk;
}

/// The events since some time ago, and the filter as it was then.
template <class Filter, class Sensor, class Events_>
class LateMemory {
  // Never defined: avr-gcc has no std::declval.
  static Filter& any_filter();
  static const typename Sensor::Measurement& any_measurement();
  static const Sensor& any_sensor();

 public:
  using Scalar = typename Filter::Scalar;
  using Event = LateEvent<Filter, Sensor>;
  using Events = Events_;
  using Input = typename Event::Input;
  using Measurement = typename Event::Measurement;
  using Report = decltype(any_filter().update(any_measurement(), any_sensor()));

  /// Goes on from where `filter` is.
  explicit LateMemory(const Filter& filter) : base_(filter), events_() {}

  /// In events that lie elsewhere, or are of some number.
  LateMemory(const Filter& filter, const Events& events) : base_(filter), events_(events) {}

  /// Forgets everything and goes on from where `filter` is.
  void restart(const Filter& filter) {
    base_ = filter;
    while (events_.size() > 0) events_.remove_first();
  }

  /// Carries the filter dt >= 0 seconds forward with this input.
  Status predict(Filter& filter, Scalar dt, const Input& input) {
    const Status status = Event::step(filter, dt, input);
    if (status == Status::kOk) insert(events_.size(), Event(dt, input));
    return status;
  }

  /// Corrects by what was measured `age` >= 0 seconds ago: at the end of the prediction that ended
  /// nearest to then. Reports what the update did there. On anything but kOk nothing has changed.
  Report update(Filter& filter, const Measurement& z, const Sensor& sensor, Scalar age) {
    int at;
    const Status status = place_of(events_, age, at);
    if (status != Status::kOk) return Report(status);
    return at == events_.size() ? update_now(filter, z, sensor)
                                : update_late(filter, z, sensor, at);
  }

  const Filter& base() const { return base_; }  ///< before the first event
  const Events& events() const { return events_; }

 private:
  AUVEST_OUTLINE Report update_now(Filter& filter, const Measurement& z, const Sensor& sensor) {
    const Report report = filter.update(z, sensor);
    if (report.status == Status::kOk) remember(events_.size(), z, sensor);
    return report;
  }

  AUVEST_OUTLINE Report update_late(Filter& filter, const Measurement& z, const Sensor& sensor,
                                    int at) {
    Filter again = base_;
    for (int k = 0; k < at; ++k) events_[k].redo(again);
    Report report = again.update(z, sensor);
    if (report.status != Status::kOk) return report;
    for (int k = at; k < events_.size(); ++k) {
      const Status status = events_[k].redo(again);
      if (status != Status::kOk) return Report(status);
    }
    filter = again;
    remember(at, z, sensor);
    return report;
  }

  AUVEST_OUTLINE void remember(int at, const Measurement& z, const Sensor& sensor) {
    insert(at, Event(z, sensor));
  }

  /// Puts the event at place `at`; the first ones leave where there is no room.
  void insert(int at, const Event& event) {
    while (events_.full()) {
      if (at == 0) {  // older than all that is kept: it leaves at once
        event.redo(base_);
        return;
      }
      events_[0].redo(base_);
      events_.remove_first();
      --at;
    }
    events_.insert(at, event);
  }

  Filter base_;
  Events events_;
};

template <class Filter, class Sensor, int Capacity>
class LateUpdates {
 public:
  using Memory = LateMemory<Filter, Sensor, EventArray<LateEvent<Filter, Sensor>, Capacity>>;
  using Scalar = typename Filter::Scalar;
  using State = typename Filter::State;
  using Covariance = typename Filter::Covariance;
  using Input = typename Memory::Input;
  using Measurement = typename Memory::Measurement;
  using Report = typename Memory::Report;

  /// Goes on from where `filter` is.
  explicit LateUpdates(const Filter& filter) : filter_(filter), memory_(filter) {}

  /// With a filter that needs no parameters: reset() gives it its belief.
  LateUpdates() : memory_(filter_) {}

  /// Sets the belief, as the filter does; everything before is forgotten.
  Status reset(const State& x0, const Covariance& P0) {
    const Status status = filter_.reset(x0, P0);
    if (status == Status::kOk) memory_.restart(filter_);
    return status;
  }

  /// Carries the filter dt >= 0 seconds forward with this input.
  Status predict(Scalar dt, const Input& input) { return memory_.predict(filter_, dt, input); }

  /// The same for a process without input.
  Status predict(Scalar dt) { return predict(dt, NoInput()); }

  /// Corrects by what was measured `age` >= 0 seconds ago. On anything but kOk nothing has changed.
  Report update(const Measurement& z, const Sensor& sensor, Scalar age = Scalar(0)) {
    return memory_.update(filter_, z, sensor, age);
  }

  /// As above, by one number, or by an expression of as many as the sensor measures.
  Report update(Scalar z, const Sensor& sensor, Scalar age = Scalar(0)) {
    return update(MeasurementOf<Sensor>::from(z), sensor, age);
  }
  template <class Z>
  Report update(const Eigen::MatrixBase<Z>& z, const Sensor& sensor, Scalar age = Scalar(0)) {
    return update(MeasurementOf<Sensor>::from(z), sensor, age);
  }

  const Filter& filter() const { return filter_; }

 private:
  Filter filter_;
  Memory memory_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
