// A filter put together at run time: any process, linearisation, kernel, recovery and interval
// policy, one Gaussian or a sum of several, sensors of any kind, measurements of an earlier time,
// and whole records.
//
// It is the core's filters that run here: RuntimeRobust is their composition, and every model
// brings its own compiled predict and update (models.hpp). Failure is a value, as everywhere.
#pragma once

#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/filters/late_updates.hpp"
#include "auvest/runtime/any_interval.hpp"
#include "desk/models.hpp"
#include "desk/smoother.hpp"

namespace auvest {
namespace desk {

/// What a filter is made of, beside its process.
template <class Scalar>
struct FilterOptions {
  using Linearisation = AnyLinearisation<Scalar>;
  using Rule = RuntimeRule<Scalar>;

  typename Linearisation::Kind kind = Linearisation::Kind::kEkf;
  typename SigmaPoints<Scalar>::Params points;
  Rule rule;
  AnyInterval<Scalar> policy;
  Scalar longest_step_s = Scalar(3600);  ///< a longer prediction is refused [s]
  Scalar late_s = Scalar(0);             ///< how far back a measurement may belong [s]
  int components = 1;                    ///< of a Gaussian sum: 1, or 8..kMaxComponents
  int headings = 1;                      ///< of which so many at the start: 1, or 2..components / 8
};

/// Rows in: each predicts, corrects by what was measured, and chooses the next interval.
template <class Scalar>
struct Record {
  std::size_t rows = 0;
  std::size_t width = 0;                 ///< columns of z
  const Scalar* z = nullptr;             ///< (rows, width); NaN throughout: missing
  const Scalar* dt = nullptr;            ///< (rows) [s]; NaN: the interval that the filter chose
  const Scalar* input = nullptr;         ///< (rows, inputs), or null
  const Scalar* place = nullptr;         ///< (rows, 3), NaN: where the sensor stands; or null
  const Scalar* age = nullptr;           ///< (rows) [s], or null: measured now
  const Scalar* reference = nullptr;     ///< (rows, 2) [m], NaN: the estimate; or null: no feedback
  const std::int32_t* sensor = nullptr;  ///< (rows) index into `sensors`, or null: the first
  std::vector<std::shared_ptr<const AnySensor<Scalar>>> sensors;

  const std::shared_ptr<const AnySensor<Scalar>>& sensor_of(std::size_t k) const {
    return sensors[sensor != nullptr ? static_cast<std::size_t>(sensor[k]) : 0];
  }
  bool measured(std::size_t k) const {
    const Scalar* const measurement = z + k * width;
    bool given = false;
    for (int i = 0; i < sensor_of(k)->size; ++i) given = given || !math::is_nan(measurement[i]);
    return given;
  }
  /// Where the sensor of a row stands; null: as the model has it.
  const Scalar* place_of(std::size_t k) const {
    const Scalar* there = place != nullptr ? place + k * kMaxPlace : nullptr;
    return there != nullptr && math::is_nan(there[0]) ? nullptr : there;
  }
  const Scalar* input_of(std::size_t k, int inputs) const {
    return input != nullptr ? input + k * static_cast<std::size_t>(inputs) : nullptr;
  }
};

/// Where the results go: a column each, row by row. P and S may be null.
template <class Scalar>
struct Columns {
  Scalar* x;
  Scalar* P;
  Scalar* innovation;
  Scalar* S;
  Scalar* standardised;
  Scalar* weight;
  Scalar* nis;
  Scalar* interval;
  std::uint8_t* decision;
  std::uint8_t* iterations;
  bool* near_field;
  bool* recovered;
  bool* too_late;
  std::uint8_t* convergence;  ///< this and `size` may be null
  std::uint8_t* size;
};

/// All that a filter carries from step to step, as numbers.
template <class Scalar>
struct FilterState {
  std::vector<Scalar> x, P;      ///< of the belief; P row by row
  std::vector<Scalar> input;     ///< that drove the last prediction
  std::vector<Scalar> policy;    ///< interval and the memory of the Mahalanobis law: 9 numbers
  std::vector<Scalar> recovery;  ///< count, variance, two recent rejections, widenings: 9 numbers
  std::vector<Scalar> mixture;   ///< of a Gaussian sum: see mixture_numbers(); else empty
  std::vector<Scalar> base;      ///< of the late memory: x, P, input, recovery, mixture of its base
  std::vector<Scalar> events;    ///< of the late memory: kEventNumbers each
  std::vector<std::shared_ptr<const AnySensor<Scalar>>> sensors;  ///< of the events; null: predict
};

/// Numbers of a recovery.
const std::size_t kRecoveryNumbers = 9;

/// Numbers of a mixture of `size` components: accepted, headings, bend, size, and of each weight, x
/// and P. A single one is the belief itself.
inline std::size_t mixture_numbers(int size, int states) {
  return static_cast<std::size_t>(4 + (size > 1 ? size * (1 + states + states * states) : 0));
}

/// Numbers of an event: dt, input, z, moved, place.
const std::size_t kEventNumbers = 1 + kMaxInputs + kMaxSize + 1 + kMaxPlace;

template <class Scalar>
class AnyFilter {
 public:
  virtual ~AnyFilter() = default;
  virtual std::unique_ptr<AnyFilter> clone() const = 0;

