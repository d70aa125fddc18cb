// The closed loop of a vehicle: sensors, estimate, guidance, control, actuators, hull, in turn.
//
// Order within a step, 10 times a second: the sensors read; the estimate is predicted and what has
// arrived corrects it; guidance switches the leg and says what to steer; control commands the
// actuators; the command is held while the hull moves on. Between fixes guidance runs on the
// predicted estimate.
//
// The vehicle's own part (estimate, guidance, control) is computed in `Scalar`; hull, sensors and
// the judgement of the run are in double, on the desk.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>

#include "auvest/control/autopilot.hpp"
#include "auvest/control/heading_filter.hpp"
#include "auvest/guidance/guidance_law.hpp"
#include "auvest/guidance/path_point.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "auvest/vehicle/integrate.hpp"
#include "auvest/vehicle/remus100.hpp"
#include "simulation/mission_navigators.hpp"
#include "simulation/mission_scenario.hpp"
#include "simulation/mission_track.hpp"
#include "simulation/vehicle_sensors.hpp"

namespace auvest {

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

/// What the sensors told the vehicle in a step; NaN: nothing, and without noise all of it.
struct MissionReadings {
  double compass_rad = std::numeric_limits<double>::quiet_NaN();
  double pitch_rate_rad_s = std::numeric_limits<double>::quiet_NaN();
  double yaw_rate_rad_s = std::numeric_limits<double>::quiet_NaN();
  double depth_m = std::numeric_limits<double>::quiet_NaN();
  double log_m_s[2] = {std::numeric_limits<double>::quiet_NaN(),
                       std::numeric_limits<double>::quiet_NaN()};
  double pitch_rad = std::numeric_limits<double>::quiet_NaN();  ///< as it is
  double fix[2] = {std::numeric_limits<double>::quiet_NaN(),    ///< range [m], bearing [rad]
                   std::numeric_limits<double>::quiet_NaN()};
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
  const MissionReadings& readings;
};

/// Who looks at every step; it may be empty.
using MissionSink = std::function<void(const MissionStep&)>;

namespace mission_detail {

/// A hull as the sensors see it. The loop does not know its degrees of freedom: it is long, and
/// would be compiled for each.
class MissionHull {
 public:
  virtual ~MissionHull() = default;

  const VehicleTruth& truth() const { return truth_; }
  virtual void set_current(const double* stream) = 0;
  virtual Status advance(const double* command, double dt, double time_s) = 0;

 protected:
  VehicleTruth truth_;
};

/// In these degrees of freedom. What is not free stays where it was.
template <class Freedom>
class MissionHullIn final : public MissionHull {
 public:
  using Body = Hull<Torpedo<double>, Freedom>;

