// The closed loop of a vehicle: sensors, estimate, guidance, control, actuators, hull, in turn.
//
// Order within a step, 10 times a second: the sensors read; the estimate is predicted and what has
// arrived corrects it; guidance switches the leg and says what to steer; control commands the
// actuators; the command is held while the hull moves on. Between fixes guidance runs on the
// predicted estimate.
//
// The vehicle's own part (estimate, guidance, control) is computed in `Scalar`; hull, sensors and
// the judgement of the run are in double, on the desk.
//
// The tracks, sensors and gains of MissionScenario are those of the closed-loop table in
// docs/algorithms/guidance.md, whose rows mission_source() names.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "auvest/control/autopilot.hpp"
#include "auvest/control/heading_filter.hpp"
#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/filters/ekf.hpp"
#include "auvest/filters/late_updates.hpp"
#include "auvest/filters/robust.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/guidance/adaptive_line_of_sight.hpp"
#include "auvest/guidance/circle.hpp"
#include "auvest/guidance/crab_feed_forward.hpp"
#include "auvest/guidance/integral_line_of_sight.hpp"
#include "auvest/guidance/line_of_sight.hpp"
#include "auvest/guidance/vector_field.hpp"
#include "auvest/guidance/waypoints.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/speed_heading_current.hpp"
#include "auvest/robust/robust_update.hpp"
#include "auvest/runtime/any_interval.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "auvest/runtime/any_recovery.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "auvest/vehicle/integrate.hpp"
#include "auvest/vehicle/remus100.hpp"
#include "simulation/vehicle_sensors.hpp"

namespace auvest {

/// Where the vehicle is to go.
enum class MissionTrack : std::uint8_t {
  kLawnmower,  ///< four lanes of 120 m, 40 m apart, with corners
  kCircle      ///< radius 40 m, clockwise, for 340 s
};

/// Where the position comes from that guidance runs on.
enum class MissionEstimate : std::uint8_t {
  kTruth,      ///< the true state; no sensor has noise
  kFixes,      ///< the last fix, as it is
  kUkf,        ///< UKF of constant acceleration on range and bearing
  kModelAided  ///< EKF of dead reckoning with the current in the state
};

/// What guidance makes of it.
enum class MissionGuidance : std::uint8_t {
  kAdaptive,     ///< AdaptiveLineOfSight
  kCrab,         ///< CrabFeedForward, with the current of the estimate (or the true one)
  kLineOfSight,  ///< LineOfSight
  kIntegral,     ///< IntegralLineOfSight
  kVectorField   ///< VectorField
};

/// What a run is made of, beside seed and number.
struct MissionScenario {
  MissionTrack track = MissionTrack::kLawnmower;
  MissionEstimate estimate = MissionEstimate::kTruth;
  MissionGuidance guidance = MissionGuidance::kAdaptive;

  double period_s = 0.1;
  double speed_m_s = 1.5;  ///< through the water
  double depth_m = 5;
  double current_m_s = 0.3;
  double current_rad = std::numeric_limits<double>::quiet_NaN();  ///< towards; NaN: drawn per run
  double initial_error_m = 1;                                     ///< of the estimate, per axis

  CompassDevice compass;
  GyroDevice gyro;
  DepthDevice depth;
  LogDevice log;
  UsblDevice usbl;
  SensorTiming usbl_timing;  ///< its period is that of `interval`

  AnyInterval<double> interval;  ///< when to ask for the next fix; rounded to the period
  AnyKernel<double> kernel;
  AnyRecovery<double> recovery;
  double acceleration_psd = 3e-4;  ///< of the UKF [m^2/s^5]: a turn at 6 deg/s has so much jerk
  SpeedHeadingCurrent<double>::Params model;

