// Replays a record of a vehicle and writes the trace: another program that `main` may be built
// around (see replay.hpp), with the same streams. firmware/parity/vehicle.py writes records and
// names the fields of a trace.
//
//     kMission   what the sensors of a mission told, step by step: heading filter, model-aided
//                filter, guidance and autopilot answer
//     kHull      commands of a torpedo: its hull moves, in six degrees of freedom or in the plane
//     kRov       poses wanted of an ROV: controller, allocation, thrust curve and hull in a loop
//     kPilot     what the sensors of a mission told, some of them silent, wrong or late: the pilot
//
//     record: kind, then
//       kMission  law, path, arc and speed, depth, period, kernel and rejections, x0, steps;
//                 per step: compass, pitch rate, yaw rate, depth, log, sway log, pitch, range,
//                 bearing; NaN where nothing was told
//       kHull     degrees of freedom, method, h, current, x0, steps; per step: command
//       kRov      h, current, steps; per step: pose
//       kPilot    place and heading at the start, steps; per step: what was heard, heading, pitch,
//                 pitch rate, yaw rate, log, sway log, depth, range, bearing and age of a fix; NaN:
//                 there is none
#pragma once

#include "auvest/control/autopilot.hpp"
#include "auvest/control/heading_filter.hpp"
#include "auvest/control/pose_control.hpp"
#include "auvest/filters/ekf.hpp"
#include "auvest/filters/robust.hpp"
#include "auvest/guidance/adaptive_line_of_sight.hpp"
#include "auvest/guidance/circle.hpp"
#include "auvest/guidance/crab_feed_forward.hpp"
#include "auvest/guidance/integral_line_of_sight.hpp"
#include "auvest/guidance/line_of_sight.hpp"
#include "auvest/guidance/vector_field.hpp"
#include "auvest/guidance/waypoints.hpp"
#include "auvest/math/bits.hpp"
#include "auvest/mission/pilot.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/speed_heading_current.hpp"
#include "auvest/robust/robust_update.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "auvest/runtime/any_recovery.hpp"
#include "auvest/vehicle/allocation.hpp"
#include "auvest/vehicle/bluerov2_heavy.hpp"
#include "auvest/vehicle/integrate.hpp"
#include "auvest/vehicle/remus100.hpp"

namespace auvest {
namespace parity {

enum Kind : std::uint32_t { kMission, kHull, kRov, kPilot };

/// The words of a stream as numbers.
template <class Stream>
class Numbers {
 public:
  explicit Numbers(Stream& stream) : stream_(stream) {}

  std::uint32_t word() { return stream_.read(); }
  float number() { return math::from_bits(stream_.read()); }
  template <int Size>
  void read(Matrix<float, Size, 1>& vector) {
    for (int i = 0; i < Size; ++i) vector(i) = number();
  }

  void write(std::uint32_t word) { stream_.write(word); }
  void write(Status status) { stream_.write(static_cast<std::uint32_t>(status)); }
  void write(float value) { stream_.write(math::to_bits(value)); }
  template <int Size>
  void write(const Matrix<float, Size, 1>& vector) {
    for (int i = 0; i < Size; ++i) write(vector(i));
  }

 private:
  Stream& stream_;
};

/// The vehicle's own part of a mission, in the order of simulation/mission.hpp.
template <class Stream>
class MissionReplay {
 public:
  explicit MissionReplay(Numbers<Stream>& numbers) : numbers_(numbers), filter_(Plain(Process())) {}

  AUVEST_OUTLINE void run() {
    law_ = numbers_.word();
    circling_ = numbers_.word() == kCircle;
    typename Waypoints<float>::Params plan;
    plan.switch_m = 12.0f;
    plan.arc_m = numbers_.number();
    speed_ = numbers_.number();
    depth_ = numbers_.number();
    dt_ = numbers_.number();
    start_filter();
    waypoints_ = Waypoints<float>(plan);
    numbers_.write(circling_ ? circle_.set(80.0f, 80.0f, 40.0f) : waypoints_.start(corners(), 8));
    const float heading = circling_ ? math::half_pi<float>() : 0.0f;
    numbers_.write(autopilot_.restart(heading));
    const std::uint32_t steps = numbers_.word();
    for (std::uint32_t k = 0; k < steps; ++k) step(k > 0);
  }