  virtual int states() const = 0;
  virtual int inputs() const = 0;
  virtual Status reset(const Scalar* x0, const Scalar* P0, const Scalar* reference) = 0;
  /// dt: NaN for the filter's own interval. input: `inputs()` numbers.
  virtual Status predict(Scalar dt, const Scalar* input) = 0;
  /// z: as many numbers as the sensor gives. place: null for where the sensor stands.
  virtual Report<Scalar> update(const Scalar* z,
                                const std::shared_ptr<const AnySensor<Scalar>>& sensor,
                                const Scalar* place, Scalar age) = 0;
  /// reference: null for the estimate.
  virtual Status feedback(const Scalar* reference) = 0;
  /// Takes rows until one is refused, which leaves the filter at the row before; says how many were
  /// done. A measurement that is older than the late memory is left out and marked.
  virtual std::size_t run(const Record<Scalar>& record, const Columns<Scalar>& out,
                          Report<Scalar>& last, Status& status) = 0;

  /// Smooths the first rows of a record that goes through as run() takes it, dt given in every row;
  /// the filter stays where it is. Rows behind those say what their late measurements, or a lag,
  /// ask for.
  virtual Status smooth(const Record<Scalar>& record, const Smoothed<Scalar>& out) const = 0;

  /// What the filter says of itself, as Robust does.
  virtual Status status() const = 0;
  virtual void x(Scalar* out) const = 0;
  virtual void P(Scalar* out) const = 0;
  virtual Scalar interval() const = 0;
  virtual const AnyInterval<Scalar>& policy() const = 0;

  /// How many components a Gaussian sum may have; 1: it is none.
  virtual int components() const = 0;
  /// Of a Gaussian sum.
  virtual Convergence convergence() const = 0;
  /// How many components there are now, and number k of them.
  virtual int size() const = 0;
  virtual void component(int k, Scalar& weight, Scalar* x, Scalar* P) const = 0;

  virtual FilterState<Scalar> save() const = 0;
  virtual Status restore(const FilterState<Scalar>& state) = 0;
};

/// Events of the last `window` seconds.
template <class Event>
class RecentEvents {
 public:
  using Scalar = typename Event::Scalar;

  explicit RecentEvents(Scalar window) : window_(window), span_(Scalar(0)) {}

  int size() const { return static_cast<int>(events_.size()); }
  const Event& operator[](int k) const { return events_[static_cast<std::size_t>(k)]; }

  /// True where the events without the first still reach back `window` seconds.
  bool full() const { return !events_.empty() && !(span_ - events_.front().dt < window_); }

  void insert(int at, const Event& event) {
    events_.insert(events_.begin() + at, event);
    span_ = span_ + event.dt;
  }
  void remove_first() {
    events_.pop_front();
    span_ = Scalar(0);  // a sum formed anew does not drift
    for (const Event& event : events_) span_ = span_ + event.dt;
  }

 private:
  Scalar window_;
  Scalar span_;
  std::deque<Event> events_;
};

template <class Scalar, int N>
class SideBySide;

template <class Scalar, int N>
class FilterFor final : public AnyFilter<Scalar> {
 public:
  using Robust = RuntimeRobust<Scalar, N>;
  using Adaptive = AdaptiveInterval<Robust, AnyInterval<Scalar>>;
  using Sensor = PlacedSensor<Scalar, N>;
  using Event = LateEvent<Robust, Sensor>;
  using Events = RecentEvents<Event>;
  using Memory = LateMemory<Robust, Sensor, Events>;
  using Options = FilterOptions<Scalar>;

