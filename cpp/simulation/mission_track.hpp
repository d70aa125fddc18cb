// Where a mission goes, and the law that takes it there.
#pragma once

#include <cstdint>

#include "auvest/guidance/adaptive_line_of_sight.hpp"
#include "auvest/guidance/circle.hpp"
#include "auvest/guidance/crab_feed_forward.hpp"
#include "auvest/guidance/integral_line_of_sight.hpp"
#include "auvest/guidance/line_of_sight.hpp"
#include "auvest/guidance/vector_field.hpp"
#include "auvest/guidance/waypoints.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"
#include "simulation/mission_scenario.hpp"

namespace auvest {
namespace detail {

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

}  // namespace detail
}  // namespace auvest
