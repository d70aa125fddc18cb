// The torpedo flies smooth paths, its state known and the water at rest: what is left is how well
// the path suits the hull.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>

#include "auvest/control/autopilot.hpp"
#include "auvest/guidance/crab_feed_forward.hpp"
#include "auvest/guidance/dubins_path.hpp"
#include "auvest/guidance/spline_path.hpp"
#include "auvest/guidance/waypoints.hpp"
#include "auvest/vehicle/integrate.hpp"
#include "auvest/vehicle/remus100.hpp"

namespace {

using auvest::Status;

/// The largest cross-track error of `remus100` at 1.5 m/s from (0, 0) to the end of a plan.
template <class Path>
double worst_cross_track(Path& path) {
  using Hull = auvest::Hull<auvest::Torpedo<double>>;
  const Hull hull(auvest::remus100<double>());
  Hull::Current still;
  auvest::math::set_zero(still);
  Hull::State x = hull.at_rest(still);
  x(2) = 5;    // depth
  x(6) = 1.5;  // surge
  x(14) = 15;  // 900 rpm
  auvest::CrabFeedForward<double> law;
  auvest::Autopilot<double> autopilot;
  REQUIRE(autopilot.restart(0) == Status::kOk);
  double worst = 0;
  for (int k = 0; k < 6000 && !path.finished(); ++k) {
    auvest::PathPoint<double> point;
    REQUIRE(path.locate(x(0), x(1), point) == Status::kOk);
    worst = std::fmax(worst, std::fabs(point.cross_m));
    auvest::GuidanceCommand<double> wanted;
    REQUIRE(law.update(point, 1.5, 0.1, wanted) == Status::kOk);
    auvest::AutopilotReadings<double> now;
    now.heading_rad = auvest::math::wrap(x(5));
    now.yaw_rate_rad_s = x(11);
    now.speed_m_s = x(6);
    now.depth_m = x(2);
    now.pitch_rad = x(4);
    now.pitch_rate_rad_s = x(10);
    auvest::TorpedoCommand<double> out;
    REQUIRE(autopilot.update(wanted, 1.5, 5.0, now, 0.1, out) == Status::kOk);
    Hull::Command command;
    command << out.rudder_rad, out.stern_planes_rad, out.propeller_rev_s;
    REQUIRE(auvest::advance<auvest::Rk4>(hull, x, command, still, 0.1) == Status::kOk);
  }
  CHECK(path.finished());
  return worst;
}

TEST_CASE("smooth paths: what the hull can turn it flies, a corner it cannot") {
  // Two lanes of 120 m, 50 m apart; the hull turns on 14.3 m at this speed.
  constexpr double kPi = 3.14159265358979323846;
  const auvest::PathPose<double> poses[] = {{0, 0, 0}, {120, 0, 0}, {120, 50, kPi}, {0, 50, kPi}};
  auvest::DubinsPath<double>::Params turn;
  turn.radius_m = 20;
  turn.hull_m = 14.3;
  auvest::DubinsPath<double> dubins(turn);
  REQUIRE(dubins.start(poses, 4) == Status::kOk);
  CHECK(dubins.report().problem == auvest::PlanProblem::kNone);
  const double on_dubins = worst_cross_track(dubins);

  const auvest::Waypoint<double> bends[] = {{0, 0},    {60, 0},   {110, 30},
                                            {110, 80}, {60, 110}, {0, 110}};
  auvest::SplinePath<double>::Params bend;
  bend.hull_m = 14.3;
  auvest::SplinePath<double> spline(bend);
  REQUIRE(spline.start(bends, 6) == Status::kOk);
  CHECK(spline.report().problem == auvest::PlanProblem::kNone);
  const double on_spline = worst_cross_track(spline);

  const auvest::Waypoint<double> lanes[] = {{0, 0}, {120, 0}, {120, 50}, {0, 50}};
  auvest::Waypoints<double> corners;
  REQUIRE(corners.start(lanes, 4) == Status::kOk);
  const double on_corners = worst_cross_track(corners);

  CAPTURE(on_dubins);
  CAPTURE(on_spline);
  CAPTURE(on_corners);
  // Where the curvature jumps by 1/R the heading lags behind by two seconds at most (reference, fin
  // and Nomoto's second): U/R 2 s, and a look-ahead of 10 m makes 1.5 m of that.
  CHECK(on_dubins < 1.5);
  CHECK(on_spline < 1.5);
  CHECK(on_corners > 8);
}

}  // namespace