  FilterFor(const std::shared_ptr<const ProcessFor<Scalar, N>>& process, const Options& options)
      : filter_(robust(process, options), options.policy),
        headings_(options.headings),
        late_s_(options.late_s),
        memory_(filter_, Events(options.late_s)) {}

  const Adaptive& filter() const { return filter_; }

  std::unique_ptr<AnyFilter<Scalar>> clone() const override {
    return std::unique_ptr<AnyFilter<Scalar>>(new FilterFor(*this));
  }

  int states() const override { return N; }
  int inputs() const override { return filter_.process().model->inputs; }

  Status reset(const Scalar* x0, const Scalar* P0, const Scalar* reference) override {
    typename Adaptive::State x;
    typename Adaptive::Covariance p;
    typename Adaptive::Position desired;
    for (int i = 0; i < N; ++i) x(i) = x0[i];
    for (int i = 0; i < N * N; ++i) p.data()[i] = P0[i];
    for (int i = 0; i < 2; ++i) desired(i) = reference[i];
    Adaptive filter = filter_;
    Status status = filter.reset(x, p, desired);
    if constexpr (N > 2) {
      Robust& robust = filter;
      if (status == Status::kOk && headings_ > 1) status = robust.reset(x, p, headings_);
    }
    if (status != Status::kOk) return status;
    filter_ = filter;
    memory_ = Memory(filter_, Events(late_s_));
    return status;
  }

  Status predict(Scalar dt, const Scalar* input) override {
    const Scalar elapsed = math::is_nan(dt) ? filter_.interval() : dt;
    typename Event::Input values = Event::Input::Zero();
    for (int i = 0; i < inputs(); ++i) values(i) = input[i];
    Robust& robust = filter_;
    return late() ? memory_.predict(robust, elapsed, values) : robust.predict(elapsed, values);
  }

  Report<Scalar> update(const Scalar* z, const std::shared_ptr<const AnySensor<Scalar>>& sensor,
                        const Scalar* place, Scalar age) override {
    const Sensor there = placed(sensor, place);
    const typename Sensor::Measurement value = to_measurement(z, *sensor);
    Robust& robust = filter_;
    if (age > oldest()) return Report<Scalar>(Status::kTimeBackwards);
    if (late()) return memory_.update(robust, value, there, age);
    return robust.update(value, there);
  }

  Status feedback(const Scalar* reference) override {
    typename Adaptive::Position desired;
    for (int i = 0; i < 2; ++i) {
      const bool given = reference != nullptr && !math::is_nan(reference[i]);
      desired(i) = given ? reference[i] : filter_.x()(i < N ? i : 0);
    }
    return filter_.feedback(desired);
  }

  std::size_t run(const Record<Scalar>& record, const Columns<Scalar>& out, Report<Scalar>& last,
                  Status& status) override {
    status = Status::kOk;
    Robust before = filter_;
    std::optional<Memory> remembered;
    for (std::size_t k = 0; k < record.rows; ++k) {
      before = filter_;
      if (late()) remembered = memory_;
      Report<Scalar> report;
      bool too_late = false;
      status = take(record, k, report, too_late);
      if (status != Status::kOk) {
        static_cast<Robust&>(filter_) = before;
        if (remembered) memory_ = *remembered;
        return k;
      }
      write(k, record.width, report, too_late, out);
      last = report;
    }
    return record.rows;
  }