  double lookahead_m = 10;
  double switch_m = 12;
  double end_m = 2;  ///< the lawnmower is over this much before its last waypoint
  double arc_m = 0;  ///< radius of arcs between its legs; 0: corners
  double circle_s = 340;
  double most_s = 1200;          ///< a lawnmower that is not over by then has failed
  double settled_leg_m = 50;     ///< "settled": from so far into a leg
  double settled_circle_s = 60;  ///< and after so long on the circle
};

/// The rows of the closed-loop table.
enum class MissionSource : std::uint8_t {
  kTruth,
  kTruthCrab,
  kFixes,
  kUkf,
  kUkfOutliers,
  kUkfDefaultPsd,
  kAukfLaw,
  kAukfBudget,
  kModelAided,
  kModelAidedCrab,
  kModelAidedOutliers,
  kRobustModelAided,
  kRobustModelAidedOutliers
};
const int kMissionSources = 13;

/// The name of a row.
inline const char* name_of(MissionSource source) {
  static const char* const kNames[kMissionSources] = {"truth",
                                                      "truth_crab",
                                                      "fixes",
                                                      "ukf",
                                                      "ukf_outliers",
                                                      "ukf_default_psd",
                                                      "aukf_law",
                                                      "aukf_budget",
                                                      "model_aided",
                                                      "model_aided_crab",
                                                      "model_aided_outliers",
                                                      "robust_model_aided",
                                                      "robust_model_aided_outliers"};
  return kNames[static_cast<int>(source)];
}

/// The scenario of a row, at this mean interval between fixes where it is fixed.
inline MissionScenario mission_source(MissionSource source, MissionTrack track,
                                      double interval_s = 0.5) {
  using Source = MissionSource;
  MissionScenario s;
  s.track = track;
  s.interval.fixed.params.interval_s = interval_s;
  if (source == Source::kFixes) s.estimate = MissionEstimate::kFixes;
  if (source >= Source::kUkf) s.estimate = MissionEstimate::kUkf;
  if (source >= Source::kModelAided) s.estimate = MissionEstimate::kModelAided;
  if (source == Source::kTruthCrab || source >= Source::kModelAidedCrab) {
    s.guidance = MissionGuidance::kCrab;
  }
  if (source == Source::kUkfOutliers || source == Source::kModelAidedOutliers ||
      source == Source::kRobustModelAidedOutliers) {
    s.usbl.outliers = 0.05;
  }
  if (source == Source::kUkfDefaultPsd) {
    s.acceleration_psd = AccelerationNoise<double>().acceleration;
  }
  const bool lawnmower = track == MissionTrack::kLawnmower;
  if (source == Source::kAukfLaw) {
    s.interval.kind = AnyInterval<double>::Kind::kMahalanobis;
    auto& p = s.interval.mahalanobis.params;
    p.initial_s = 0.5;
    p.min_s = 0.1;
    p.max_s = lawnmower ? 1.18 : 1.105;
  }
  if (source == Source::kAukfBudget) {
    s.interval.kind = AnyInterval<double>::Kind::kCovarianceBudget;
    auto& p = s.interval.budget.params;
    p.initial_s = 0.5;
    p.min_s = 0.1;
    p.max_s = 2;
    p.position_sigma_m = lawnmower ? 1.155 : 1.09;
  }
  if (source >= Source::kRobustModelAided) {
    s.kernel = AnyKernel<double>(Igg<double>());
    s.recovery.enabled = true;
  }
  return s;
}

/// What became of a run.
struct MissionResult {
  Status status = Status::kOk;
  bool finished = false;  ///< the track was flown to its end
  double duration_s = 0;
  double settled_rms_m = 0;        ///< cross-track, beside the active leg
  double all_rms_m = 0;            ///< corners too
  double position_rms_m = 0;       ///< of the estimate
  double interval_s = 0;           ///< mean between fixes
  double rudder_travel_rad_s = 0;  ///< mean |change| of the rudder's command
  std::uint32_t fixes = 0;
  std::uint32_t refused = 0;  ///< fixes that the filter did not take
};

/// One step, after its command.
struct MissionStep {
  const VehicleTruth& truth;
  double current_m_s[2];
  std::uint32_t leg;
  bool settled;
  double cross_m;        ///< of the vehicle
  double estimate_m[2];  ///< position that guidance ran on
  double estimate_current_m_s[2];
  double command[3];     ///< rudder [rad], stern planes [rad], propeller [rev/s]
  double interval_s;     ///< to the next fix
  bool fixed;            ///< a fix was taken in this step
  double nis;            ///< of that fix
  double nees_position;  ///< of the estimate, 2 on average; NaN without a filter
  double nees;           ///< of all states that the truth has: 4 on average; NaN without
};

namespace detail {

/// v' P^-1 v by elimination, P given by its lower triangle.
template <int N>
double mahalanobis_squared(const Vector<double, N>& v, Matrix<double, N, N> p) {
  Vector<double, N> inverse;
  math::mirror_lower(p);
  if (!math::ldlt(p.data(), N, 0.0, inverse.data())) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double sum = 0;
  Vector<double, N> y;
  for (int i = 0; i < N; ++i) {
    y(i) = v(i);
    for (int k = 0; k < i; ++k) y(i) -= p(i, k) * y(k);
    sum += y(i) * y(i) * inverse(i);
  }
  return sum;
}

/// What the loop asks of an estimate, and what one without a filter answers.
template <class Scalar>
struct Navigator {
  Scalar x = Scalar(0), y = Scalar(0);
  Scalar current[2] = {Scalar(0), Scalar(0)};
  double nis = std::numeric_limits<double>::quiet_NaN();

  Status predict(Scalar, const Vector<Scalar, 3>&) { return Status::kOk; }
  Status feedback(const Vector<Scalar, 2>&) { return Status::kOk; }
  void judge(const VehicleTruth&, const double*, double& position, double& all) const {
    position = all = std::numeric_limits<double>::quiet_NaN();
  }
};

/// The last fix, as it is.
template <class Scalar>
struct FixNavigator : Navigator<Scalar> {
  Scalar fixed_interval;