  MissionHullIn(const double* position, double depth, double heading, double speed,
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

  void set_current(const double* stream) override {
    current_(0) = stream[0];
    current_(1) = stream[1];
  }

  Status advance(const double* command, double dt, double time_s) override {
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
};

/// Makes a hull at a place [m], a depth [m], a heading [rad] and a speed [m/s], in a current [m/s].
using MissionLaunch = std::unique_ptr<MissionHull> (*)(const double* position, double depth,
                                                       double heading, double speed,
                                                       const double* stream);

template <class Freedom>
std::unique_ptr<MissionHull> launch_hull(const double* position, double depth, double heading,
                                         double speed, const double* stream) {
  return std::unique_ptr<MissionHull>(
      new MissionHullIn<Freedom>(position, depth, heading, speed, stream));
}

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

/// The current of a run: constant, or a random walk.
class MissionCurrent {
 public:
  MissionCurrent(const MissionScenario& s, double drawn_rad, const math::Random& random)
      : random_(random), step_(math::sqrt(s.current_walk * s.period_s)) {
    if (step_ > 0) {
      random_.normal_pair(value[0], value[1]);
      for (double& component : value) component *= s.current_sigma_m_s;
      return;
    }
    const double towards = s.current_rad == s.current_rad ? s.current_rad : drawn_rad;
    value[0] = s.current_m_s * math::cos(towards);
    value[1] = s.current_m_s * math::sin(towards);
  }

  double value[2];  ///< north, east [m/s]

  void advance() {
    if (!(step_ > 0)) return;
    double push[2];
    random_.normal_pair(push[0], push[1]);
    for (int i = 0; i < 2; ++i) value[i] += step_ * push[i];
  }

 private:
  math::Random random_;
  double step_;
};

/// What a run meets: the current, the hull, its sensors, and how wrong the first estimate is. All
/// is drawn from the run's own streams.
class MissionWorld {
  struct Draw {
    double towards_rad;
    double error[2];

    explicit Draw(math::Random random) {
      towards_rad = math::two_pi<double>() * random.uniform<double>();
      random.normal_pair(error[0], error[1]);
    }
  };
  static std::uint64_t stream(std::uint32_t run) { return 16 * static_cast<std::uint64_t>(run); }
  static SensorTiming each(const MissionScenario& s) {
    SensorTiming timing;
    timing.period_s = s.period_s;
    return timing;
  }

  MissionWorld(const MissionScenario& s, MissionLaunch launch, const double* start, double heading,
               std::uint64_t seed, std::uint32_t run, const Draw& draw)
      : current(s, draw.towards_rad, math::Random(seed, stream(run) + 6)),
        guess_m{start[0] + s.initial_error_m * draw.error[0],
                start[1] + s.initial_error_m * draw.error[1]},
        compass(s.compass, each(s), math::Random(seed, stream(run) + 1)),
        gyro(s.gyro, each(s), math::Random(seed, stream(run) + 2)),
        depth(s.depth, each(s), math::Random(seed, stream(run) + 3)),
        log(s.log, each(s), math::Random(seed, stream(run) + 4)),
        usbl(s.usbl, s.usbl_timing, math::Random(seed, stream(run) + 5)),
        hull_(launch(start, s.depth_m, heading, s.speed_m_s, current.value)) {}

 public:
  /// At this place [m] and heading [rad], at the scenario's speed.
  MissionWorld(const MissionScenario& s, MissionLaunch launch, const double* start, double heading,
               std::uint64_t seed, std::uint32_t run)
      : MissionWorld(s, launch, start, heading, seed, run, Draw(math::Random(seed, stream(run)))) {}

  const VehicleTruth& truth() const { return hull_->truth(); }

  /// All sensors but USBL, which reads when it is asked, read if their clocks say so.
  void sample() {
    compass.sample(truth());
    gyro.sample(truth());
    depth.sample(truth());
    log.sample(truth());
  }

  /// The command is held for dt seconds, until time_s.
  Status advance(const double* command, double dt, double time_s) {
    current.advance();
    hull_->set_current(current.value);
    return hull_->advance(command, dt, time_s);
  }

  MissionCurrent current;
  const double guess_m[2];  ///< the first estimate of the place
  VehicleSensor<CompassDevice> compass;
  VehicleSensor<GyroDevice> gyro;
  VehicleSensor<DepthDevice> depth;
  VehicleSensor<LogDevice> log;
  VehicleSensor<UsblDevice> usbl;

 private:
  std::unique_ptr<MissionHull> hull_;
};

/// What the vehicle makes of its sensors: the readings of its controllers, and what drives the
/// model-aided filter.
template <class Scalar>
class MissionSensors {
 public:
  AutopilotReadings<Scalar> now;
  Vector<Scalar, 3> input;  ///< speed ahead and to starboard through the water, heading
  MissionReadings told;     ///< in this step

  MissionSensors() { math::set_zero(input); }

  /// The truth, as it is.
  void take(const VehicleTruth& truth) {
    told = MissionReadings();
    told.pitch_rad = truth.pose[4];
    now.heading_rad = Scalar(math::wrap(truth.pose[5]));
    now.yaw_rate_rad_s = Scalar(truth.ground[5]);
    now.pitch_rad = Scalar(truth.pose[4]);
    now.pitch_rate_rad_s = Scalar(truth.ground[4]);
    now.speed_m_s = Scalar(truth.water[0]);
    now.depth_m = Scalar(truth.pose[2]);
  }

  /// What the sensors of the world say of it, dt seconds after the last time.
  void read(MissionWorld& world, Scalar dt) {
    const VehicleTruth& truth = world.truth();
    told = MissionReadings();
    told.pitch_rad = truth.pose[4];
    world.sample();
    now.pitch_rad = Scalar(truth.pose[4]);
    Reading<3> rates;
    while (world.gyro.take(truth.time_s, rates)) {
      told.pitch_rate_rad_s = rates.value[1];
      told.yaw_rate_rad_s = rates.value[2];
      now.pitch_rate_rad_s = Scalar(rates.value[1]);
      now.yaw_rate_rad_s = Scalar(rates.value[2]);
    }
    heading_.predict(now.yaw_rate_rad_s, dt);
    Reading<1> number;
    while (world.compass.take(truth.time_s, number)) {
      told.compass_rad = number.value[0];
      const Scalar psi = Scalar(number.value[0]);
      if (heading_.initialised()) {
        heading_.update(psi);
      } else {
        heading_.restart(psi);
      }
    }
    now.heading_rad = heading_.heading_rad();
    while (world.depth.take(truth.time_s, number)) {
      told.depth_m = number.value[0];
      now.depth_m = Scalar(number.value[0]);
    }
    Reading<2> speeds;
    while (world.log.take(truth.time_s, speeds)) {
      for (int i = 0; i < 2; ++i) told.log_m_s[i] = speeds.value[i];
      now.speed_m_s = Scalar(speeds.value[0]);
      input(0) = Scalar(speeds.value[0]);
      input(1) = Scalar(speeds.value[1]);
    }
    input(2) = now.heading_rad;
  }

 private:
  HeadingFilter<Scalar> heading_;
};

/// What is summed up over a run.
class MissionTally {
 public:
  void add(bool settled, double cross_m, double position_error_squared, double rudder_rad) {
    if (settled) settled_.add(cross_m * cross_m);
    all_.add(cross_m * cross_m);
    position_.add(position_error_squared);
    travel_ += math::absolute(rudder_rad - rudder_);
    rudder_ = rudder_rad;
  }

  void report(double duration_s, MissionResult& result) const {
    result.duration_s = duration_s;
    result.settled_rms_m = settled_.root();
    result.all_rms_m = all_.root();
    result.position_rms_m = position_.root();
    result.interval_s = result.fixes > 0 ? duration_s / result.fixes : 0.0;
    result.rudder_travel_rad_s = duration_s > 0 ? travel_ / duration_s : 0.0;
  }

 private:
  SquareMean settled_, all_, position_;
  double rudder_ = 0;
  double travel_ = 0;
};

template <class Scalar, class Navigator>
MissionResult fly_with(const MissionScenario& s, MissionLaunch launch, std::uint64_t seed,
                       std::uint32_t run, const MissionSink& sink) {
  MissionResult result;
  MissionPath<Scalar> path(s);
  double start[2];
  double heading = 0;
  path.start(start, heading);
  MissionWorld world(s, launch, start, heading, seed, run);
  const double* const current = world.current.value;
  MissionSensors<Scalar> sensors;
  const bool exact = s.estimate == MissionEstimate::kTruth;
  double guess[2];
  for (int i = 0; i < 2; ++i) guess[i] = exact ? start[i] : world.guess_m[i];
  Navigator navigator(s, guess, heading);
  MissionLaw<Scalar> law(s);
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
  MissionTally tally;
  std::uint32_t k = 0;
  for (;; ++k) {
    const VehicleTruth& truth = world.truth();
    const double most = s.track == MissionTrack::kCircle ? s.circle_s : s.most_s;
    if (truth.time_s >= most - 1e-9) break;

    // The sensors read.
    if (exact) {
      sensors.take(truth);
    } else {
      sensors.read(world, dt);
    }

    // Predict and correct.
    bool fixed = false;
    if (exact) {
      navigator.x = Scalar(truth.pose[0]);
      navigator.y = Scalar(truth.pose[1]);
      navigator.current[0] = Scalar(current[0]);
      navigator.current[1] = Scalar(current[1]);
    } else {
      if (k > 0) result.status = navigator.predict(dt, sensors.input);
      if (result.status != Status::kOk) return result;
      if (k >= next) {
        world.usbl.ask(truth);
        asked = k;
        next = k + steps_of(navigator.interval());
      }
      Reading<2> fix;
      while (world.usbl.take(truth.time_s, fix)) {
        for (int i = 0; i < 2; ++i) sensors.told.fix[i] = fix.value[i];
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
    result.status = autopilot.update(wanted, speed, Scalar(s.depth_m), sensors.now, dt, out);
    if (result.status != Status::kOk) return result;

    // The judgement of this step.
    const PathPoint<double> flown = path.judge(truth.pose);
    const bool calm =
        path.smooth() ? truth.time_s > s.settled_circle_s + 1e-9 : flown.along_m >= s.settled_leg_m;
    const double ex = static_cast<double>(navigator.x) - truth.pose[0];
    const double ey = static_cast<double>(navigator.y) - truth.pose[1];
    const double command[3] = {static_cast<double>(out.rudder_rad),
                               static_cast<double>(out.stern_planes_rad),
                               static_cast<double>(out.propeller_rev_s)};
    tally.add(calm, flown.cross_m, ex * ex + ey * ey, command[0]);
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
        0,
        sensors.told};
    navigator.judge(truth, current, step.nees_position, step.nees);
    if (sink) sink(step);

    result.status = world.advance(command, s.period_s, (k + 1) * s.period_s);
    if (result.status != Status::kOk) return result;
  }
  result.finished = result.finished || s.track == MissionTrack::kCircle;
  tally.report(k * s.period_s, result);
  return result;
}

}  // namespace mission_detail

/// Flies run number `run` of a scenario in these degrees of freedom and hands every step to
/// `sink(step)`. The same seed and run give the same current, compass, noise and initial error
/// whatever the scenario. The result's status is kOk, or the first that is not: the run ends there.
template <class Scalar, class Freedom = SixDof>
MissionResult fly_mission(const MissionScenario& scenario, std::uint64_t seed, std::uint32_t run,
                          const MissionSink& sink = nullptr) {
  const mission_detail::MissionLaunch launch = &mission_detail::launch_hull<Freedom>;
  switch (scenario.estimate) {
    case MissionEstimate::kUkf:
      return mission_detail::fly_with<Scalar, mission_detail::UkfNavigator<Scalar>>(
          scenario, launch, seed, run, sink);
    case MissionEstimate::kModelAided:
      return mission_detail::fly_with<Scalar, mission_detail::ModelAidedNavigator<Scalar>>(
          scenario, launch, seed, run, sink);
    case MissionEstimate::kTruth:
    case MissionEstimate::kFixes:
      break;
  }
  return mission_detail::fly_with<Scalar, mission_detail::FixNavigator<Scalar>>(scenario, launch,
                                                                                seed, run, sink);
}

}  // namespace auvest