  Status smooth(const Record<Scalar>& record, const Smoothed<Scalar>& out) const override {
    BackwardPass<Robust> pass(late() ? memory_.base() : static_cast<const Robust&>(filter_),
                              !math::is_nan(out.lag_s));
    Awaited awaited(late_s_);  // as in the late memory, with all that is in it
    for (int k = 0; late() && k < memory_.events().size(); ++k) {
      awaited.insert(k, AwaitedEvent(memory_.events()[k], false));
    }
    std::vector<double> times;
    double now = 0;
    for (std::size_t k = 0; k < record.rows; ++k) {
      typename Event::Input input = Event::Input::Zero();
      for (int i = 0; i < inputs(); ++i) {
        input(i) =
            record.input[k * static_cast<std::size_t>(inputs()) + static_cast<std::size_t>(i)];
      }
      now += static_cast<double>(record.dt[k]);
      times.push_back(now);
      Status status =
          await(AwaitedEvent(Event(record.dt[k], input), true), awaited.size(), awaited, pass);
      const auto& sensor = record.sensor_of(k);
      if (status == Status::kOk && record.measured(k)) {
        const Scalar age = record.age != nullptr ? record.age[k] : Scalar(0);
        int at = 0;
        const bool too_late = age > oldest() || place_of(awaited, age, at) != Status::kOk;
        const Event event(to_measurement(record.z + k * record.width, *sensor),
                          placed(sensor, record.place_of(k)));
        if (!too_late) status = await(AwaitedEvent(event, false), at, awaited, pass);
      }
      if (status != Status::kOk) return status;
    }
    while (awaited.size() > 0) {
      const Status status = redo(awaited[0], pass);
      if (status != Status::kOk) return status;
      awaited.remove_first();
    }
    pass.finish();
    return go_back(pass, times, out);
  }

  Status status() const override { return filter_.status(); }
  void x(Scalar* out) const override { copy(filter_.x(), out); }
  void P(Scalar* out) const override { copy(filter_.P(), out); }
  Scalar interval() const override { return filter_.interval(); }
  const AnyInterval<Scalar>& policy() const override { return filter_.policy(); }

  int components() const override {
    if constexpr (kSums) return filter_.params().components;
    return 1;
  }
  Convergence convergence() const override {
    if constexpr (kSums) return filter_.convergence();
    return Convergence::kSettled;
  }
  int size() const override {
    if constexpr (kSums) return filter_.size();
    return 1;
  }
  void component(int k, Scalar& weight, Scalar* x, Scalar* P) const override {
    typename Robust::BeliefType belief = filter_.belief();
    weight = Scalar(1);
    if constexpr (kSums) {
      belief = filter_.component(k);
      weight = filter_.weight(k);
    }
    math::mirror_lower(belief.P);
    copy(belief.x, x);
    copy(belief.P, P);
  }

  FilterState<Scalar> save() const override {
    FilterState<Scalar> state;
    append(filter_.x(), state.x);
    append(filter_.P(), state.P);
    append(filter_.process().input, state.input);
    const auto& law = filter_.policy().mahalanobis.memory;
    state.policy = {filter_.interval(),
                    law.tau,
                    law.interval,
                    law.ratio,
                    law.mahalanobis_squared,
                    law.last_estimate(0),
                    law.last_estimate(1),
                    law.last_reference(0),
                    law.last_reference(1)};
    append_recovery(filter_, state.recovery);
    append_mixture(filter_, state.mixture);
    if (!late()) return state;
    append(memory_.base().x(), state.base);
    append(memory_.base().P(), state.base);
    append(memory_.base().process().input, state.base);
    append_recovery(memory_.base(), state.base);
    append_mixture(memory_.base(), state.base);
    for (int k = 0; k < memory_.events().size(); ++k) {
      const Event& event = memory_.events()[k];
      state.events.push_back(event.dt);
      append(event.input, state.events);
      append(event.z, state.events);
      state.events.push_back(Scalar(event.sensor.moved ? 1 : 0));
      state.events.insert(state.events.end(), event.sensor.place, event.sensor.place + kMaxPlace);
      state.sensors.push_back(event.is_update ? event.sensor.model : nullptr);
    }
    return state;
  }