  FixNavigator(const MissionScenario& s, const double* start, double)
      : fixed_interval(Scalar(s.interval.initial())) {
    this->x = Scalar(start[0]);
    this->y = Scalar(start[1]);
  }
  Status check() const { return Status::kOk; }

  Status update(const Vector<Scalar, 2>& z, const UsblDevice& usbl, Scalar) {
    if (!math::all_finite(z)) return Status::kNotFinite;
    Scalar sine, cosine;
    math::sincos(z(1), sine, cosine);
    this->x = Scalar(usbl.station_m[0]) + z(0) * cosine;
    this->y = Scalar(usbl.station_m[1]) + z(0) * sine;
    return Status::kOk;
  }
  Scalar interval() const { return fixed_interval; }
};

/// The policy, kernel and recovery of a scenario in the precision of the vehicle.
template <class Scalar>
AnyInterval<Scalar> interval_as(const AnyInterval<double>& from) {
  AnyInterval<Scalar> to;
  to.kind = static_cast<typename AnyInterval<Scalar>::Kind>(from.kind);
  to.fixed.params.interval_s = Scalar(from.fixed.params.interval_s);
  const auto& law = from.mahalanobis.params;
  typename MahalanobisInterval<Scalar>::Params m;
  m.initial_s = Scalar(law.initial_s);
  m.min_s = Scalar(law.min_s);
  m.max_s = Scalar(law.max_s);
  m.tau0 = Scalar(law.tau0);
  m.scale = Scalar(law.scale);
  m.epsilon = Scalar(law.epsilon);
  m.gamma1_m2 = Scalar(law.gamma1_m2);
  m.gamma2 = Scalar(law.gamma2);
  m.ratio_max = Scalar(law.ratio_max);
  m.tau_min = Scalar(law.tau_min);
  m.tau_max = Scalar(law.tau_max);
  to.mahalanobis = MahalanobisInterval<Scalar>(m);
  const auto& budget = from.budget.params;
  to.budget.params.initial_s = Scalar(budget.initial_s);
  to.budget.params.min_s = Scalar(budget.min_s);
  to.budget.params.max_s = Scalar(budget.max_s);
  to.budget.params.position_sigma_m = Scalar(budget.position_sigma_m);
  return to;
}

template <class Scalar>
RobustUpdate<AnyKernel<Scalar>, AnyRecovery<Scalar>> rule_as(const MissionScenario& s) {
  AnyKernel<Scalar> kernel;
  kernel.kind = static_cast<typename AnyKernel<Scalar>::Kind>(s.kernel.kind);
  kernel.huber.params.k = Scalar(s.kernel.huber.params.k);
  kernel.hampel.params.a = Scalar(s.kernel.hampel.params.a);
  kernel.hampel.params.b = Scalar(s.kernel.hampel.params.b);
  kernel.hampel.params.c = Scalar(s.kernel.hampel.params.c);
  kernel.igg.params.k0 = Scalar(s.kernel.igg.params.k0);
  kernel.igg.params.k1 = Scalar(s.kernel.igg.params.k1);
  AnyRecovery<Scalar> recovery;
  recovery.enabled = s.recovery.enabled;
  recovery.streak.params.rejections = s.recovery.streak.params.rejections;
  return RobustUpdate<AnyKernel<Scalar>, AnyRecovery<Scalar>>(kernel, recovery);
}

template <class Scalar, int N>
RangeBearing<Scalar, N> sonar_as(const UsblDevice& usbl) {
  typename RangeBearing<Scalar, N>::Params p;
  p.station_x_m = Scalar(usbl.station_m[0]);
  p.station_y_m = Scalar(usbl.station_m[1]);
  p.sigma_range_m = Scalar(usbl.noise_m);
  p.sigma_bearing_rad = Scalar(usbl.noise_rad);
  return RangeBearing<Scalar, N>(p);
}

/// A filter of the position, with kernel, recovery and interval policy.
template <class Scalar, class Core, int N>
struct FilterNavigator : Navigator<Scalar> {
  using Plain = Robust<Core, RobustUpdate<AnyKernel<Scalar>, AnyRecovery<Scalar>>>;
  using Filter = AdaptiveInterval<Plain, AnyInterval<Scalar>>;

  Filter filter;
  Status started;

  FilterNavigator(const MissionScenario& s, const Core& core)
      : filter(Plain(core, rule_as<Scalar>(s)), interval_as<Scalar>(s.interval)),
        started(Status::kOk) {}

  void start(const double* x0, const double* deviations) {
    typename Filter::State mean;
    typename Filter::Covariance p;
    math::set_zero(p);
    for (int i = 0; i < N; ++i) {
      mean(i) = Scalar(x0[i]);
      p(i, i) = Scalar(deviations[i] * deviations[i]);
    }
    started = filter.reset(mean, p);
    read();
  }

  Status check() const { return started; }
  Scalar interval() const { return filter.interval(); }
  Status feedback(const Vector<Scalar, 2>& reference) { return filter.feedback(reference); }