 private:
  enum Path : std::uint32_t { kLawnmower, kCircle };
  enum Law : std::uint32_t { kAdaptive, kCrab, kLineOfSight, kIntegral, kVectorField };

  using Process = SpeedHeadingCurrent<float>;
  using Plain = Ekf<Process>;
  using Rule = RobustUpdate<AnyKernel<float>, AnyRecovery<float>>;
  using Filter = Robust<Plain, Rule>;
  using Sensor = RangeBearing<float, 4>;

  static const Waypoint<float>* corners() {
    static const Waypoint<float> kPlan[8] = {{20, 20},  {140, 20},  {140, 60},  {20, 60},
                                             {20, 100}, {140, 100}, {140, 140}, {20, 140}};
    return kPlan;
  }

  AUVEST_OUTLINE void start_filter() {
    Rule rule;
    rule.kernel.kind = static_cast<AnyKernel<float>::Kind>(numbers_.word());
    const std::uint32_t rejections = numbers_.word();
    rule.recovery.enabled = rejections > 0;
    if (rejections > 0) {
      rule.recovery.streak.params.rejections = static_cast<std::uint8_t>(rejections);
    }
    filter_ = Filter(Plain(Process()), rule);
    typename Sensor::Params sonar;
    sonar.station_x_m = sonar.station_y_m = 0.0f;
    sonar.sigma_range_m = 0.3f;
    sonar.sigma_bearing_rad = 0.017453292f;
    sensor_ = Sensor(sonar);
    typename Filter::State x0;
    typename Filter::Covariance p0;
    numbers_.read(x0);
    math::set_zero(p0);
    for (int i = 0; i < 4; ++i) p0(i, i) = i < 2 ? 1.0f : 0.09f;
    numbers_.write(filter_.reset(x0, p0));
  }

  AUVEST_OUTLINE void step(bool moved) {
    const float compass = numbers_.number();
    AutopilotReadings<float> now;
    now.pitch_rate_rad_s = numbers_.number();
    now.yaw_rate_rad_s = numbers_.number();
    now.depth_m = numbers_.number();
    Vector<float, 3> input;
    input(0) = numbers_.number();
    input(1) = numbers_.number();
    now.speed_m_s = input(0);
    now.pitch_rad = numbers_.number();
    Vector<float, 2> fix;
    numbers_.read(fix);

    Status status = Status::kOk;
    if (moved) note(status, heading_.predict(now.yaw_rate_rad_s, dt_));
    if (!math::is_nan(compass)) {
      note(status, heading_.initialised() ? heading_.update(compass) : heading_.restart(compass));
    }
    now.heading_rad = input(2) = heading_.heading_rad();
    if (moved) note(status, filter_.predict(dt_, input));
    write_filter(fix, status);

    PathPoint<float> point;
    note(status, locate(point));
    GuidanceCommand<float> wanted;
    note(status, steer(point, wanted));
    TorpedoCommand<float> out;
    note(status, autopilot_.update(wanted, speed_, depth_, now, dt_, out));

    numbers_.write(heading_.heading_rad());
    numbers_.write(point.along_m);
    numbers_.write(point.cross_m);
    numbers_.write(point.direction_rad);
    numbers_.write(wanted.heading_rad);
    numbers_.write(wanted.rate_rad_s);
    numbers_.write(autopilot_.reference().heading_rad());
    numbers_.write(out.rudder_rad);
    numbers_.write(out.stern_planes_rad);
    numbers_.write(out.propeller_rev_s);
    numbers_.write(autopilot_.heading().integral());
    numbers_.write(autopilot_.depth().integral());
    numbers_.write(static_cast<std::uint32_t>(status) |
                   static_cast<std::uint32_t>(waypoints_.leg()) << 8 |
                   static_cast<std::uint32_t>(waypoints_.on_arc()) << 16);
  }

  /// Of several statuses the first that is not kOk is told.
  static void note(Status& first, Status status) {
    if (first == Status::kOk) first = status;
  }