  Status restore(const FilterState<Scalar>& state) override {
    Adaptive filter = filter_;
    const std::size_t base = N + N * N + kMaxInputs + kRecoveryNumbers;  // and the mixture
    if (state.x.size() != N || state.P.size() != N * N || state.input.size() != kMaxInputs ||
        state.policy.size() != 9 || state.recovery.size() != kRecoveryNumbers ||
        (late() ? state.base.size() < base : !state.base.empty()) ||
        state.events.size() != kEventNumbers * state.sensors.size()) {
      return Status::kBadParameter;
    }
    AnyInterval<Scalar> policy = filter_.policy();
    auto& law = policy.mahalanobis.memory;
    const Scalar* p = state.policy.data();
    law.tau = p[1];
    law.interval = p[2];
    law.ratio = p[3];
    law.mahalanobis_squared = p[4];
    for (int i = 0; i < 2; ++i) {
      law.last_estimate(i) = p[5 + i];
      law.last_reference(i) = p[7 + i];
    }
    // First the policy: the belief comes with its mixture then.
    typename Robust::BeliefType belief;
    std::copy_n(state.x.data(), N, belief.x.data());
    std::copy_n(state.P.data(), N * N, belief.P.data());
    Status status = filter.restore(belief, policy, p[0]);
    if (status != Status::kOk) return status;
    status = restore_robust(filter, state.x.data(), state.P.data(), state.input.data(),
                            state.recovery.data(), state.mixture.data(), state.mixture.size());
    if (status != Status::kOk) return status;

    Robust start = filter;
    if (late()) {
      const Scalar* b = state.base.data();
      status = restore_robust(start, b, b + N, b + N + N * N, b + N + N * N + kMaxInputs, b + base,
                              state.base.size() - base);
      if (status != Status::kOk) return status;
    }
    Events events(late_s_);
    for (std::size_t k = 0; k < state.sensors.size(); ++k) {
      const Scalar* numbers = &state.events[k * kEventNumbers];
      if (!math::all_finite(numbers, kEventNumbers)) return Status::kNotFinite;
      if (!math::within(numbers[0], Scalar(0), filter.longest_step_s())) {
        return Status::kBadParameter;
      }
      events.insert(static_cast<int>(k), event(numbers, state.sensors[k]));
    }
    filter_ = filter;
    memory_ = Memory(start, events);
    return Status::kOk;
  }

 private:
  friend class SideBySide<Scalar, N>;

  static constexpr bool kSums = N > 1;  // one state is no position

  static Robust robust(const std::shared_ptr<const ProcessFor<Scalar, N>>& process,
                       const Options& options) {
    RuntimeProcess<Scalar, N> driven;
    driven.model = process;
    const AnyLinearisation<Scalar> how(options.kind, options.points, N);
    RuntimeInside<Scalar, N> inside(RuntimeGaussian<Scalar, N>(driven, how), options.rule);
    inside.limit_steps(options.longest_step_s);
    if constexpr (kSums) {
      typename Robust::Params params;
      params.components = static_cast<std::uint8_t>(options.components);
      return Robust(inside, params);
    } else {
      return Robust(inside);
    }
  }

  bool late() const { return late_s_ > Scalar(0); }
  /// An age may be a sum that was rounded.
  Scalar oldest() const { return late_s_ * Scalar(1.00001); }

  /// An event that a late measurement may still go before.
  struct AwaitedEvent : Event {
    bool row;  // the prediction of a row of the record
    AwaitedEvent(const Event& event, bool of_row) : Event(event), row(of_row) {}
  };
  using Awaited = RecentEvents<AwaitedEvent>;

  /// Puts an event where it belongs, and lets go of those that are too old, as the late memory
  /// does.
  static Status await(const AwaitedEvent& event, int at, Awaited& awaited,
                      BackwardPass<Robust>& pass) {
    while (awaited.full()) {
      if (at == 0) return redo(event, pass);
      const Status status = redo(awaited[0], pass);
      if (status != Status::kOk) return status;
      awaited.remove_first();
      --at;
    }
    awaited.insert(at, event);
    return Status::kOk;
  }
  static Status redo(const AwaitedEvent& event, BackwardPass<Robust>& pass) {
    return event.row ? pass.predict(event.dt, event.input) : event.redo(pass.filter());
  }

  Sensor placed(const std::shared_ptr<const AnySensor<Scalar>>& sensor, const Scalar* place) const {
    const auto& model = static_cast<const SensorFor<Scalar, N>&>(*sensor);
    // Only what is remembered is owned: counting owners takes as long as a tenth of an update.
    const auto owner = late() ? sensor : std::shared_ptr<const AnySensor<Scalar>>();
    Sensor there;
    there.model = std::shared_ptr<const SensorFor<Scalar, N>>(owner, &model);
    there.moved = place != nullptr;
    for (int i = 0; there.moved && i < sensor->place; ++i) there.place[i] = place[i];
    return there;
  }
  static typename Sensor::Measurement to_measurement(const Scalar* z,
                                                     const AnySensor<Scalar>& sensor) {
    typename Sensor::Measurement value = Sensor::Measurement::Zero();
    for (int i = 0; i < sensor.size; ++i) value(i) = z[i];
    return value;
  }