  void read() {
    this->x = filter.x()(0);
    this->y = filter.x()(1);
  }

  template <class Report>
  Status report(const Report& correction) {
    this->nis = static_cast<double>(correction.nis);
    read();
    return correction.status;
  }

  /// Against the true position and, by the last two of four numbers, `rates`.
  void judge(const VehicleTruth& truth, const double* rates, double& position, double& all) const {
    Vector<double, 4> error;
    Matrix<double, 4, 4> p;
    Vector<double, 2> place;
    Matrix<double, 2, 2> block;
    for (int i = 0; i < 4; ++i) {
      const double is = i < 2 ? truth.pose[i] : rates[i - 2];
      error(i) = static_cast<double>(filter.belief().x(i)) - is;
      for (int j = 0; j <= i; ++j) p(i, j) = static_cast<double>(filter.belief().P(i, j));
    }
    for (int i = 0; i < 2; ++i) {
      place(i) = error(i);
      for (int j = 0; j <= i; ++j) block(i, j) = p(i, j);
    }
    position = mahalanobis_squared(place, block);
    all = mahalanobis_squared(error, p);
  }
};

template <class Scalar>
struct UkfNavigator : FilterNavigator<Scalar, Ukf<ExactAcceleration<Scalar>>, 6> {
  using Process = ExactAcceleration<Scalar>;
  using Base = FilterNavigator<Scalar, Ukf<Process>, 6>;

  static Process process(const MissionScenario& s) {
    AccelerationNoise<Scalar> noise;
    noise.acceleration = Scalar(s.acceleration_psd);
    return Process(noise);
  }

  UkfNavigator(const MissionScenario& s, const double* start, double heading)
      : Base(s, Ukf<Process>(process(s))) {
    const double x0[6] = {
        start[0], start[1], s.speed_m_s * math::cos(heading), s.speed_m_s * math::sin(heading),
        0,        0};
    const double deviations[6] = {1, 1, 0.5, 0.5, 0.1, 0.1};
    this->start(x0, deviations);
  }

  Status predict(Scalar dt, const Vector<Scalar, 3>&) {
    const Status status = this->filter.predict(dt);
    this->read();
    return status;
  }
  /// A fix is taken when it arrives, however old: this process has no input to do again.
  Status update(const Vector<Scalar, 2>& z, const UsblDevice& usbl, Scalar) {
    return this->report(this->filter.update(z, sonar_as<Scalar, 6>(usbl)));
  }
  /// The truth has position and velocity over ground.
  void judge(const VehicleTruth& truth, const double*, double& position, double& all) const {
    Base::judge(truth, truth.velocity, position, all);
  }
};

template <class Scalar>
struct ModelAidedNavigator : FilterNavigator<Scalar, Ekf<SpeedHeadingCurrent<Scalar>>, 4> {
  using Process = SpeedHeadingCurrent<Scalar>;
  using Base = FilterNavigator<Scalar, Ekf<Process>, 4>;
  using Sonar = RangeBearing<Scalar, 4>;
  using Plain = typename Base::Plain;
  /// Predictions and fixes of the last 6 s.
  using Memory = LateMemory<Plain, Sonar, EventArray<LateEvent<Plain, Sonar>, 64>>;

  bool late;
  Memory memory;

  static Process process(const MissionScenario& s) {
    typename Process::Params p;
    p.position = Scalar(s.model.position);
    p.current = Scalar(s.model.current);
    return Process(p);
  }

  ModelAidedNavigator(const MissionScenario& s, const double* start, double)
      : Base(s, Ekf<Process>(process(s))),
        late(s.usbl.sound_m_s > 0 || s.usbl_timing.latency_s > 0),
        memory(started_filter(start)) {}

  const Plain& started_filter(const double* start) {
    const double x0[4] = {start[0], start[1], 0, 0};
    const double deviations[4] = {1, 1, 0.3, 0.3};
    this->start(x0, deviations);
    return this->filter;
  }

  Status predict(Scalar dt, const Vector<Scalar, 3>& input) {
    const Status status =
        late ? memory.predict(this->filter, dt, input) : this->filter.predict(dt, input);
    read();
    return status;
  }
  Status update(const Vector<Scalar, 2>& z, const UsblDevice& usbl, Scalar age) {
    const Sonar sonar = sonar_as<Scalar, 4>(usbl);
    const Status status = late ? this->report(memory.update(this->filter, z, sonar, age))
                               : this->report(this->filter.update(z, sonar));
    read();
    return status;
  }
  void read() {
    Base::read();
    this->current[0] = this->filter.x()(2);
    this->current[1] = this->filter.x()(3);
  }
  void judge(const VehicleTruth& truth, const double* flow, double& position, double& all) const {
    Base::judge(truth, flow, position, all);
  }
};

/// The guidance law of a scenario.
template <class Scalar>
class MissionLaw {
 public:
  explicit MissionLaw(const MissionScenario& s)
      : kind_(s.guidance),
        adaptive_(with_lookahead<AdaptiveLineOfSight<Scalar>>(s)),
        crab_(with_lookahead<CrabFeedForward<Scalar>>(s)),
        sight_(with_lookahead<LineOfSight<Scalar>>(s)),
        integral_(with_lookahead<IntegralLineOfSight<Scalar>>(s)) {}