  /// Takes a fix, if there is one, and shows the filter.
  AUVEST_OUTLINE void write_filter(const Vector<float, 2>& fix, Status& status) {
    float nis = math::quiet_nan();
    float weight = math::quiet_nan();
    if (!math::is_nan(fix(0))) {
      const RobustCorrection<float, 2> u = filter_.update(fix, sensor_);
      note(status, u.status);
      nis = u.nis;
      weight = u.weight(0);
    }
    numbers_.write(filter_.x());
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j <= i; ++j) numbers_.write(filter_.belief().P(i, j));
    }
    numbers_.write(nis);
    numbers_.write(weight);
  }

  Status locate(PathPoint<float>& point) {
    if (!circling_) return waypoints_.locate(filter_.x()(0), filter_.x()(1), point);
    point = circle_.locate(filter_.x()(0), filter_.x()(1));
    return Status::kOk;
  }

  Status steer(const PathPoint<float>& point, GuidanceCommand<float>& wanted) {
    switch (law_) {
      case kCrab:
        crab_.set_current(filter_.x()(2), filter_.x()(3));
        return crab_.update(point, speed_, dt_, wanted);
      case kLineOfSight:
        return line_of_sight_.update(point, speed_, dt_, wanted);
      case kIntegral:
        return integral_.update(point, speed_, dt_, wanted);
      case kVectorField:
        return vector_field_.update(point, speed_, dt_, wanted);
      default:
        return adaptive_.update(point, speed_, dt_, wanted);
    }
  }

  Numbers<Stream>& numbers_;
  std::uint32_t law_ = kAdaptive;
  bool circling_ = false;
  float speed_ = 0.0f, depth_ = 0.0f, dt_ = 0.0f;
  HeadingFilter<float> heading_;
  Filter filter_;
  Sensor sensor_;
  Waypoints<float> waypoints_;
  Circle<float> circle_;
  AdaptiveLineOfSight<float> adaptive_;
  CrabFeedForward<float> crab_;
  LineOfSight<float> line_of_sight_;
  IntegralLineOfSight<float> integral_;
  VectorField<float> vector_field_;
  Autopilot<float> autopilot_;
};

template <class Freedom, class Method, class Stream>
AUVEST_OUTLINE void replay_hull(Numbers<Stream>& numbers) {
  using Body = Hull<Torpedo<float>, Freedom>;
  const Body hull(remus100<float>());
  const float h = numbers.number();
  typename Body::Current current;
  typename Body::State x;
  typename Body::Command command;
  numbers.read(current);
  numbers.read(x);
  numbers.write(hull.check());
  const std::uint32_t steps = numbers.word();
  for (std::uint32_t k = 0; k < steps; ++k) {
    numbers.read(command);
    const Status status = advance<Method>(hull, x, command, current, h);
    numbers.write(x);
    numbers.write(status);
  }
}

template <class Stream>
AUVEST_OUTLINE void replay_hull_record(Numbers<Stream>& numbers) {
  enum Method : std::uint32_t { kRk4, kSemiImplicit };
  const bool plane = numbers.word() == 3;
  const bool rk4 = numbers.word() == kRk4;
  if (plane && rk4) replay_hull<ThreeDof, Rk4>(numbers);
  if (plane && !rk4) replay_hull<ThreeDof, SemiImplicit>(numbers);
  if (!plane && rk4) replay_hull<SixDof, Rk4>(numbers);
  if (!plane && !rk4) replay_hull<SixDof, SemiImplicit>(numbers);
}