  Status take(const Record<Scalar>& record, std::size_t k, Report<Scalar>& report, bool& too_late) {
    Status status = predict(record.dt[k], record.input_of(k, inputs()));
    if (status != Status::kOk) return status;
    if (record.measured(k)) {
      const Scalar age = record.age != nullptr ? record.age[k] : Scalar(0);
      const Scalar* z = record.z + k * record.width;
      report = update(z, record.sensor_of(k), record.place_of(k), age);
      too_late = report.status == Status::kTimeBackwards && age > Scalar(0);
      if (too_late) report = Report<Scalar>();
      if (report.status != Status::kOk) return report.status;
    }
    if (record.reference == nullptr) return Status::kOk;
    return feedback(record.reference + k * 2);
  }

  void write(std::size_t k, std::size_t width, const Report<Scalar>& report, bool too_late,
             const Columns<Scalar>& out) const {
    copy(filter_.x(), out.x + k * N);
    if (out.P != nullptr) copy(filter_.P(), out.P + k * N * N);
    const std::size_t size = static_cast<std::size_t>(report.size);
    const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
    for (std::size_t i = 0; i < width; ++i) {
      const bool there = i < size;
      out.innovation[k * width + i] = there ? report.innovation[i] : nan;
      out.standardised[k * width + i] = there ? report.standardised[i] : nan;
      out.weight[k * width + i] = there ? report.weight[i] : nan;
      for (std::size_t j = 0; out.S != nullptr && j < width; ++j) {
        out.S[(k * width + i) * width + j] = there && j < size ? report.S[i * size + j] : nan;
      }
    }
    out.nis[k] = size > 0 ? report.nis : nan;
    out.interval[k] = filter_.interval();
    out.decision[k] = static_cast<std::uint8_t>(report.decision);
    out.iterations[k] = report.iterations;
    out.near_field[k] = report.near_field;
    out.recovered[k] = report.recovered;
    out.too_late[k] = too_late;
    if (out.convergence != nullptr) {
      out.convergence[k] = static_cast<std::uint8_t>(convergence());
      out.size[k] = static_cast<std::uint8_t>(this->size());
    }
  }

  template <int Rows, int Cols>
  static void copy(const Matrix<Scalar, Rows, Cols>& matrix, Scalar* out) {
    for (int i = 0; i < Rows * Cols; ++i) out[i] = matrix.data()[i];
  }
  template <int Rows, int Cols>
  static void append(const Matrix<Scalar, Rows, Cols>& matrix, std::vector<Scalar>& out) {
    out.insert(out.end(), matrix.data(), matrix.data() + Rows * Cols);
  }
  static void append_recovery(const Robust& filter, std::vector<Scalar>& out) {
    const auto& streak = filter.rule().recovery.streak;
    out.push_back(Scalar(streak.count));
    out.push_back(streak.variance);
    append(streak.recent, out);
    out.push_back(Scalar(streak.widened));
  }

  static void append_mixture(const Robust& filter, std::vector<Scalar>& out) {
    if constexpr (kSums) {
      if (filter.params().components == 1) return;
      const auto& state = filter.state();
      out.push_back(Scalar(state.accepted));
      out.push_back(Scalar(state.headings));
      out.push_back(state.bend);
      out.push_back(Scalar(filter.size()));
      for (int k = 0; filter.size() > 1 && k < filter.size(); ++k) {
        out.push_back(filter.weight(k));
        append(filter.component(k).x, out);
        auto p = filter.component(k).P;
        math::mirror_lower(p);
        append(p, out);
      }
    }
  }

