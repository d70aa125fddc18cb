// The pilot of a torpedo: from what compass, gyro, log, depth gauge and USBL say to rudder, stern
// planes and propeller, once per period. What the paper's vehicle computes between two samples, in
// one class that a sketch takes whole:
//
//     heading filter -> EKF with the current in its state, robust, late fixes at their own time
//     -> waypoints -> line of sight with the crab angle fed forward -> autopilot
//
// A period, after start():
//
//     if (pilot.wants_fix()) { pilot.asked(); ... }      // ping the USBL
//     pilot.predict(readings, 0.1f);                     // what has come of the other sensors
//     pilot.update(fix, age);                            // each fix that has come, however late
//     pilot.steer(command);                              // for the actuators until the next period
//
// What does not come, or cannot be true, is not taken, and the vehicle does this:
//
//     compass   the gyro carries the heading on; after compass_s the vehicle stops
//     gyro      the last rates for hold_s; then the vehicle stops
//     depth     the last depth for hold_s; then the vehicle stops
//     log       the last speeds for hold_s; then the speed that is wanted stands for it
//     USBL      dead reckoning until the position is not known to lost_m; then the vehicle stops
//
// A vehicle that stops has fins amidships and the propeller off (with a little buoyancy it comes
// up), goes on to estimate, and resumes its plan when what was missing is back. Before compass,
// gyro and depth have been heard once, and after the end of the plan, it is stopped too. The
// interval policy is fed a desired point that moves along the plan at the wanted speed while the
// vehicle does, and is not asked while it is stopped: the paper's law takes a desired point that
// stands still for a reason to measure as often as it may.
#pragma once

#include <cstdint>

#include "auvest/control/autopilot.hpp"
#include "auvest/control/heading_filter.hpp"
#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/filters/ekf.hpp"
#include "auvest/filters/late_updates.hpp"
#include "auvest/filters/robust.hpp"
#include "auvest/guidance/crab_feed_forward.hpp"
#include "auvest/guidance/waypoints.hpp"
#include "auvest/intervals/fixed_interval.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/speed_heading_current.hpp"
#include "auvest/robust/igg.hpp"
#include "auvest/robust/rejection_streak.hpp"
#include "auvest/robust/robust_update.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The sensors that are read in every period: bits of PilotReadings::heard.
enum PilotSensor : std::uint8_t {
  kCompassHeard = 1,  ///< heading_rad, pitch_rad
  kGyroHeard = 2,     ///< pitch_rate_rad_s, yaw_rate_rad_s
  kLogHeard = 4,      ///< speed_m_s, sway_m_s
  kDepthHeard = 8     ///< depth_m
};

/// What has come in a period.
template <class Scalar>
struct PilotReadings : AutopilotReadings<Scalar> {
  Scalar sway_m_s = Scalar(0);  ///< through the water, to starboard
  std::uint8_t heard = 0;       ///< PilotSensor bits; what is not heard is not looked at
};

/// What the vehicle is doing.
enum class PilotMode : std::uint8_t {
  kWaiting,   ///< stopped: compass, gyro or depth has not been heard yet
  kUnderWay,  ///< flying its plan
  kFinished,  ///< stopped: the plan is at its end
  kSilent,    ///< stopped: compass, gyro or depth has been silent for too long
  kLost       ///< stopped: the position is not known well enough
};

/// `Events` is how many predictions and fixes are kept for a fix that comes late: 16 are 1.3 s at
/// ten predictions and two fixes a second.
template <class Scalar_, class Policy_ = FixedInterval<Scalar_>, int Events = 16>
class Pilot {
 public:
  using Scalar = Scalar_;
  using Policy = Policy_;
  using Process = SpeedHeadingCurrent<Scalar>;
  using Sonar = RangeBearing<Scalar, 4>;
  using Rule = RobustUpdate<Igg<Scalar>, RejectionStreak<Scalar>>;
  using Estimator = Robust<Ekf<Process>, Rule>;
  using Filter = AdaptiveInterval<Estimator, Policy>;
  using Memory = LateMemory<Estimator, Sonar, EventArray<LateEvent<Estimator, Sonar>, Events>>;
  using Report = typename Memory::Report;
  using Readings = PilotReadings<Scalar>;
  using Command = TorpedoCommand<Scalar>;

  struct Params {
    Scalar period_s = Scalar(0.1);   ///< of the loop, > 0
    Scalar speed_m_s = Scalar(1.5);  ///< through the water, > 0
    Scalar depth_m = Scalar(5);
    Scalar end_m = Scalar(2);          ///< the plan is over this much before its last waypoint
    Scalar start_sigma_m = Scalar(1);  ///< of the place it starts at, per axis
    Scalar current_sigma_m_s = Scalar(0.3);  ///< of the current, about 0, per axis

