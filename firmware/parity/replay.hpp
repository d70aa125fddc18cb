// Replays a record through a filter and writes the trace: one source for the host, the ATmega2560
// and the Cortex-M, so that a difference between traces is a difference between targets.
//
// A stream gives and takes 32-bit words; a float travels as its bits. tests/parity/records.py
// writes records and names the fields of a trace.
//
//     record: kind, steps, sigma points, process, sensor (the limits of its range left out: its
//             noise is not cut off at 0), policy, x0, P0, reference,
//             then per step: flags, dt, z, reference
//     trace:  status of reset, then per step: x, P, interval, innovation, S, nis, statuses
//
// A record of kind kSelfTest has no more words; its trace is what auvest::self_test() reports. One
// of kind kRobust goes on as replay_robust.hpp says; AUVEST_WITHOUT_ROBUST, if defined, leaves it
// out.
#pragma once

#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/filters/ekf.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/runtime/any_interval.hpp"
#include "auvest/self_test.hpp"
#if !defined(AUVEST_WITHOUT_ROBUST)
#include "replay_robust.hpp"
#endif

namespace auvest {
namespace parity {

enum Kind : std::uint32_t { kEkfEuler, kEkfExact, kUkfEuler, kUkfExact, kSelfTest, kRobust = 16 };

// Flags of a step; what is not asked for is left out.
const std::uint32_t kGivenInterval = 1;  // predict(dt), not predict(interval())
const std::uint32_t kMeasured = 2;       // update
const std::uint32_t kReferenced = 4;     // feedback

const int kStates = 6;

template <class Stream>
class Replay {
 public:
  explicit Replay(Stream& stream) : stream_(stream) {}

  void run() {
    const std::uint32_t kind = stream_.read();
    if (kind == kSelfTest) {
      const SelfTestResult result = self_test();
      stream_.write(static_cast<std::uint32_t>(result.failed));
      stream_.write(result.index);
      return;
    }
#if !defined(AUVEST_WITHOUT_ROBUST)
    if (kind == kRobust) {
      RobustReplay<Stream>(stream_).run();
      return;
    }
#endif
    steps_ = stream_.read();
    read_params(points_);
    read_params(noise_);
    int left = 5;
    sensor_.params.visit([this, &left](const char*, float& value) {
      if (left-- > 0) value = read();
    });
    sensor_.params.lift_smallest();
    read_policy();
    if (kind == kEkfEuler) replay(Ekf<Euler>(Euler(noise_)));
    if (kind == kEkfExact) replay(Ekf<Exact>(Exact(noise_)));
    if (kind == kUkfEuler) replay(Ukf<Euler>(Euler(noise_), points_));
    if (kind == kUkfExact) replay(Ukf<Exact>(Exact(noise_), points_));
  }

 private:
  using Euler = EulerAcceleration<float>;
  using Exact = ExactAcceleration<float>;
  using Sensor = RangeBearing<float, kStates>;
  using Policy = AnyInterval<float>;
  using Update = Correction<float, Sensor::kSize>;

  template <class Filter>
  void replay(const Filter& start) {
    AdaptiveInterval<Filter, Policy> filter(start, policy_);
    filter.limit_steps(math::infinity());  // a record goes to the ends of the format
    typename Filter::State x0;
    typename Filter::Covariance p0;
    p0.setZero();
    read(x0);
    for (int i = 0; i < kStates; ++i) {
      for (int j = 0; j <= i; ++j) p0(i, j) = read();
    }
    Policy::Position reference;
    read(reference);
    stream_.write(static_cast<std::uint32_t>(filter.reset(x0, p0, reference)));
    for (std::uint32_t k = 0; k < steps_; ++k) step(filter);
  }

  template <class Filter>
  void step(Filter& filter) {
    const std::uint32_t flags = stream_.read();
    const float dt = read();
    Sensor::Measurement z;
    Policy::Position reference;
    read(z);
    read(reference);

    const Status predicted = filter.predict((flags & kGivenInterval) != 0 ? dt : filter.interval());
    const Update update = (flags & kMeasured) != 0 ? filter.update(z, sensor_) : missing();
    const Status chosen = (flags & kReferenced) != 0 ? filter.feedback(reference) : Status::kOk;

    write(filter.x());
    write_lower(filter.belief().P);
    write(filter.interval());
    write(update.innovation);
    write_lower(update.S);
    write(update.nis);
    stream_.write((update.near_field ? 1u : 0u) | static_cast<std::uint32_t>(predicted) << 8 |
                  static_cast<std::uint32_t>(update.status) << 16 |
                  static_cast<std::uint32_t>(chosen) << 24);
  }

  /// What the trace shows where there was no measurement: no numbers.
  static Update missing() {
    Update none(Status::kOk);
    none.nis = math::quiet_nan();
    for (int i = 0; i < Sensor::kSize; ++i) {
      none.innovation(i) = math::quiet_nan();
      for (int j = 0; j < Sensor::kSize; ++j) none.S(i, j) = math::quiet_nan();
    }
    return none;
  }

  void read_policy() {
    policy_.kind = static_cast<Policy::Kind>(stream_.read());
    if (policy_.kind == Policy::Kind::kFixed) read_params(policy_.fixed.params);
    if (policy_.kind == Policy::Kind::kMahalanobis) read_params(policy_.mahalanobis.params);
    if (policy_.kind == Policy::Kind::kCovarianceBudget) read_params(policy_.budget.params);
  }

  /// The members in the order in which Python names them.
  template <class Params>
  void read_params(Params& params) {
    params.visit([this](const char*, float& value) { value = read(); });
  }

  float read() { return math::from_bits(stream_.read()); }

  template <int Size>
  void read(Matrix<float, Size, 1>& vector) {
    for (int i = 0; i < Size; ++i) vector(i) = read();
  }

  void write(float value) { stream_.write(math::to_bits(value)); }

  template <int Size>
  void write(const Matrix<float, Size, 1>& vector) {
    for (int i = 0; i < Size; ++i) write(vector(i));
  }

  template <int Size>
  void write_lower(const Matrix<float, Size, Size>& matrix) {
    for (int i = 0; i < Size; ++i) {
      for (int j = 0; j <= i; ++j) write(matrix(i, j));
    }
  }

  Stream& stream_;
  std::uint32_t steps_ = 0;
  SigmaPoints<float>::Params points_;
  AccelerationNoise<float> noise_;
  Sensor sensor_;
  Policy policy_;
};

/// Reads one record from the stream and writes its trace.
template <class Stream>
void replay(Stream& stream) {
  Replay<Stream>(stream).run();
}

}  // namespace parity
}  // namespace auvest
