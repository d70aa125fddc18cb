// Where a mission goes, and the law that takes it there.
#pragma once

#include <cstdint>

#include "auvest/guidance/adaptive_line_of_sight.hpp"
#include "auvest/guidance/circle.hpp"
#include "auvest/guidance/crab_feed_forward.hpp"
#include "auvest/guidance/dubins_path.hpp"
#include "auvest/guidance/integral_line_of_sight.hpp"
#include "auvest/guidance/line_of_sight.hpp"
#include "auvest/guidance/spline_path.hpp"
#include "auvest/guidance/vector_field.hpp"
#include "auvest/guidance/waypoints.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"
#include "simulation/mission_scenario.hpp"

namespace auvest {
namespace mission_detail {

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

/// Corners of the lawnmower: north, east [m].
const int kMissionCorners = 8;
inline const double* mission_corner(int i) {
  static const double kPlan[kMissionCorners][2] = {{20, 20},  {140, 20},  {140, 60},  {20, 60},
                                                   {20, 100}, {140, 100}, {140, 140}, {20, 140}};
  return kPlan[i];
}

/// The lawnmower as curves that a hull can turn: lanes joined by the shortest curves, or a spline
/// through five points of each lane and three on a half circle to the next.
template <class Scalar>
class MissionCurve {
 public:
  static const int kPoints = 29;

  explicit MissionCurve(const MissionScenario& s)
      : spline_(s.legs == MissionLegs::kSpline), end_(s.end_m), dubins_path_(radius_of(s)) {
    for (int i = 0; i < kMissionCorners; ++i) {
      const double* const at = mission_corner(i);
      const bool north = i / 2 % 2 == 0;
      poses_[i] = {Scalar(at[0]), Scalar(at[1]), north ? Scalar(0) : math::pi<Scalar>()};
    }
    int count = 0;
    for (int lane = 0; lane < 4; ++lane) {
      const double* const from = mission_corner(2 * lane);
      const double* const to = mission_corner(2 * lane + 1);
      const double ahead = to[0] > from[0] ? 1 : -1;
      // Beside a half circle the next point is as near as its own are to each other.
      const double near = 2 * kRadius * 0.38268343236508977;  // sin 22.5 degrees
      for (const double along : {0.0, near, 60.0, 120 - near, 120.0}) {
        points_[count++] = {Scalar(from[0] + ahead * along), Scalar(from[1])};
      }
      for (int i = 1; lane < 3 && i < 4; ++i) {
        double sine, cosine;
        math::sincos(i * math::half_pi<double>() / 2, sine, cosine);
        points_[count++] = {Scalar(to[0] + ahead * kRadius * sine),
                            Scalar(to[1] + kRadius * (1 - cosine))};
      }
    }
    status_ = spline_ ? spline_path_.start(points_, kPoints)
                      : dubins_path_.start(poses_, kMissionCorners);
  }
  MissionCurve(const MissionCurve&) = delete;
  MissionCurve& operator=(const MissionCurve&) = delete;

  /// What it leads through.
  const PathPose<Scalar>* poses() const { return poses_; }
  const Waypoint<Scalar>* points() const { return points_; }

  Status check() const { return status_; }
  Status locate(Scalar x, Scalar y, PathPoint<Scalar>& point) {
    return spline_ ? spline_path_.locate(x, y, point) : dubins_path_.locate(x, y, point);
  }
  std::uint32_t leg() const { return spline_ ? spline_path_.leg() : dubins_path_.leg(); }
  bool over() const {
    if (spline_ ? spline_path_.finished() : dubins_path_.finished()) return true;
    const int legs = (spline_ ? kPoints : kMissionCorners) - 1;
    const bool last = static_cast<int>(leg()) + 1 == legs;
    const Scalar left = spline_ ? spline_path_.remaining_m() : dubins_path_.remaining_m();
    return last && static_cast<double>(left) < end_;
  }

 private:
  static constexpr double kRadius = 20;  // half the distance of the lanes