    Scalar hold_s = Scalar(1);      ///< how long a silent sensor's last reading stands for it
    Scalar compass_s = Scalar(30);  ///< how long the gyro stands for the compass
    Scalar lost_m = Scalar(20);     ///< sqrt(P_xx + P_yy) beyond which it stops

    // What cannot be true: a reading beyond is taken for none.
    Scalar most_angle_rad = Scalar(6.2831853);
    Scalar most_pitch_rad = Scalar(1.4);
    Scalar most_rate_rad_s = Scalar(2);
    Scalar most_speed_m_s = Scalar(5);
    Scalar least_depth_m = Scalar(-2);
    Scalar most_depth_m = Scalar(200);
    Scalar most_range_m = Scalar(2000);

    typename Process::Params model;
    typename Sonar::Params sonar;
    typename Waypoints<Scalar>::Params waypoints;
    typename CrabFeedForward<Scalar>::Params guidance;
    typename HeadingFilter<Scalar>::Params heading;
    typename Autopilot<Scalar>::Params autopilot;
  };

  explicit Pilot(const Params& params = Params(), const Policy& policy = Policy())
      : params_(params),
        sonar_(params.sonar),
        filter_(Estimator(Ekf<Process>(Process(params.model))), policy),
        memory_(filter_),
        path_(params.waypoints),
        law_(params.guidance),
        heading_filter_(params.heading),
        autopilot_(params.autopilot),
        hold_s_(silence(params.hold_s)),
        compass_s_(silence(params.compass_s)),
        lost_m2_(params.lost_m * params.lost_m),
        stride_m_(params.speed_m_s * params.period_s) {}

  /// The first part that refuses its parameters, or kOk.
  Status check() const {
    if (!math::is_positive(params_.period_s) || !math::is_positive(params_.speed_m_s)) {
      return Status::kBadParameter;
    }
    const Status parts[] = {filter_.check(), sonar_.check(),          path_.check(),
                            law_.check(),    heading_filter_.check(), autopilot_.check()};
    for (const Status part : parts) {
      if (part != Status::kOk) return part;
    }
    return Status::kOk;
  }

  /// Takes a plan, which must live as long as the pilot, and begins at this place [m] and heading
  /// [rad]. On anything but kOk a mission that is under way goes on; path().report() says what is
  /// wrong with a plan.
  Status start(const Waypoint<Scalar>* plan, std::uint16_t count, Scalar x_m, Scalar y_m,
               Scalar heading_rad) {
    Status status = check();
    if (status == Status::kOk && !math::is_finite(heading_rad)) status = Status::kNotFinite;
    if (status == Status::kOk && path_.examine(plan, count).status() == Status::kOk) {
      status = begin_filter(x_m, y_m);
    }
    // What refuses now is the plan, before anything has changed.
    if (status == Status::kOk) status = path_.start(plan, count);
    if (status != Status::kOk) return status;
    autopilot_.restart(heading_rad);
    plan_ = plan;
    count_ = count;
    memory_.restart(filter_);
    heading_filter_ = HeadingFilter<Scalar>(params_.heading);
    now_ = Readings();
    mode_ = PilotMode::kWaiting;
    for (Scalar& silence : silent_s_) silence = Scalar(0);
    period_ = asked_ = 0;
    next_ = periods_of(interval());
    desired_m_ = Scalar(0);
    begin_desired_leg(0);
    return Status::kOk;
  }

  /// Whether a fix is to be asked for in this period.
  bool wants_fix() const { return count_ > 0 && period_ >= next_; }

  /// It has been asked for.
  void asked() {
    asked_ = period_;
    next_ = period_ + periods_of(interval());
  }