  Status update(const PathPoint<Scalar>& point, const Scalar* current, Scalar speed, Scalar dt,
                GuidanceCommand<Scalar>& command) {
    switch (kind_) {
      case MissionGuidance::kCrab: {
        const Status status = crab_.set_current(current[0], current[1]);
        return status == Status::kOk ? crab_.update(point, speed, dt, command) : status;
      }
      case MissionGuidance::kLineOfSight:
        return sight_.update(point, speed, dt, command);
      case MissionGuidance::kIntegral:
        return integral_.update(point, speed, dt, command);
      case MissionGuidance::kVectorField:
        return field_.update(point, speed, dt, command);
      case MissionGuidance::kAdaptive:
        break;
    }
    return adaptive_.update(point, speed, dt, command);
  }

 private:
  template <class Law>
  static Law with_lookahead(const MissionScenario& s) {
    typename Law::Params p;
    p.lookahead_m = Scalar(s.lookahead_m);
    return Law(p);
  }

  MissionGuidance kind_;
  AdaptiveLineOfSight<Scalar> adaptive_;
  CrabFeedForward<Scalar> crab_;
  LineOfSight<Scalar> sight_;
  IntegralLineOfSight<Scalar> integral_;
  VectorField<Scalar> field_;
};

/// The track of a scenario: what guidance asks of it, and where its desired point is.
template <class Scalar>
class MissionPath {
 public:
  static const int kCorners = 8;

  explicit MissionPath(const MissionScenario& s)
      : circle_track_(s.track == MissionTrack::kCircle),
        end_(s.end_m),
        waypoints_(params_of(s)),
        status_(Status::kOk) {
    for (int i = 0; i < kCorners; ++i) {
      corners_[i].x_m = Scalar(corner(i)[0]);
      corners_[i].y_m = Scalar(corner(i)[1]);
    }
    status_ = circle_track_ ? circle_.set(Scalar(80), Scalar(80), Scalar(40))
                            : waypoints_.start(corners_, kCorners);
  }
  MissionPath(const MissionPath&) = delete;
  MissionPath& operator=(const MissionPath&) = delete;

  Status check() const { return status_; }

  Status locate(Scalar x, Scalar y, PathPoint<Scalar>& point) {
    if (!circle_track_) return waypoints_.locate(x, y, point);
    point = circle_.locate(x, y);
    return Status::kOk;
  }
  /// Where the vehicle is beside the active leg, by which the run is judged.
  PathPoint<double> judge(const double* position) const {
    const PathPoint<Scalar> p = circle_track_
                                    ? circle_.locate(Scalar(position[0]), Scalar(position[1]))
                                    : waypoints_.beside(Scalar(position[0]), Scalar(position[1]));
    PathPoint<double> point;
    point.along_m = static_cast<double>(p.along_m);
    point.cross_m = static_cast<double>(p.cross_m);
    return point;
  }

  bool over() const {
    if (circle_track_) return false;
    const bool last = waypoints_.leg() == kCorners - 2 && !waypoints_.on_arc();
    return waypoints_.finished() || (last && static_cast<double>(waypoints_.remaining_m()) < end_);
  }
  std::uint32_t leg() const { return circle_track_ ? 0 : waypoints_.leg(); }

  void start(double (&position)[2], double& heading) const {
    position[0] = circle_track_ ? 120 : corner(0)[0];
    position[1] = circle_track_ ? 80 : corner(0)[1];
    heading = circle_track_ ? math::half_pi<double>() : 0.0;
  }

  /// The desired point, which keeps moving at this speed along the track and beyond its end: a
  /// point that stops would tell the interval law that nothing moves.
  void desired(double travelled, double (&point)[2]) const {
    if (circle_track_) {
      double s, c;
      math::sincos(travelled / 40, s, c);
      point[0] = 80 + 40 * c;
      point[1] = 80 + 40 * s;
      return;
    }
    int i = 0;
    double length = leg_length(0);
    while (travelled > length && i + 2 < kCorners) {
      travelled -= length;
      ++i;
      length = leg_length(i);
    }
    for (int k = 0; k < 2; ++k) {
      point[k] = corner(i)[k] + (corner(i + 1)[k] - corner(i)[k]) * (travelled / length);
    }
  }