  static typename DubinsPath<Scalar>::Params radius_of(const MissionScenario& s) {
    typename DubinsPath<Scalar>::Params p;
    p.radius_m = Scalar(s.arc_m);
    return p;
  }

  bool spline_;
  double end_;
  PathPose<Scalar> poses_[kMissionCorners];
  Waypoint<Scalar> points_[kPoints];
  DubinsPath<Scalar> dubins_path_;
  SplinePath<Scalar> spline_path_;
  Status status_;
};

/// The track of a scenario: what guidance asks of it, and where its desired point is.
template <class Scalar>
class MissionPath {
 public:
  static const int kCorners = kMissionCorners;

  explicit MissionPath(const MissionScenario& s)
      : circle_track_(s.track == MissionTrack::kCircle),
        curves_(!circle_track_ && s.legs != MissionLegs::kWaypoints),
        end_(s.end_m),
        waypoints_(params_of(s)),
        curve_(s),
        flown_(s),
        status_(Status::kOk) {
    for (int i = 0; i < kCorners; ++i) {
      corners_[i].x_m = Scalar(mission_corner(i)[0]);
      corners_[i].y_m = Scalar(mission_corner(i)[1]);
    }
    status_ = circle_track_ ? circle_.set(Scalar(80), Scalar(80), Scalar(40))
              : curves_     ? curve_.check()
                            : waypoints_.start(corners_, kCorners);
  }
  MissionPath(const MissionPath&) = delete;
  MissionPath& operator=(const MissionPath&) = delete;

  Status check() const { return status_; }

  Status locate(Scalar x, Scalar y, PathPoint<Scalar>& point) {
    if (curves_) return curve_.locate(x, y, point);
    if (!circle_track_) return waypoints_.locate(x, y, point);
    point = circle_.locate(x, y);
    return Status::kOk;
  }
  /// Where the vehicle is beside the active leg, by which the run is judged; on curves beside the
  /// part that it is on itself, whatever guidance takes it to be on.
  PathPoint<double> judge(const double* position) {
    if (curves_) {
      PathPoint<double> beside = {};
      flown_.locate(position[0], position[1], beside);
      return beside;
    }
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
    if (curves_) return curve_.over();
    const bool last = waypoints_.leg() == kCorners - 2 && !waypoints_.on_arc();
    return waypoints_.finished() || (last && static_cast<double>(waypoints_.remaining_m()) < end_);
  }
  std::uint32_t leg() const {
    return circle_track_ ? 0 : curves_ ? curve_.leg() : waypoints_.leg();
  }
  /// Whether there is no corner behind which a run has to settle.
  bool smooth() const { return circle_track_ || curves_; }

  void start(double (&position)[2], double& heading) const {
    position[0] = circle_track_ ? 120 : mission_corner(0)[0];
    position[1] = circle_track_ ? 80 : mission_corner(0)[1];
    heading = circle_track_ ? math::half_pi<double>() : 0.0;
  }

  /// The desired point, which keeps moving at this speed along the circle or from corner to corner
  /// and beyond the last: a point that stops would tell the interval law that nothing moves.
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
      const double from = mission_corner(i)[k];
      point[k] = from + (mission_corner(i + 1)[k] - from) * (travelled / length);
    }
  }

 private:
  static double leg_length(int i) {
    const double dx = mission_corner(i + 1)[0] - mission_corner(i)[0];
    const double dy = mission_corner(i + 1)[1] - mission_corner(i)[1];
    return math::sqrt(dx * dx + dy * dy);
  }
  static typename Waypoints<Scalar>::Params params_of(const MissionScenario& s) {
    typename Waypoints<Scalar>::Params p;
    p.switch_m = Scalar(s.switch_m);
    p.arc_m = Scalar(s.arc_m);
    return p;
  }

  bool circle_track_, curves_;
  double end_;
  Waypoint<Scalar> corners_[kCorners];
  Waypoints<Scalar> waypoints_;
  Circle<Scalar> circle_;
  MissionCurve<Scalar> curve_;
  MissionCurve<double> flown_;  // followed by the vehicle itself
  Status status_;
};

}  // namespace mission_detail
}  // namespace auvest