  /// Takes what has come, `dt` seconds after the period before. What the status is of is the
  /// filter's prediction.
  Status predict(const Readings& readings, Scalar dt) {
    if (count_ == 0) return Status::kNotInitialised;
    if (!math::is_finite(dt)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    accept(readings, dt);
    return period_ > 0 ? memory_.predict(filter_, dt, input()) : Status::kOk;
  }

  /// Corrects by a fix, range [m] and bearing [rad], that was so `age` seconds ago. On anything but
  /// kOk the estimate is as it was.
  Report update(const typename Sonar::Measurement& fix, Scalar age) {
    if (count_ == 0) return Report(Status::kNotInitialised);
    if (!math::all_finite(fix)) return Report(Status::kNotFinite);
    if (!believe(math::within(fix(0), Scalar(0), params_.most_range_m) &&
                 within(fix(1), params_.most_angle_rad))) {
      return Report(Status::kBadParameter);
    }
    const Report report = memory_.update(filter_, fix, sonar_, age);
    if (report.status != Status::kOk || mode_ != PilotMode::kUnderWay) return report;
    if (filter_.feedback(desired()) == Status::kOk) {
      next_ = asked_ + periods_of(interval());
      if (next_ <= period_) next_ = period_ + 1;
    }
    return report;
  }

  /// The command until the next period, which begins with this call. The status is of guidance and
  /// control: on anything but kOk the vehicle is stopped for this period.
  Status steer(Command& command) {
    command = Command();
    if (count_ == 0) return Status::kNotInitialised;
    ++period_;
    const PilotMode before = mode_;
    mode_ = judge();
    if (mode_ != PilotMode::kUnderWay) return Status::kOk;
    if (before == PilotMode::kSilent || before == PilotMode::kLost) {
      autopilot_.restart(heading_filter_.heading_rad());
    }
    PathPoint<Scalar> point;
    Status status = path_.locate(filter_.x()(0), filter_.x()(1), point);
    if (status != Status::kOk) return status;
    cross_m_ = point.cross_m;
    if (over()) {
      mode_ = PilotMode::kFinished;
      return Status::kOk;
    }
    advance_desired();
    GuidanceCommand<Scalar> wanted;
    status = law_.set_current(filter_.x()(2), filter_.x()(3));
    if (status == Status::kOk) {
      status = law_.update(point, params_.speed_m_s, params_.period_s, wanted);
    }
    if (status != Status::kOk) return status;
    return autopilot_.update(wanted, params_.speed_m_s, params_.depth_m, now_, params_.period_s,
                             command);
  }

  PilotMode mode() const { return mode_; }  ///< as of the last steer()
  const Filter& filter() const { return filter_; }
  const Waypoints<Scalar>& path() const { return path_; }
  Scalar heading_rad() const { return heading_filter_.heading_rad(); }
  Scalar cross_track_m() const { return cross_m_; }  ///< of the estimate, as of the last steer()
  std::uint32_t implausible() const { return implausible_; }  ///< readings that cannot be true
  /// Seconds to the next fix: the policy's, and its first one while the vehicle is stopped.
  Scalar interval() const {
    return mode_ == PilotMode::kUnderWay ? filter_.interval() : filter_.policy().initial();
  }
  const Params& params() const { return params_; }

 private:
  static const int kSensors = 4;

  AUVEST_OUTLINE Status begin_filter(Scalar x_m, Scalar y_m) {
    typename Filter::State x;
    typename Filter::Covariance p;
    math::set_zero(x);
    math::set_zero(p);
    x(0) = x_m;
    x(1) = y_m;
    for (int i = 0; i < 2; ++i) {
      p(i, i) = params_.start_sigma_m * params_.start_sigma_m;
      p(i + 2, i + 2) = params_.current_sigma_m_s * params_.current_sigma_m_s;
    }
    return filter_.reset(x, p);
  }

  static bool within(Scalar value, Scalar most) { return math::within(value, -most, most); }

  /// Whether what a sensor says is taken; what cannot be true is counted.
  bool believe(bool plausible) {
    if (!plausible) ++implausible_;
    return plausible;
  }

  /// Notes for a sensor that it was heard, or for how long it has not been.
  bool note(int sensor, bool heard, Scalar dt) {
    silent_s_[sensor] = heard ? Scalar(0) : silent_s_[sensor] + dt;
    if (heard) now_.heard = static_cast<std::uint8_t>(now_.heard | (1 << sensor));
    return heard;
  }
  /// The silence that is longer than this one: sums of dt round.
  Scalar silence(Scalar longest_s) const { return longest_s + Scalar(0.5) * params_.period_s; }

  void accept(const Readings& r, Scalar dt) {
    const Params& p = params_;
    const bool gyro =
        (r.heard & kGyroHeard) != 0 && believe(within(r.yaw_rate_rad_s, p.most_rate_rad_s) &&
                                               within(r.pitch_rate_rad_s, p.most_rate_rad_s));
    if (note(1, gyro, dt)) {
      now_.yaw_rate_rad_s = r.yaw_rate_rad_s;
      now_.pitch_rate_rad_s = r.pitch_rate_rad_s;
    }
    if (period_ > 0 && heading_filter_.initialised()) {
      heading_filter_.predict(now_.yaw_rate_rad_s, dt);
    }
    const bool compass =
        (r.heard & kCompassHeard) != 0 &&
        believe(within(r.heading_rad, p.most_angle_rad) && within(r.pitch_rad, p.most_pitch_rad));
    if (note(0, compass, dt)) {
      now_.pitch_rad = r.pitch_rad;
      if (heading_filter_.initialised()) {
        heading_filter_.update(r.heading_rad);
      } else {
        heading_filter_.restart(r.heading_rad);
      }
    }
    now_.heading_rad = heading_filter_.heading_rad();
    const bool log = (r.heard & kLogHeard) != 0 && believe(within(r.speed_m_s, p.most_speed_m_s) &&
                                                           within(r.sway_m_s, p.most_speed_m_s));
    if (note(2, log, dt)) {
      now_.speed_m_s = r.speed_m_s;
      now_.sway_m_s = r.sway_m_s;
    } else if (silent_s_[2] > hold_s_) {
      now_.speed_m_s = mode_ == PilotMode::kUnderWay ? p.speed_m_s : Scalar(0);
      now_.sway_m_s = Scalar(0);
    }
    const bool depth = (r.heard & kDepthHeard) != 0 &&
                       believe(math::within(r.depth_m, p.least_depth_m, p.most_depth_m));
    if (note(3, depth, dt)) now_.depth_m = r.depth_m;
  }

  typename Process::Input input() const {
    typename Process::Input u;
    u(0) = now_.speed_m_s;
    u(1) = now_.sway_m_s;
    u(2) = now_.heading_rad;
    return u;
  }

  PilotMode judge() const {
    const std::uint8_t needed = kCompassHeard | kGyroHeard | kDepthHeard;
    if (mode_ == PilotMode::kFinished) return mode_;
    if ((now_.heard & needed) != needed) return PilotMode::kWaiting;
    if (silent_s_[0] > compass_s_ || silent_s_[1] > hold_s_ || silent_s_[3] > hold_s_) {
      return PilotMode::kSilent;
    }
    const auto& P = filter_.belief().P;
    const bool known = P(0, 0) + P(1, 1) < lost_m2_;
    return known ? PilotMode::kUnderWay : PilotMode::kLost;
  }

  bool over() const {
    const bool last = path_.leg() + 2 == count_ && !path_.on_arc();
    return path_.finished() || (last && path_.remaining_m() < params_.end_m);
  }

  std::uint32_t periods_of(Scalar interval) const {
    const Scalar periods = interval / params_.period_s + Scalar(0.5);
    return periods < Scalar(1) ? 1 : static_cast<std::uint32_t>(periods);
  }

  /// The desired point goes on along the plan, and along its last leg beyond it.
  void advance_desired() {
    desired_m_ = desired_m_ + stride_m_;
    while (desired_m_ > desired_length_m_ && desired_leg_ + 2 < count_) {
      desired_m_ = desired_m_ - desired_length_m_;
      begin_desired_leg(static_cast<std::uint16_t>(desired_leg_ + 1));
    }
  }
  void begin_desired_leg(std::uint16_t leg) {
    const Waypoint<Scalar>& from = plan_[leg];
    const Waypoint<Scalar>& to = plan_[leg + 1];
    const Scalar dx = to.x_m - from.x_m;
    const Scalar dy = to.y_m - from.y_m;
    desired_leg_ = leg;
    desired_length_m_ = math::sqrt(dx * dx + dy * dy);
  }
  typename Filter::Position desired() const {
    const Waypoint<Scalar>& from = plan_[desired_leg_];
    const Waypoint<Scalar>& to = plan_[desired_leg_ + 1];
    const Scalar share = desired_m_ / desired_length_m_;
    typename Filter::Position point;
    point(0) = from.x_m + (to.x_m - from.x_m) * share;
    point(1) = from.y_m + (to.y_m - from.y_m) * share;
    return point;
  }

  Params params_;
  Sonar sonar_;
  Filter filter_;
  Memory memory_;
  Waypoints<Scalar> path_;
  CrabFeedForward<Scalar> law_;
  HeadingFilter<Scalar> heading_filter_;
  Autopilot<Scalar> autopilot_;
  // Formed once, as a period has little time.
  Scalar hold_s_, compass_s_, lost_m2_, stride_m_;
  const Waypoint<Scalar>* plan_ = nullptr;
  std::uint16_t count_ = 0;
  Readings now_;  // `heard`: of all periods so far
  PilotMode mode_ = PilotMode::kWaiting;
  Scalar silent_s_[kSensors] = {Scalar(0), Scalar(0), Scalar(0), Scalar(0)};
  std::uint32_t period_ = 0, asked_ = 0, next_ = 0;
  std::uint32_t implausible_ = 0;
  Scalar cross_m_ = Scalar(0);
  std::uint16_t desired_leg_ = 0;
  Scalar desired_length_m_ = Scalar(0);
  Scalar desired_m_ = Scalar(0);  // from the beginning of its leg
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