 private:
  static const double* corner(int i) {
    static const double kPlan[kCorners][2] = {{20, 20},  {140, 20},  {140, 60},  {20, 60},
                                              {20, 100}, {140, 100}, {140, 140}, {20, 140}};
    return kPlan[i];
  }
  static double leg_length(int i) {
    const double dx = corner(i + 1)[0] - corner(i)[0];
    const double dy = corner(i + 1)[1] - corner(i)[1];
    return math::sqrt(dx * dx + dy * dy);
  }
  static typename Waypoints<Scalar>::Params params_of(const MissionScenario& s) {
    typename Waypoints<Scalar>::Params p;
    p.switch_m = Scalar(s.switch_m);
    p.arc_m = Scalar(s.arc_m);
    return p;
  }

  bool circle_track_;
  double end_;
  Waypoint<Scalar> corners_[kCorners];
  Waypoints<Scalar> waypoints_;
  Circle<Scalar> circle_;
  Status status_;
};

/// A hull in these degrees of freedom, as the sensors see it. What is not free stays where it was.
template <class Freedom>
class MissionHull {
 public:
  using Body = Hull<Torpedo<double>, Freedom>;

  MissionHull(const double* position, double depth, double heading, double speed,
              const double* stream)
      : body_(remus100<double>()) {
    math::set_zero(state_);
    current_(0) = stream[0];
    current_(1) = stream[1];
    current_(2) = 0;
    truth_.pose[0] = position[0];
    truth_.pose[1] = position[1];
    truth_.pose[2] = depth;
    truth_.pose[5] = heading;
    truth_.water[0] = speed;
    constexpr int n = Body::kVelocities;
    for (int i = 0; i < n; ++i) {
      state_(i) = truth_.pose[Freedom::axis(i)];
      state_(n + i) = truth_.water[Freedom::axis(i)];
    }
    state_(2 * n + kPropeller) = 15;  // 900 rpm
    read();
  }

  const VehicleTruth& truth() const { return truth_; }

  Status advance(const double* command, double dt, double time_s) {
    typename Body::Command c;
    for (int i = 0; i < 3; ++i) c(i) = command[i];
    const Status status = auvest::advance<Rk4>(body_, state_, c, current_, dt);
    truth_.time_s = time_s;
    read();
    return status;
  }

 private:
  void read() {
    constexpr int n = Body::kVelocities;
    const typename Body::Velocity over_ground = body_.ground_velocity(state_, current_);
    typename Body::State rates;
    body_.pose_rate(Body::attitude(state_), state_, current_, rates);
    for (int i = 0; i < n; ++i) {
      const int axis = Freedom::axis(i);
      truth_.pose[axis] = state_(i);
      truth_.water[axis] = state_(n + i);
      truth_.ground[axis] = over_ground(i);
      if (axis < 3) truth_.velocity[axis] = rates(i);
    }
  }

  Body body_;
  typename Body::State state_;
  typename Body::Current current_;
  VehicleTruth truth_;
};

/// What a run meets: the current, the hull, its sensors, and how wrong the first estimate is. All
/// is drawn from the run's own streams.
template <class Freedom>
struct MissionWorld {
 private:
  struct Draw {
    double current[2];
    double error[2];

    Draw(const MissionScenario& s, math::Random random) {
      const double drawn = math::two_pi<double>() * random.uniform<double>();
      random.normal_pair(error[0], error[1]);
      const double towards = s.current_rad == s.current_rad ? s.current_rad : drawn;
      current[0] = s.current_m_s * math::cos(towards);
      current[1] = s.current_m_s * math::sin(towards);
    }
  };
  static std::uint64_t stream(std::uint32_t run) { return 16 * static_cast<std::uint64_t>(run); }
  static SensorTiming each(const MissionScenario& s) {
    SensorTiming timing;
    timing.period_s = s.period_s;
    return timing;
  }

  MissionWorld(const MissionScenario& s, const double* start, double heading, std::uint64_t seed,
               std::uint32_t run, const Draw& draw)
      : current_m_s{draw.current[0], draw.current[1]},
        guess_m{start[0] + s.initial_error_m * draw.error[0],
                start[1] + s.initial_error_m * draw.error[1]},
        hull(start, s.depth_m, heading, s.speed_m_s, draw.current),
        compass(s.compass, each(s), math::Random(seed, stream(run) + 1)),
        gyro(s.gyro, each(s), math::Random(seed, stream(run) + 2)),
        depth(s.depth, each(s), math::Random(seed, stream(run) + 3)),
        log(s.log, each(s), math::Random(seed, stream(run) + 4)),
        usbl(s.usbl, s.usbl_timing, math::Random(seed, stream(run) + 5)) {}

 public:
  /// At this place [m] and heading [rad], at the scenario's speed.
  MissionWorld(const MissionScenario& s, const double* start, double heading, std::uint64_t seed,
               std::uint32_t run)
      : MissionWorld(s, start, heading, seed, run, Draw(s, math::Random(seed, stream(run)))) {}

  /// All sensors but USBL, which reads when it is asked, read if their clocks say so.
  void sample() {
    compass.sample(hull.truth());
    gyro.sample(hull.truth());
    depth.sample(hull.truth());
    log.sample(hull.truth());
  }