  /// Belief, rule and mixture together.
  static Status restore_belief(Robust& filter, const typename Robust::BeliefType& belief,
                               const typename Robust::Rule& rule, const Scalar* mixture,
                               std::size_t numbers) {
    if constexpr (kSums) {
      const int most = filter.params().components;
      if (most > 1) {
        for (int i : {0, 1, 3}) {
          const bool counts = numbers >= 4 && math::within(mixture[i], Scalar(0), Scalar(255));
          if (!counts) return Status::kBadParameter;
        }
        const int size = static_cast<int>(mixture[3]);
        if (size < 1 || size > most || numbers != mixture_numbers(size, N)) {
          return Status::kBadParameter;
        }
        auto state = filter.state();
        state.accepted = static_cast<std::uint8_t>(mixture[0]);
        state.headings = static_cast<std::uint8_t>(mixture[1]);
        state.bend = mixture[2];
        state.mixture.size = static_cast<std::uint8_t>(size);
        const Scalar* number = mixture + 4;
        for (int k = 0; size > 1 && k < size; ++k) {
          state.mixture.weight[k] = *number++;
          number = take(number, state.mixture.component[k].x);
          number = take(number, state.mixture.component[k].P);
        }
        return filter.restore(belief, rule, state);
      }
    }
    return numbers == 0 ? filter.restore(belief, rule) : Status::kBadParameter;
  }
  template <int Rows, int Cols>
  static const Scalar* take(const Scalar* numbers, Matrix<Scalar, Rows, Cols>& out) {
    std::copy_n(numbers, Rows * Cols, out.data());
    return numbers + Rows * Cols;
  }

  static Status restore_robust(Robust& filter, const Scalar* x, const Scalar* P,
                               const Scalar* input, const Scalar* recovery, const Scalar* mixture,
                               std::size_t mixture_size) {
    typename Robust::BeliefType belief;
    for (int i = 0; i < N; ++i) belief.x(i) = x[i];
    for (int i = 0; i < N * N; ++i) belief.P.data()[i] = P[i];
    auto rule = filter.rule();
    auto& streak = rule.recovery.streak;
    const bool counts = math::within(recovery[0], Scalar(0), Scalar(255)) &&
                        math::within(recovery[8], Scalar(0), Scalar(255));
    if (!counts || !math::all_finite(input, kMaxInputs)) return Status::kBadParameter;
    streak.count = static_cast<std::uint8_t>(recovery[0]);
    streak.widened = static_cast<std::uint8_t>(recovery[8]);
    streak.variance = recovery[1];
    for (int i = 0; i < 6; ++i) streak.recent.data()[i] = recovery[2 + i];
    const Status status = restore_belief(filter, belief, rule, mixture, mixture_size);
    if (status == Status::kOk) {
      typename Event::Input values;
      for (int i = 0; i < kMaxInputs; ++i) values(i) = input[i];
      filter.drive(values);
    }
    return status;
  }

  static Event event(const Scalar* numbers,
                     const std::shared_ptr<const AnySensor<Scalar>>& sensor) {
    typename Event::Input input;
    typename Event::Measurement z;
    for (int i = 0; i < kMaxInputs; ++i) input(i) = numbers[1 + i];
    for (int i = 0; i < kMaxSize; ++i) z(i) = numbers[1 + kMaxInputs + i];
    if (sensor == nullptr) return Event(numbers[0], input);
    const Scalar* rest = numbers + 1 + kMaxInputs + kMaxSize;
    Sensor placed;
    placed.model = std::static_pointer_cast<const SensorFor<Scalar, N>>(sensor);
    placed.moved = rest[0] != Scalar(0);
    for (int i = 0; i < kMaxPlace; ++i) placed.place[i] = rest[1 + i];
    return Event(z, placed);
  }

  Adaptive filter_;
  int headings_;  // of which the start is
  Scalar late_s_;
  Memory memory_;
};

/// A filter of this process of N states; needs reset() next. Null where the options are out of
/// range.
template <class Scalar, int N>
std::unique_ptr<AnyFilter<Scalar>> make_filter(
    const std::shared_ptr<const AnyProcess<Scalar>>& process,
    const FilterOptions<Scalar>& options) {
  const auto own = std::static_pointer_cast<const ProcessFor<Scalar, N>>(process);
  const bool possible = options.components <= (N > 1 ? kMaxComponents : 1) &&
                        options.headings >= 1 && (options.headings == 1 || N > 2);
  if (!possible) return nullptr;
  std::unique_ptr<FilterFor<Scalar, N>> made(new FilterFor<Scalar, N>(own, options));
  if (made->filter().check() != Status::kOk) return nullptr;
  return std::unique_ptr<AnyFilter<Scalar>>(made.release());
}

}  // namespace desk
}  // namespace auvest
