// The replay of a robust EKF, UKF or CKF: speed and heading or odometry, ranges to leaders. As
// replay.hpp, with records of its own kind:
//
//     record: process + 256 times filter + 65536 where measurements are late, steps, kernel, its
//             three thresholds, post-fit?, rejections (0: no recovery),
//             process parameters, sensor (leader left out), x0, P0,
//             then per step: flags, dt, input, z, leader, and where they are late age
//     trace:  status of reset, then per step: x, P, innovation, S, nis, standardised, weight,
//             variance asked for by the recovery and its two recent rejections, two words of counts
//             and statuses
#pragma once

#include "auvest/filters/ckf.hpp"
#include "auvest/filters/ekf.hpp"
#include "auvest/filters/late_updates.hpp"
#include "auvest/filters/robust.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/odometry.hpp"
#include "auvest/models/speed_heading.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "auvest/runtime/any_recovery.hpp"

namespace auvest {
namespace parity {

template <class Stream>
class RobustReplay {
 public:
  explicit RobustReplay(Stream& stream) : stream_(stream) {}

  void run() {
    enum Kind : std::uint32_t { kSpeedHeading, kSpeedHeadingBiasScale, kOdometry };
    enum Filter : std::uint32_t { kEkf, kUkf, kCkf };
    const std::uint32_t kind = stream_.read();
    const std::uint32_t process = kind % 256;
    const std::uint32_t filter = kind / 256 % 256;
    const bool late = kind >= 65536;
    steps_ = stream_.read();
    read_rule();
    if (late) {  // of one filter, so that the program fits into the chip
      replay<Ekf<SpeedHeading<float>>, Late>();
      return;
    }
    if (process == kSpeedHeading) replay<Ekf<SpeedHeading<float>>>();
    if (process == kSpeedHeadingBiasScale) {
      using Process = SpeedHeading<float, true, true>;
      if (filter == kEkf) replay<Ekf<Process>>();
      if (filter == kUkf) replay<Ukf<Process>>();
      if (filter == kCkf) replay<Ckf<Process>>();
    }
    if (process == kOdometry) {
      if (filter == kEkf) replay<Ekf<Odometry<float>>>();
      if (filter == kUkf) replay<Ukf<Odometry<float>>>();
      if (filter == kCkf) replay<Ckf<Odometry<float>>>();
    }
  }

 private:
  using Rule = RobustUpdate<AnyKernel<float>, AnyRecovery<float>>;

  void read_rule() {
    const auto kind = static_cast<AnyKernel<float>::Kind>(stream_.read());
    float threshold[3];
    for (float& value : threshold) value = read();
    AnyKernel<float>& kernel = rule_.kernel;
    kernel.kind = kind;
    kernel.huber.params.k = threshold[0];
    kernel.igg.params.k0 = threshold[0];
    kernel.igg.params.k1 = threshold[1];
    kernel.hampel.params.a = threshold[0];
    kernel.hampel.params.b = threshold[1];
    kernel.hampel.params.c = threshold[2];
    const bool post_fit = stream_.read() != 0;
    rule_.params.residual = post_fit ? Residual::kPostFit : Residual::kInnovation;
    const std::uint32_t rejections = stream_.read();
    rule_.recovery.enabled = rejections > 0;
    if (rejections > 0) {
      rule_.recovery.streak.params.rejections = static_cast<std::uint8_t>(rejections);
    }
  }

  /// A filter whose measurements come in time, with the interface of LateUpdates.
  template <class Filter, class Sensor>
  struct InTime {
    Filter now;
    explicit InTime(const Filter& filter) : now(filter) {}

    Status predict(float dt, const typename Filter::Process::Input& input) {
      return now.predict(dt, input);
    }
    RobustCorrection<float, 1> update(const Vector<float, 1>& z, const Sensor& sensor, float) {
      return now.update(z, sensor);
    }
    const Filter& filter() const { return now; }
  };

  /// Its last twelve events may still be preceded.
  template <class Filter, class Sensor>
  struct Late : LateUpdates<Filter, Sensor, 12> {
    explicit Late(const Filter& filter) : LateUpdates<Filter, Sensor, 12>(filter) {}
  };

  template <class Plain, template <class, class> class Taker = InTime>
  void replay() {
    using Process = typename Plain::Process;
    using Filter = Robust<Plain, Rule>;
    typename Process::Params params;
    params.visit([this](const char*, float& value) { value = read(); });
    using Sensor = LeaderRange<float, Process::kStates>;
    Sensor sensor;
    sensor.params.sigma_range_m = read();
    sensor.params.sigma_leader_m = read();
    sensor.params.lift_smallest();  // the noise of a record is not cut off at 0
    Filter filter{Plain(Process(params)), rule_};
    typename Filter::State x0;
    typename Filter::Covariance p0;
    p0.setZero();
    for (int i = 0; i < Process::kStates; ++i) x0(i) = read();
    for (int i = 0; i < Process::kStates; ++i) {
      for (int j = 0; j <= i; ++j) p0(i, j) = read();
    }
    filter.limit_steps(math::infinity());  // a record goes to the ends of the format
    stream_.write(static_cast<std::uint32_t>(filter.reset(x0, p0)));
    Taker<Filter, Sensor> taker(filter);
    for (std::uint32_t k = 0; k < steps_; ++k) step(taker, sensor);
  }

  template <class Filter, class Sensor>
  float read_age(const InTime<Filter, Sensor>&) {
    return 0.0f;
  }
  template <class Filter, class Sensor>
  float read_age(const Late<Filter, Sensor>&) {
    return read();
  }

  template <class Taker, class Sensor>
  void step(Taker& taker, Sensor& sensor) {
    const bool measured = stream_.read() != 0;
    const float dt = read();
    Vector<float, 3> input;
    for (int i = 0; i < 3; ++i) input(i) = read();
    Vector<float, 1> z;
    z(0) = read();
    sensor.params.leader_x_m = read();
    sensor.params.leader_y_m = read();
    const float age = read_age(taker);

    const Status predicted = taker.predict(dt, input);
    RobustCorrection<float, 1> u(Status::kOk);
    if (measured) u = taker.update(z, sensor, age);

    const auto& filter = taker.filter();
    for (int i = 0; i < Sensor::kStates; ++i) write(filter.x()(i));
    for (int i = 0; i < Sensor::kStates; ++i) {
      for (int j = 0; j <= i; ++j) write(filter.belief().P(i, j));
    }
    write(u.innovation(0));
    write(u.S(0, 0));
    write(u.nis);
    write(u.standardised(0));
    write(u.weight(0));
    const RejectionStreak<float>& streak = filter.rule().recovery.streak;
    write(streak.variance);
    for (int i = 0; i < 2; ++i) {
      for (int k = 0; k < 3; ++k) write(streak.recent(i, k));
    }
    stream_.write(
        static_cast<std::uint32_t>(u.decision) | static_cast<std::uint32_t>(u.iterations) << 8 |
        static_cast<std::uint32_t>(predicted) << 16 | static_cast<std::uint32_t>(u.status) << 24);
    stream_.write((u.recovered ? 1u : 0u) | static_cast<std::uint32_t>(streak.count) << 8);
  }

  float read() { return math::from_bits(stream_.read()); }
  void write(float value) { stream_.write(math::to_bits(value)); }

  Stream& stream_;
  std::uint32_t steps_ = 0;
  Rule rule_;
};

}  // namespace parity
}  // namespace auvest