  const double current_m_s[2];
  const double guess_m[2];  ///< the first estimate of the place
  MissionHull<Freedom> hull;
  VehicleSensor<CompassDevice> compass;
  VehicleSensor<GyroDevice> gyro;
  VehicleSensor<DepthDevice> depth;
  VehicleSensor<LogDevice> log;
  VehicleSensor<UsblDevice> usbl;
};

/// Sum of squares and their number.
struct SquareMean {
  double sum = 0;
  std::uint32_t count = 0;

  void add(double square) {
    sum += square;
    ++count;
  }
  double root() const { return count > 0 ? math::sqrt(sum / count) : 0.0; }
};

template <class Scalar, class Freedom, class Navigator, class Sink>
MissionResult fly_with(const MissionScenario& s, std::uint64_t seed, std::uint32_t run,
                       Sink& sink) {
  MissionResult result;
  MissionPath<Scalar> path(s);
  double start[2];
  double heading = 0;
  path.start(start, heading);
  MissionWorld<Freedom> world(s, start, heading, seed, run);
  MissionHull<Freedom>& hull = world.hull;
  const double(&current)[2] = world.current_m_s;
  const bool exact = s.estimate == MissionEstimate::kTruth;
  double guess[2];
  for (int i = 0; i < 2; ++i) guess[i] = exact ? start[i] : world.guess_m[i];
  Navigator navigator(s, guess, heading);
  MissionLaw<Scalar> law(s);
  HeadingFilter<Scalar> heading_filter;
  Autopilot<Scalar> autopilot;
  const bool blind = s.guidance == MissionGuidance::kCrab &&
                     s.estimate != MissionEstimate::kTruth &&
                     s.estimate != MissionEstimate::kModelAided;
  result.status = !math::is_positive(s.period_s) || blind ? Status::kBadParameter : path.check();
  if (result.status == Status::kOk) result.status = navigator.check();
  if (result.status == Status::kOk) result.status = autopilot.restart(Scalar(heading));
  if (result.status != Status::kOk) return result;

  const Scalar dt = Scalar(s.period_s);
  const Scalar speed = Scalar(s.speed_m_s);
  const auto steps_of = [&](Scalar interval) {
    const double steps = static_cast<double>(interval) / s.period_s + 0.5;
    return steps < 1 ? std::uint32_t(1) : static_cast<std::uint32_t>(steps);
  };
  std::uint32_t asked = 0;
  std::uint32_t next = steps_of(navigator.interval());
  AutopilotReadings<Scalar> now;
  Vector<Scalar, 3> input;
  math::set_zero(input);
  SquareMean settled, all, position;
  double rudder = 0;
  double travel = 0;
  std::uint32_t k = 0;
  for (;; ++k) {
    const VehicleTruth& truth = hull.truth();
    const double most = s.track == MissionTrack::kCircle ? s.circle_s : s.most_s;
    if (truth.time_s >= most - 1e-9) break;

    // The sensors read.
    now.pitch_rad = Scalar(truth.pose[4]);
    if (exact) {
      now.heading_rad = Scalar(math::wrap(truth.pose[5]));
      now.yaw_rate_rad_s = Scalar(truth.ground[5]);
      now.pitch_rate_rad_s = Scalar(truth.ground[4]);
      now.speed_m_s = Scalar(truth.water[0]);
      now.depth_m = Scalar(truth.pose[2]);
    } else {
      world.sample();
      Reading<3> rates;
      while (world.gyro.take(truth.time_s, rates)) {
        now.pitch_rate_rad_s = Scalar(rates.value[1]);
        now.yaw_rate_rad_s = Scalar(rates.value[2]);
      }
      if (k > 0) heading_filter.predict(now.yaw_rate_rad_s, dt);
      Reading<1> number;
      while (world.compass.take(truth.time_s, number)) {
        const Scalar psi = Scalar(number.value[0]);
        if (heading_filter.initialised()) {
          heading_filter.update(psi);
        } else {
          heading_filter.restart(psi);
        }
      }
      now.heading_rad = heading_filter.heading_rad();
      while (world.depth.take(truth.time_s, number)) now.depth_m = Scalar(number.value[0]);
      Reading<2> speeds;
      while (world.log.take(truth.time_s, speeds)) {
        now.speed_m_s = Scalar(speeds.value[0]);
        input(0) = Scalar(speeds.value[0]);
        input(1) = Scalar(speeds.value[1]);
      }
      input(2) = now.heading_rad;
    }

    // Predict and correct.
    bool fixed = false;
    if (exact) {
      navigator.x = Scalar(truth.pose[0]);
      navigator.y = Scalar(truth.pose[1]);
      navigator.current[0] = Scalar(current[0]);
      navigator.current[1] = Scalar(current[1]);
    } else {
      if (k > 0) result.status = navigator.predict(dt, input);
      if (result.status != Status::kOk) return result;
      if (k >= next) {
        world.usbl.ask(truth);
        asked = k;
        next = k + steps_of(navigator.interval());
      }
      Reading<2> fix;
      while (world.usbl.take(truth.time_s, fix)) {
        Vector<Scalar, 2> z;
        z(0) = Scalar(fix.value[0]);
        z(1) = Scalar(fix.value[1]);
        const double age = truth.time_s - fix.valid_s;
        const Status status = navigator.update(z, s.usbl, Scalar(age > 0 ? age : 0));
        if (status != Status::kOk) {
          ++result.refused;
          continue;
        }
        fixed = true;
        ++result.fixes;
        double desired[2];
        path.desired(s.speed_m_s * truth.time_s, desired);
        Vector<Scalar, 2> reference;
        reference(0) = Scalar(desired[0]);
        reference(1) = Scalar(desired[1]);
        result.status = navigator.feedback(reference);
        if (result.status != Status::kOk) return result;
        next = asked + steps_of(navigator.interval());
        if (next <= k) next = k + 1;
      }
    }

    // Guidance and control.
    PathPoint<Scalar> point;
    result.status = path.locate(navigator.x, navigator.y, point);
    if (result.status != Status::kOk) return result;
    if (path.over()) {
      result.finished = true;
      break;
    }
    GuidanceCommand<Scalar> wanted;
    TorpedoCommand<Scalar> out;
    result.status = law.update(point, navigator.current, speed, dt, wanted);
    if (result.status != Status::kOk) return result;
    result.status = autopilot.update(wanted, speed, Scalar(s.depth_m), now, dt, out);
    if (result.status != Status::kOk) return result;

    // The judgement of this step.
    const PathPoint<double> flown = path.judge(truth.pose);
    const bool calm = s.track == MissionTrack::kCircle ? truth.time_s > s.settled_circle_s + 1e-9
                                                       : flown.along_m >= s.settled_leg_m;
    const double square = flown.cross_m * flown.cross_m;
    if (calm) settled.add(square);
    all.add(square);
    const double ex = static_cast<double>(navigator.x) - truth.pose[0];
    const double ey = static_cast<double>(navigator.y) - truth.pose[1];
    position.add(ex * ex + ey * ey);
    const double command[3] = {static_cast<double>(out.rudder_rad),
                               static_cast<double>(out.stern_planes_rad),
                               static_cast<double>(out.propeller_rev_s)};
    travel += math::absolute(command[0] - rudder);
    rudder = command[0];
    MissionStep step = {
        truth,
        {current[0], current[1]},
        path.leg(),
        calm,
        flown.cross_m,
        {static_cast<double>(navigator.x), static_cast<double>(navigator.y)},
        {static_cast<double>(navigator.current[0]), static_cast<double>(navigator.current[1])},
        {command[0], command[1], command[2]},
        static_cast<double>(navigator.interval()),
        fixed,
        fixed ? navigator.nis : std::numeric_limits<double>::quiet_NaN(),
        0,
        0};
    navigator.judge(truth, current, step.nees_position, step.nees);
    sink(static_cast<const MissionStep&>(step));

    result.status = hull.advance(command, s.period_s, (k + 1) * s.period_s);
    if (result.status != Status::kOk) return result;
  }
  result.finished = result.finished || s.track == MissionTrack::kCircle;
  result.duration_s = k * s.period_s;
  result.settled_rms_m = settled.root();
  result.all_rms_m = all.root();
  result.position_rms_m = position.root();
  result.interval_s = result.fixes > 0 ? result.duration_s / result.fixes : 0.0;
  result.rudder_travel_rad_s = k > 0 ? travel / result.duration_s : 0.0;
  return result;
}

}  // namespace detail

/// Flies run number `run` of a scenario in these degrees of freedom and hands every step to
/// `sink(step)`. The same seed and run give the same current, compass, noise and initial error
/// whatever the scenario. The result's status is kOk, or the first that is not: the run ends there.
template <class Scalar, class Freedom = SixDof, class Sink>
MissionResult fly_mission(const MissionScenario& scenario, std::uint64_t seed, std::uint32_t run,
                          Sink&& sink) {
  switch (scenario.estimate) {
    case MissionEstimate::kUkf:
      return detail::fly_with<Scalar, Freedom, detail::UkfNavigator<Scalar>>(scenario, seed, run,
                                                                             sink);
    case MissionEstimate::kModelAided:
      return detail::fly_with<Scalar, Freedom, detail::ModelAidedNavigator<Scalar>>(scenario, seed,
                                                                                    run, sink);
    case MissionEstimate::kTruth:
    case MissionEstimate::kFixes:
      break;
  }
  return detail::fly_with<Scalar, Freedom, detail::FixNavigator<Scalar>>(scenario, seed, run, sink);
}

/// The same without a look at the steps.
template <class Scalar, class Freedom = SixDof>
MissionResult fly_mission(const MissionScenario& scenario, std::uint64_t seed, std::uint32_t run) {
  return fly_mission<Scalar, Freedom>(scenario, seed, run, [](const MissionStep&) {});
}

}  // namespace auvest
