// Lines, circles and plans of waypoints against geometry done by hand.
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <limits>
#include <vector>

#include "auvest/guidance/circle.hpp"
#include "auvest/guidance/line.hpp"
#include "auvest/guidance/waypoints.hpp"

namespace {

using auvest::PathPoint;
using auvest::PlanProblem;
using auvest::Status;

constexpr double kPi = 3.14159265358979323846;
const double kNan = std::numeric_limits<double>::quiet_NaN();

/// |a - b| within a few roundings of `size`.
template <class Scalar>
bool near(Scalar a, double b, double size) {
  return std::fabs(double(a) - b) <= 8 * double(std::numeric_limits<Scalar>::epsilon()) * size;
}

/// Distance of two angles on the circle.
double apart(double a, double b) { return std::fabs(std::remainder(a - b, 2 * kPi)); }

TEST_CASE_TEMPLATE("line: along and across, starboard positive", Scalar, float, double) {
  // A 3-4-5 line: direction atan2(40, 30), from (10, -20).
  auvest::Line<Scalar> line;
  REQUIRE(line.aim(10, -20, 40, 20) == Status::kOk);
  CHECK(line.length_m() == Scalar(50));
  // 15 along, 5 to starboard: starboard of (0.6, 0.8) is (-0.8, 0.6).
  const auto point = line.locate(Scalar(10 + 9 - 4), Scalar(-20 + 12 + 3));
  CHECK(near(point.along_m, 15, 20));
  CHECK(near(point.cross_m, 5, 20));
  CHECK(near(point.direction_rad, std::atan2(4, 3), 1));
  CHECK(near(point.sine, 0.8, 1));
  CHECK(near(point.cosine, 0.6, 1));
  CHECK(point.curvature == Scalar(0));
  // Beyond the end the line goes on, and behind its beginning.
  CHECK(near(line.locate(70, 60).along_m, 100, 100));
  CHECK(near(line.locate(-20, -60).along_m, -50, 100));
}

TEST_CASE_TEMPLATE("line: what coincides or is not a number changes nothing", Scalar, float,
                   double) {
  auvest::Line<Scalar> line;
  REQUIRE(line.aim(1, 2, 4, 6) == Status::kOk);
  CHECK(line.aim(5, 5, 5, 5) == Status::kBadParameter);
  CHECK(line.aim(0, Scalar(kNan), 1, 1) == Status::kNotFinite);
  CHECK(line.aim(0, 0, std::numeric_limits<Scalar>::infinity(), 1) == Status::kNotFinite);
  CHECK(line.length_m() == Scalar(5));
  CHECK(line.locate(1, 2).along_m == Scalar(0));
}

TEST_CASE_TEMPLATE("circle: tangent, cross-track and curvature all around, both ways", Scalar,
                   float, double) {
  for (const double lam : {1.0, -1.0}) {
    auvest::Circle<Scalar> circle;
    REQUIRE(circle.set(80, -30, Scalar(40 * lam)) == Status::kOk);
    for (int k = 0; k < 24; ++k) {
      const double angle = 2 * kPi * k / 24 + 0.01;
      for (const double distance : {5.0, 40.0, 55.0}) {
        const auto point = circle.locate(Scalar(80 + distance * std::cos(angle)),
                                         Scalar(-30 + distance * std::sin(angle)));
        CHECK(apart(double(point.direction_rad), angle + lam * kPi / 2) <
              100 * double(std::numeric_limits<Scalar>::epsilon()));
        CHECK(near(point.sine, std::sin(angle + lam * kPi / 2), 20));
        CHECK(near(point.cosine, std::cos(angle + lam * kPi / 2), 20));
        // Outside a clockwise circle is to port of it, outside an anticlockwise one to starboard.
        CHECK(near(point.cross_m, lam * (40 - distance), 120));
        CHECK(near(point.curvature, lam / 40, 0.1));
      }
    }
  }
}

TEST_CASE_TEMPLATE("circle: its centre is no singular point", Scalar, float, double) {
  auvest::Circle<Scalar> circle;
  REQUIRE(circle.set(3, 4, -10) == Status::kOk);
  const auto point = circle.locate(3, 4);
  CHECK(point.cross_m == Scalar(-10));
  CHECK(near(point.direction_rad, -kPi / 2, 4));
  CHECK(circle.set(3, 4, 0) == Status::kBadParameter);
  CHECK(circle.set(3, Scalar(kNan), 5) == Status::kNotFinite);
  CHECK(circle.radius_m() == Scalar(10));
}

TEST_CASE_TEMPLATE("arc: begins where it is told to and measures its length", Scalar, float,
                   double) {
  for (const double lam : {1.0, -1.0}) {
    for (const double turn : {0.3, kPi / 2, 3.0}) {
      for (const double start : {0.0, 2.0, 3.1, -3.1}) {
        auvest::Circle<Scalar> arc;
        REQUIRE(arc.leave(10, 20, Scalar(std::sin(start)), Scalar(std::cos(start)),
                          Scalar(15 * lam), Scalar(turn)) == Status::kOk);
        const double cx = 10 - lam * 15 * std::sin(start);
        const double cy = 20 + lam * 15 * std::cos(start);
        // From a little before the arc to a little behind it.
        for (const double swept : {-0.2, 0.0, 0.5 * turn, turn, turn + 0.3}) {
          const double direction = start + lam * swept;
          const auto point = arc.locate(Scalar(cx + lam * 15 * std::sin(direction)),
                                        Scalar(cy - lam * 15 * std::cos(direction)));
          CHECK(near(point.along_m, 15 * swept, 60));
          CHECK(near(point.cross_m, 0, 60));
          CHECK(apart(double(point.direction_rad), direction) <
                30 * double(std::numeric_limits<Scalar>::epsilon()));
        }
        CHECK(near(arc.length_m(), 15 * turn, 60));
      }
    }
  }
}

template <class Scalar>
auvest::Waypoints<Scalar> plan_with(double switch_m, double arc_m, double end_radius_m = 0,
                                    double hull_m = 0) {
  typename auvest::Waypoints<Scalar>::Params p;
  p.switch_m = Scalar(switch_m);
  p.arc_m = Scalar(arc_m);
  p.end_radius_m = Scalar(end_radius_m);
  p.hull_m = Scalar(hull_m);
  return auvest::Waypoints<Scalar>(p);
}

TEST_CASE_TEMPLATE("waypoints: a leg is left on the along-track distance, however far away", Scalar,
                   float, double) {
  const auvest::Waypoint<Scalar> corners[] = {{0, 0}, {100, 0}, {100, 50}};
  auto path = plan_with<Scalar>(12, 0);
  PathPoint<Scalar> point;
  CHECK(path.locate(0, 0, point) == Status::kNotInitialised);
  REQUIRE(path.start(corners, 3) == Status::kOk);
  REQUIRE(path.locate(88, 3, point) == Status::kOk);  // 12 m to go: not yet less than 12
  CHECK(path.leg() == 0);
  CHECK(point.cross_m == Scalar(3));
  // 70 m off the waypoint, far outside any circle of acceptance, but past the switch.
  REQUIRE(path.locate(Scalar(88.5), -70, point) == Status::kOk);
  CHECK(path.leg() == 1);
  CHECK(point.along_m == Scalar(-70));
  CHECK(point.cross_m == Scalar(11.5));  // the leg goes east: south of it is to starboard
  CHECK(path.remaining_m() == Scalar(120));
  // Back over the switch: it stays on the new leg.
  REQUIRE(path.locate(50, 0, point) == Status::kOk);
  CHECK(path.leg() == 1);
}

TEST_CASE_TEMPLATE("waypoints: legs switch in order, and several at once if need be", Scalar, float,
                   double) {
  const auvest::Waypoint<Scalar> stairs[] = {{0, 0}, {20, 0}, {20, 20}, {40, 20}, {40, 40}};
  auto path = plan_with<Scalar>(5, 0);
  REQUIRE(path.start(stairs, 5) == Status::kOk);
  PathPoint<Scalar> point;
  std::vector<int> legs;
  for (int k = 0; k <= 160; ++k) {
    const double s = 0.5 * k;  // along the corners
    const double x = s < 20 ? s : s < 40 ? 20 : s < 60 ? s - 20 : 40;
    const double y = s < 20 ? 0 : s < 40 ? s - 20 : s < 60 ? 20 : s - 40;
    REQUIRE(path.locate(Scalar(x), Scalar(y), point) == Status::kOk);
    if (legs.empty() || legs.back() != path.leg()) legs.push_back(path.leg());
  }
  CHECK(legs == std::vector<int>{0, 1, 2, 3});
  CHECK(path.finished());
  REQUIRE(path.start(stairs, 5) == Status::kOk);  // again from the beginning
  CHECK(path.leg() == 0);
  CHECK(!path.finished());
  REQUIRE(path.locate(36, 16, point) == Status::kOk);  // past the switches of legs 0, 1 and 2
  CHECK(path.leg() == 3);
}

TEST_CASE_TEMPLATE("waypoints: after the end the line goes on, or a circle begins", Scalar, float,
                   double) {
  const auvest::Waypoint<Scalar> plan[] = {{0, 0}, {0, 100}};
  PathPoint<Scalar> point;
  auto line = plan_with<Scalar>(10, 0);
  REQUIRE(line.start(plan, 2) == Status::kOk);
  REQUIRE(line.locate(-3, 99, point) == Status::kOk);
  CHECK(!line.finished());
  CHECK(line.remaining_m() == Scalar(1));
  REQUIRE(line.locate(-3, 250, point) == Status::kOk);
  CHECK(line.finished());
  CHECK(line.remaining_m() == Scalar(-150));
  CHECK(point.cross_m == Scalar(3));
  CHECK(point.along_m == Scalar(250));
  REQUIRE(line.locate(-3, 50, point) == Status::kOk);  // drifted back: the plan is still over
  CHECK(line.finished());

  for (const int lam : {1, -1}) {
    auto circle = plan_with<Scalar>(10, 0, 20 * lam);
    REQUIRE(circle.start(plan, 2) == Status::kOk);
    REQUIRE(circle.locate(0, 100, point) == Status::kOk);  // where the line ends the circle begins
    CHECK(circle.finished());
    CHECK(near(point.cross_m, 0, 40));
    CHECK(near(point.direction_rad, kPi / 2, 4));
    CHECK(near(point.curvature, lam / 20.0, 1));
    // Clockwise from the east: the circle lies to the south.
    REQUIRE(circle.locate(Scalar(-40 * lam), 100, point) == Status::kOk);
    CHECK(near(point.cross_m, 0, 100));
    CHECK(near(point.cosine, 0, 4));
    CHECK(near(point.sine, -1, 4));
    CHECK(circle.remaining_m() == Scalar(0));
    // It is a whole one: seven eighths on, the way along it is that from its beginning.
    const double a = 7 * kPi / 4;
    REQUIRE(circle.locate(Scalar(-lam * 20 * (1 - std::cos(a))), Scalar(100 + 20 * std::sin(a)),
                          point) == Status::kOk);
    CHECK(near(point.along_m, 20 * a, 1000));
  }
}

TEST_CASE_TEMPLATE("waypoints: arcs join the legs without a step in place or direction", Scalar,
                   float, double) {
  // A corner of 90 degrees to starboard, one of 60 to port: leads R tan 45 and R tan 30.
  const double s60 = std::sqrt(0.75);
  const auvest::Waypoint<Scalar> plan[] = {
      {0, 0}, {100, 0}, {100, 100}, {Scalar(100 + 100 * s60), Scalar(100 + 100 * 0.5)}};
  auto path = plan_with<Scalar>(12, 18);
  REQUIRE(path.start(plan, 4) == Status::kOk);
  CHECK(path.report().problem == PlanProblem::kNone);
  // Fly it exactly: each step 0.1 m along the direction of the path, turned by its curvature.
  double x = 0, y = 0, heading = 0;
  double arc_at = -1, arc_for = 0, travelled = 0;
  int arcs = 0;
  bool was_on_arc = false;
  PathPoint<Scalar> point;
  while (!path.finished() && travelled < 400) {
    REQUIRE(path.locate(Scalar(x), Scalar(y), point) == Status::kOk);
    CHECK(std::fabs(double(point.cross_m)) < 0.01);
    CHECK(apart(double(point.direction_rad), heading) < 0.006);  // one step on the arc
    if (path.on_arc() && !was_on_arc) {
      ++arcs;
      if (arc_at < 0) arc_at = travelled;
    }
    if (path.on_arc()) arc_for += 0.1;
    was_on_arc = path.on_arc();
    const double turn = 0.1 * double(point.curvature);
    heading = double(point.direction_rad) + turn;
    x += 0.1 * std::cos(heading - turn / 2);
    y += 0.1 * std::sin(heading - turn / 2);
    travelled += 0.1;
  }
  CHECK(arcs == 2);
  CHECK(std::fabs(arc_at - (100 - 18)) < 0.11);
  CHECK(std::fabs(arc_for - 18 * (kPi / 2 + kPi / 3)) < 0.21);
  // 300 m of legs, less two leads and plus the arc at each corner.
  const double length = 300 - 2 * 18 - 2 * 18 * std::tan(kPi / 6) + 18 * (kPi / 2 + kPi / 3);
  CHECK(std::fabs(travelled - length) < 0.3);
}

TEST_CASE_TEMPLATE("waypoints: a turn too small for an arc is none, and the next leg follows",
                   Scalar, float, double) {
  // The sine of this turn is a number without its full digits: no arc begins with it.
  const Scalar aside = (std::numeric_limits<Scalar>::min)();
  const auvest::Waypoint<Scalar> corners[] = {
      {Scalar(0), Scalar(0)}, {Scalar(100), Scalar(0)}, {Scalar(200), aside}};
  auto path = plan_with<Scalar>(12, 20);
  REQUIRE(path.start(corners, 3) == Status::kOk);
  PathPoint<Scalar> point;
  REQUIRE(path.locate(Scalar(101), Scalar(2), point) == Status::kOk);
  CHECK(!path.on_arc());
  CHECK(path.leg() == 1);
  CHECK(near(point.along_m, 1, 100));
  CHECK(near(point.cross_m, 2, 100));
}

TEST_CASE_TEMPLATE("waypoints: what quiet periods form ahead is what a switch forms by itself",
                   Scalar, float, double) {
  // A right corner, one of 0.3 rad, none, and one of 1.9 rad to port; places on every leg and arc.
  const auvest::Waypoint<Scalar> plan[] = {{3, 1},    {103, 2},  {101, 100},
                                           {70, 195}, {39, 290}, {150, Scalar(280.5)}};
  const Scalar places[][2] = {{50, 1},   {102, 7},  {101, 60}, {Scalar(100.5), Scalar(100.5)},
                              {80, 160}, {50, 255}, {40, 288}, {100, 285}};
  for (const double arc_m : {0.0, 12.0}) {
    auto rare = plan_with<Scalar>(8, arc_m);
    auto often = plan_with<Scalar>(8, arc_m);
    REQUIRE(rare.start(plan, 6) == Status::kOk);
    REQUIRE(often.start(plan, 6) == Status::kOk);
    int legs_and_arcs = 0, before = -1;
    for (const auto& place : places) {
      PathPoint<Scalar> switching, quiet;
      REQUIRE(rare.locate(place[0], place[1], switching) == Status::kOk);
      for (int k = 0; k < 5; ++k) {
        REQUIRE(often.locate(place[0], place[1], quiet) == Status::kOk);
        CHECK(often.leg() == rare.leg());
        CHECK(often.on_arc() == rare.on_arc());
        CHECK(often.remaining_m() == rare.remaining_m());
        CHECK(quiet.direction_rad == switching.direction_rad);
        CHECK(quiet.along_m == switching.along_m);
        CHECK(quiet.cross_m == switching.cross_m);
        CHECK(quiet.curvature == switching.curvature);
      }
      const int now = 2 * rare.leg() + (rare.on_arc() ? 1 : 0);
      legs_and_arcs += now != before ? 1 : 0;
      before = now;
    }
    CHECK(legs_and_arcs == (arc_m > 0 ? 8 : 5));
  }
}

TEST_CASE_TEMPLATE("waypoints: what is refused, which leg and why; the old plan goes on", Scalar,
                   float, double) {
  const auvest::Waypoint<Scalar> good[] = {{0, 0}, {100, 0}, {100, 40}};
  auto path = plan_with<Scalar>(12, 0);
  CHECK(path.report().problem == PlanProblem::kTooFew);  // no plan yet
  CHECK(path.report().leg == 0);
  REQUIRE(path.start(good, 3) == Status::kOk);
  PathPoint<Scalar> point;
  REQUIRE(path.locate(95, 0, point) == Status::kOk);
  REQUIRE(path.leg() == 1);

  struct Case {
    std::vector<auvest::Waypoint<Scalar>> plan;
    PlanProblem problem;
    int leg;
    Status status;
  };
  const Scalar nan = Scalar(kNan);
  const Case cases[] = {
      {{{0, 0}}, PlanProblem::kTooFew, 0, Status::kBadParameter},
      {{{0, 0}, {50, 0}, {50, nan}}, PlanProblem::kNotFinite, 1, Status::kNotFinite},
      {{{0, 0}, {50, 0}, {50, 0}, {90, 0}}, PlanProblem::kTooClose, 1, Status::kBadParameter},
      {{{0, 0}, {50, 0}, {62, 0}, {90, 0}}, PlanProblem::kTooClose, 1, Status::kBadParameter},
  };
  for (const Case& c : cases) {
    CHECK(path.start(c.plan.data(), static_cast<std::uint16_t>(c.plan.size())) == c.status);
    CHECK(path.report().problem == c.problem);
    CHECK(path.report().leg == c.leg);
    REQUIRE(path.locate(100, 20, point) == Status::kOk);
    CHECK(path.leg() == 1);
    CHECK(point.along_m == Scalar(20));
  }
  CHECK(path.locate(nan, 0, point) == Status::kNotFinite);
  CHECK(path.locate(0, nan, point) == Status::kNotFinite);
  CHECK(point.along_m == Scalar(20));
  CHECK(path.leg() == 1);

  // Arcs of 18 m at two right corners need 36 m between them; turning back needs more than there
  // is.
  const auvest::Waypoint<Scalar> lanes[] = {{0, 0}, {100, 0}, {100, 40}, {0, 40}};
  CHECK(plan_with<Scalar>(0, 18).start(lanes, 4) == Status::kOk);
  auto wide = plan_with<Scalar>(0, 21);
  CHECK(wide.start(lanes, 4) == Status::kBadParameter);
  CHECK(wide.report().problem == PlanProblem::kNoRoom);
  CHECK(wide.report().leg == 1);
  const auvest::Waypoint<Scalar> back[] = {{0, 0}, {100, 0}, {0, 0}};
  auto turned = plan_with<Scalar>(0, 18);
  CHECK(turned.start(back, 3) == Status::kBadParameter);
  CHECK(turned.report().problem == PlanProblem::kNoRoom);

  auto wrong = plan_with<Scalar>(-1, 0);
  CHECK(wrong.check() == Status::kBadParameter);
  CHECK(wrong.start(good, 3) == Status::kBadParameter);
}

TEST_CASE_TEMPLATE("waypoints: a leg inside the turning circle is flown, and warned of", Scalar,
                   float, double) {
  // At 14.3 m of radius, legs closer than 28.6 m cannot be flown by simple corners.
  const auvest::Waypoint<Scalar> tight[] = {{0, 0}, {100, 0}, {100, 28}, {0, 28}};
  auto path = plan_with<Scalar>(12, 0, 0, 14.3);
  CHECK(path.start(tight, 4) == Status::kOk);
  CHECK(path.report().problem == PlanProblem::kTightLeg);
  CHECK(path.report().leg == 1);
  const auvest::Waypoint<Scalar> wide[] = {{0, 0}, {100, 0}, {100, 29}, {0, 29}};
  CHECK(path.start(wide, 4) == Status::kOk);
  CHECK(path.report().problem == PlanProblem::kNone);
  // Arcs are measured by their own radius.
  auto arcs = plan_with<Scalar>(0, 14, 0, 14.3);
  CHECK(arcs.start(wide, 4) == Status::kOk);
  CHECK(arcs.report().problem == PlanProblem::kTightLeg);
  CHECK(arcs.report().leg == 0);
}

}  // namespace