template <class Stream>
AUVEST_OUTLINE void replay_rov(Numbers<Stream>& numbers) {
  using Body = Hull<Rov<float, 8>>;
  const Body hull(bluerov2_heavy<float>());
  const auto& thrusters = hull.vehicle().thrusters;
  const auto allocation = allocation_of(thrusters);
  PoseControl<float> control;
  const float h = numbers.number();
  Body::Current current;
  numbers.read(current);
  numbers.write(hull.check());
  numbers.write(allocation.check());
  Body::State x = hull.at_rest(current);
  bool saturated = false;
  const std::uint32_t steps = numbers.word();
  for (std::uint32_t k = 0; k < steps; ++k) {
    Vector<float, 6> wanted, pose, restoring, demand;
    numbers.read(wanted);
    for (int i = 0; i < 6; ++i) pose(i) = x(i);
    const auto ground = hull.ground_velocity(x, current);
    math::set_zero(restoring);
    math::set_zero(demand);
    Status status = control.update(wanted, pose, ground, restoring, saturated, h, demand);
    const auto given = allocation.allocate(demand);
    saturated = given.saturated;
    Body::Command command;
    for (int i = 0; i < 8; ++i) command(i) = thrusters.curve.input(given.thrust(i));
    if (status == Status::kOk) status = advance<Rk4>(hull, x, command, current, h);
    numbers.write(demand);
    numbers.write(given.thrust);
    for (int i = 0; i < 3; ++i) numbers.write(given.scale[i]);
    numbers.write(command);
    numbers.write(x);
    numbers.write(static_cast<std::uint32_t>(status) | (saturated ? 256u : 0u));
  }
}

/// The pilot as the sketch `mission` has it, on the first three legs of its plan.
template <class Stream>
AUVEST_OUTLINE void replay_pilot(Numbers<Stream>& numbers) {
  static const Waypoint<float> kPlan[4] = {{20, 20}, {140, 20}, {140, 60}, {20, 60}};
  using Chip = Pilot<float>;
  typename Chip::Params params;
  params.sonar.station_x_m = params.sonar.station_y_m = 0.0f;
  params.sonar.sigma_range_m = 0.3f;
  params.sonar.sigma_bearing_rad = 0.017453292f;
  params.waypoints.switch_m = 12.0f;
  Chip pilot(params);
  const float x = numbers.number();
  const float y = numbers.number();
  numbers.write(pilot.start(kPlan, 4, x, y, numbers.number()));
  const std::uint32_t steps = numbers.word();
  for (std::uint32_t k = 0; k < steps; ++k) {
    typename Chip::Readings now;
    now.heard = static_cast<std::uint8_t>(numbers.word());
    now.heading_rad = numbers.number();
    now.pitch_rad = numbers.number();
    now.pitch_rate_rad_s = numbers.number();
    now.yaw_rate_rad_s = numbers.number();
    now.speed_m_s = numbers.number();
    now.sway_m_s = numbers.number();
    now.depth_m = numbers.number();
    Vector<float, 2> fix;
    numbers.read(fix);
    const float age = numbers.number();

    const Status predicted = pilot.predict(now, 0.1f);
    const bool asks = pilot.wants_fix();
    if (asks) pilot.asked();
    Status corrected = Status::kOk;
    float nis = math::quiet_nan();
    if (!math::is_nan(age)) {
      const typename Chip::Report report = pilot.update(fix, age);
      corrected = report.status;
      if (corrected == Status::kOk) nis = report.nis;
    }
    TorpedoCommand<float> command;
    const Status steered = pilot.steer(command);

    numbers.write(pilot.filter().x());
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j <= i; ++j) numbers.write(pilot.filter().belief().P(i, j));
    }
    numbers.write(nis);
    numbers.write(pilot.heading_rad());
    numbers.write(pilot.cross_track_m());
    numbers.write(command.rudder_rad);
    numbers.write(command.stern_planes_rad);
    numbers.write(command.propeller_rev_s);
    numbers.write(
        static_cast<std::uint32_t>(predicted) | static_cast<std::uint32_t>(corrected) << 8 |
        static_cast<std::uint32_t>(steered) << 16 | static_cast<std::uint32_t>(pilot.mode()) << 24);
    numbers.write(static_cast<std::uint32_t>(pilot.path().leg()) | (asks ? 256u : 0u) |
                  pilot.implausible() << 16);
  }
}

/// Reads one record from the stream and writes its trace.
template <class Stream>
void replay(Stream& stream) {
  Numbers<Stream> numbers(stream);
  const std::uint32_t kind = numbers.word();
  if (kind == kMission) MissionReplay<Stream>(numbers).run();
  if (kind == kHull) replay_hull_record(numbers);
  if (kind == kRov) replay_rov(numbers);
  if (kind == kPilot) replay_pilot(numbers);
}

}  // namespace parity
}  // namespace auvest
