// Dubins curves and splines against textbook forms, brute force and geometry done by hand.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "auvest/guidance/dubins.hpp"
#include "auvest/guidance/dubins_path.hpp"
#include "auvest/guidance/spline_path.hpp"
#include "auvest/math/random.hpp"

namespace {

using auvest::DubinsCurve;
using auvest::DubinsPath;
using auvest::PathPoint;
using auvest::PathPose;
using auvest::PlanProblem;
using auvest::SplinePath;
using auvest::Status;

constexpr double kPi = 3.14159265358979323846;
const double kNan = std::numeric_limits<double>::quiet_NaN();

double positive(double angle) {
  const double rest = std::fmod(angle, 2 * kPi);
  return rest < 0 ? rest + 2 * kPi : rest;
}
double apart(double a, double b) { return std::fabs(std::remainder(a - b, 2 * kPi)); }

/// The shortest of the six words in the form of Shkel and Lumelsky (2001): unit radius, the goal at
/// (d, 0), headings alpha and beta. Only R stands for this project's clockwise.
double textbook_length(double d, double alpha, double beta) {
  const double sa = std::sin(alpha), sb = std::sin(beta), ca = std::cos(alpha), cb = std::cos(beta);
  const double cab = std::cos(alpha - beta);
  double best = std::numeric_limits<double>::infinity();
  const auto take = [&best](double t, double p, double q) {
    best = std::fmin(best, positive(t) + p + positive(q));
  };
  double square = 2 + d * d - 2 * cab + 2 * d * (sa - sb);
  if (square >= 0) {  // LSL
    const double h = std::atan2(cb - ca, d + sa - sb);
    take(h - alpha, std::sqrt(square), beta - h);
  }
  square = 2 + d * d - 2 * cab + 2 * d * (sb - sa);
  if (square >= 0) {  // RSR
    const double h = std::atan2(ca - cb, d - sa + sb);
    take(alpha - h, std::sqrt(square), h - beta);
  }
  square = -2 + d * d + 2 * cab + 2 * d * (sa + sb);
  if (square >= 0) {  // LSR
    const double p = std::sqrt(square);
    const double h = std::atan2(-ca - cb, d + sa + sb) - std::atan2(-2, p);
    take(h - alpha, p, h - beta);
  }
  square = -2 + d * d + 2 * cab - 2 * d * (sa + sb);
  if (square >= 0) {  // RSL
    const double p = std::sqrt(square);
    const double h = std::atan2(ca + cb, d - sa - sb) - std::atan2(2, p);
    take(alpha - h, p, beta - h);
  }
  double cosine = (6 - d * d + 2 * cab + 2 * d * (sa - sb)) / 8;
  if (std::fabs(cosine) <= 1) {  // RLR
    const double p = positive(2 * kPi - std::acos(cosine));
    const double t = positive(alpha - std::atan2(ca - cb, d - sa + sb) + p / 2);
    take(t, p, alpha - beta - t + p);
  }
  cosine = (6 - d * d + 2 * cab + 2 * d * (sb - sa)) / 8;
  if (std::fabs(cosine) <= 1) {  // LRL
    const double p = positive(2 * kPi - std::acos(cosine));
    const double t = positive(std::atan2(cb - ca, d + sa - sb) - alpha + p / 2);
    take(t, p, beta - alpha - t + p);
  }
  return best;
}

struct Place {
  double x, y, heading;

  /// So far on, on this side of a circle of radius r.
  void go(double length, int side, double r) {
    if (side == 0) {
      x += length * std::cos(heading);
      y += length * std::sin(heading);
      return;
    }
    const double next = heading + side * length / r;
    x += side * r * (std::sin(next) - std::sin(heading));
    y += side * r * (std::cos(heading) - std::cos(next));
    heading = next;
  }
};

template <class Scalar>
PathPose<Scalar> pose(const Place& p) {
  return {Scalar(p.x), Scalar(p.y), Scalar(p.heading)};
}

template <class Scalar>
DubinsCurve<Scalar> curve_to(const Place& to, double r, const Place& from = {0, 0, 0}) {
  DubinsCurve<Scalar> curve;
  REQUIRE(auvest::shortest_curve(pose<Scalar>(from), pose<Scalar>(to), Scalar(r), curve) ==
          Status::kOk);
  return curve;
}

TEST_CASE_TEMPLATE("dubins: curves that are known", Scalar, float, double) {
  const double eps = double(std::numeric_limits<Scalar>::epsilon());
  const double r = 15;
  const auto length = [r](const Place& to) { return double(curve_to<Scalar>(to, r).length_m); };
  CHECK(std::fabs(length({100, 0, 0}) - 100) < 100 * eps);
  CHECK(std::fabs(length({0, 2 * r, kPi}) - kPi * r) < 200 * eps);       // half a circle
  CHECK(std::fabs(length({0, -2 * r, -kPi}) - kPi * r) < 200 * eps);     // to port
  CHECK(std::fabs(length({r, r, kPi / 2}) - kPi / 2 * r) < 200 * eps);   // a quarter
  CHECK(std::fabs(length({0, 0, kPi}) - 7 * kPi / 3 * r) < 2000 * eps);  // back: 60, 300, 60 deg
  // Lane to lane: the line is that between the two centres, and half a turn is shared.
  CHECK(std::fabs(length({100, 60, kPi}) - (std::hypot(100, 30) + kPi * r)) < 300 * eps);
  // Straight ahead is no circle, whatever rounding makes of the headings.
  const auto ahead =
      curve_to<Scalar>({70 * std::cos(2.5), 70 * std::sin(2.5), 2.5 - 3 * eps}, r, {0, 0, 2.5});
  CHECK(std::fabs(double(ahead.length_m) - 70) < 0.1);
}

TEST_CASE_TEMPLATE("dubins: the textbook's length, and the parts end at the goal", Scalar, float,
                   double) {
  const double eps = double(std::numeric_limits<Scalar>::epsilon());
  auvest::math::Random random(7, 0);
  int words[3][3] = {};
  for (int k = 0; k < 3000; ++k) {
    const double r = 5 + 20 * random.uniform<double>();
    const double d = 8 * r * random.uniform<double>();
    const double towards = 2 * kPi * random.uniform<double>();
    const Place from = {20 * random.uniform<double>(), -30 * random.uniform<double>(),
                        2 * kPi * random.uniform<double>()};
    const Place to = {from.x + d * std::cos(towards), from.y + d * std::sin(towards),
                      2 * kPi * random.uniform<double>()};
    const auto curve = curve_to<Scalar>(to, r, from);
    // The textbook's y is to port where ours is to starboard: angles change their sign.
    const double best = r * textbook_length(d / r, towards - from.heading, towards - to.heading);
    // A root of a difference may halve the digits; float may then take another word.
    const double tolerance = sizeof(Scalar) == 8 ? 1e-5 : 0.05;
    CHECK(std::fabs(double(curve.length_m) - best) < tolerance);

    Place place = from;
    for (const auto& part : curve.parts) {
      CHECK(std::fabs(double(part.x_m) - place.x) + std::fabs(double(part.y_m) - place.y) <
            3000 * eps + 1e-6);
      CHECK(apart(std::atan2(double(part.sine), double(part.cosine)), place.heading) <
            300 * eps + 1e-7);
      place.go(double(part.length_m), part.side, r);
    }
    CHECK(std::hypot(place.x - to.x, place.y - to.y) < 3000 * eps + 1e-6);
    CHECK(apart(place.heading, to.heading) < 300 * eps + 1e-7);
    ++words[curve.parts[0].side + 1][curve.parts[1].side == 0 ? curve.parts[2].side + 1 : 1];
  }
  for (const int* row : {words[0], words[2]}) {
    for (int word = 0; word < 3; ++word) CHECK(row[word] > 10);  // CSC to both sides, and CCC
  }
}

TEST_CASE("dubins: no curve of arcs and lines that ends there is shorter") {
  auvest::math::Random random(11, 0);
  const double r = 12;
  int equal = 0;
  for (int k = 0; k < 20000; ++k) {
    Place place = {0, 0, 0};
    double length = 0;
    const int parts = 1 + static_cast<int>(5 * random.uniform<double>());
    for (int i = 0; i < parts; ++i) {
      const int side = static_cast<int>(3 * random.uniform<double>()) - 1;
      const double step = 4 * r * std::pow(random.uniform<double>(), 2);
      place.go(step, side, r);
      length += step;
    }
    const double found = curve_to<double>(place, r).length_m;
    CHECK(found < length + 1e-5);
    if (found > length - 1e-5) ++equal;
  }
  CHECK(equal > 1000);  // some of the random ones are the shortest
}

TEST_CASE_TEMPLATE("dubins: what is refused leaves the curve as it was", Scalar, float, double) {
  DubinsCurve<Scalar> curve = curve_to<Scalar>({100, 0, 0}, 10);
  const PathPose<Scalar> here = {0, 0, 0}, there = {50, 3, 1};
  const PathPose<Scalar> nowhere = {0, Scalar(kNan), 0};
  const PathPose<Scalar> beyond = {std::numeric_limits<Scalar>::max(), 0, 0};
  const Scalar r = 10;
  CHECK(auvest::shortest_curve(here, nowhere, r, curve) == Status::kNotFinite);
  CHECK(auvest::shortest_curve(here, there, Scalar(kNan), curve) == Status::kNotFinite);
  CHECK(auvest::shortest_curve(here, there, Scalar(0), curve) == Status::kBadParameter);
  CHECK(auvest::shortest_curve(here, there, Scalar(-3), curve) == Status::kBadParameter);
  CHECK(auvest::shortest_curve(here, beyond, r, curve) == Status::kOverflow);
  CHECK(curve.length_m == Scalar(100));
}

/// Flies a path exactly, by its direction and curvature, in steps of 5 cm.
template <class Scalar, class Path>
std::vector<PathPoint<double>> fly(Path& path, Place place, double most_m) {
  std::vector<PathPoint<double>> flown;
  PathPoint<Scalar> point;
  for (double way = 0; way < most_m && !path.finished(); way += 0.05) {
    REQUIRE(path.locate(Scalar(place.x), Scalar(place.y), point) == Status::kOk);
    PathPoint<double> seen;
    seen.cross_m = double(point.cross_m);
    seen.curvature = double(point.curvature);
    seen.direction_rad = double(point.direction_rad);
    seen.along_m = double(path.remaining_m());
    seen.cosine = place.x;
    seen.sine = place.y;
    flown.push_back(seen);
    const double turn = 0.05 * seen.curvature;
    place.x += 0.05 * std::cos(seen.direction_rad + turn / 2);
    place.y += 0.05 * std::sin(seen.direction_rad + turn / 2);
  }
  return flown;
}

TEST_CASE_TEMPLATE("dubins path: flown to its end, every arc as the hull can turn", Scalar, float,
                   double) {
  // The third pose lies behind the second, the last one is a whole turn away.
  const PathPose<Scalar> plan[] = {
      {0, 0, 0}, {80, 40, 0}, {60, 50, Scalar(kPi)}, {60, 50, 0}, {60, 50, Scalar(-0.01)}};
  typename DubinsPath<Scalar>::Params params;
  params.radius_m = 14;
  DubinsPath<Scalar> path(params);
  REQUIRE(path.start(plan, 5) == Status::kOk);
  double length = 0;
  for (int i = 0; i < 4; ++i) {
    DubinsCurve<Scalar> curve;
    REQUIRE(auvest::shortest_curve(plan[i], plan[i + 1], Scalar(14), curve) == Status::kOk);
    length += double(curve.length_m);
  }
  CHECK(length > 2 * kPi * 14 + 100);
  const auto flown = fly<Scalar>(path, {0, 0, 0}, length + 10);
  CHECK(path.finished());
  CHECK(std::fabs(0.05 * double(flown.size()) - length) < 0.5);
  double before = flown.front().direction_rad;
  for (const auto& point : flown) {
    CHECK(std::fabs(point.cross_m) < 0.02);
    CHECK(std::fabs(point.curvature) < 1.001 / 14);
    CHECK(apart(point.direction_rad, before) < 1.1 * 0.05 / 14 + 1e-3);
    before = point.direction_rad;
  }
  // Beyond the last pose the line goes on, in its direction.
  PathPoint<Scalar> point;
  REQUIRE(path.locate(90, 53, point) == Status::kOk);
  CHECK(std::fabs(double(point.cross_m) - (3 * std::cos(0.01) + 30 * std::sin(0.01))) < 1e-4);
  CHECK(std::fabs(double(path.remaining_m()) + 30 * std::cos(0.01) - 3 * std::sin(0.01)) < 1e-4);
  CHECK(!path.on_arc());
}

TEST_CASE_TEMPLATE("dubins path: thrown back on a long arc it does not take it for flown", Scalar,
                   float, double) {
  // Back to where it came from: 60 degrees, 300 the other way, and 60 again.
  const PathPose<Scalar> plan[] = {{0, 0, 0}, {0, 0, Scalar(kPi)}};
  typename DubinsPath<Scalar>::Params params;
  params.radius_m = 14;
  DubinsPath<Scalar> path(params);
  REQUIRE(path.start(plan, 2) == Status::kOk);
  const auto arc = path.curve().parts[1];
  PathPoint<Scalar> point;
  for (const double degrees : {2.0, -40.0}) {  // 330 degrees on, by the place alone
    Place place = {double(arc.x_m), double(arc.y_m),
                   std::atan2(double(arc.sine), double(arc.cosine))};
    place.go(14 * degrees * kPi / 180, arc.side, 14);
    REQUIRE(path.locate(Scalar(place.x), Scalar(place.y), point) == Status::kOk);
    CHECK(std::fabs(double(path.remaining_m()) - 14 * (360 - degrees) * kPi / 180) < 1e-3);
    CHECK(double(point.curvature) * arc.side > 0);
  }
}

TEST_CASE_TEMPLATE("dubins path: what is refused, and what is warned of", Scalar, float, double) {
  typename DubinsPath<Scalar>::Params params;
  params.radius_m = 14;
  params.hull_m = Scalar(14.3);
  DubinsPath<Scalar> path(params);
  PathPoint<Scalar> point;
  CHECK(path.locate(0, 0, point) == Status::kNotInitialised);
  const PathPose<Scalar> good[] = {{0, 0, 0}, {80, 40, 1}};
  CHECK(path.start(good, 1) == Status::kBadParameter);
  CHECK(path.report().problem == PlanProblem::kTooFew);
  REQUIRE(path.start(good, 2) == Status::kOk);
  CHECK(path.report().problem == PlanProblem::kTightLeg);
  const PathPose<Scalar> twice[] = {{0, 0, 0}, {80, 40, 1}, {80, 40, 1}};
  CHECK(path.start(twice, 3) == Status::kBadParameter);
  CHECK(path.report().problem == PlanProblem::kTooClose);
  CHECK(path.report().leg == 1);
  const PathPose<Scalar> nowhere[] = {{0, 0, 0}, {80, 40, Scalar(kNan)}};
  CHECK(path.start(nowhere, 2) == Status::kNotFinite);
  REQUIRE(path.locate(1, 0, point) == Status::kOk);  // the old plan goes on
  CHECK(path.locate(Scalar(kNan), 0, point) == Status::kNotFinite);
  // After the end of one plan another begins at its own beginning.
  const PathPose<Scalar> short_ones[] = {{0, 0, 0}, {30, 0, 0}, {60, 0, 0}};
  for (int again = 0; again < 2; ++again) {
    REQUIRE(path.start(short_ones, 3) == Status::kOk);
    CHECK(!path.finished());
    CHECK(path.leg() == 0);
    REQUIRE(path.locate(10, 1, point) == Status::kOk);
    CHECK(std::fabs(double(path.remaining_m()) - 20) < 1e-4);
    for (int x = 20; x <= 70; x += 5) REQUIRE(path.locate(Scalar(x), 1, point) == Status::kOk);
    CHECK(path.finished());
  }
  params.radius_m = 0;
  CHECK(DubinsPath<Scalar>(params).start(good, 2) == Status::kBadParameter);
}

// ---- Splines
// -------------------------------------------------------------------------------------

template <class Scalar>
using Points = std::vector<auvest::Waypoint<Scalar>>;

template <class Scalar>
SplinePath<Scalar> spline(const Points<Scalar>& plan, double hull_m = 0) {
  typename SplinePath<Scalar>::Params params;
  params.hull_m = Scalar(hull_m);
  SplinePath<Scalar> path(params);
  REQUIRE(path.start(plan.data(), static_cast<std::uint16_t>(plan.size())) == Status::kOk);
  return path;
}

TEST_CASE_TEMPLATE("spline: through waypoints in a line it is the line", Scalar, float, double) {
  const Points<Scalar> plan = {{0, 0}, {30, 40}, {90, 120}, {120, 160}};
  auto path = spline(plan);
  PathPoint<Scalar> point;
  for (double s = 1; s < 199; s += 7.3) {
    REQUIRE(path.locate(Scalar(0.6 * s - 0.8 * 3), Scalar(0.8 * s + 0.6 * 3), point) ==
            Status::kOk);
    CHECK(std::fabs(double(point.cross_m) - 3) < 1e-4);
    CHECK(std::fabs(double(point.direction_rad) - std::atan2(4, 3)) < 1e-5);
    CHECK(std::fabs(double(point.curvature)) < 1e-5);
    const double begin = s < 50 ? 0 : s < 150 ? 50 : 150;
    CHECK(std::fabs(double(point.along_m) - (s - begin)) < 1e-3);
  }
}

TEST_CASE_TEMPLATE("spline: the nearer neighbour of a waypoint has the greater say", Scalar, float,
                   double) {
  // (10 (1, 0) + 30 (0, 1)) / 40 at the corner.
  const Points<Scalar> plan = {{0, 0}, {30, 0}, {30, 10}};
  auto path = spline(plan);
  PathPoint<Scalar> point;
  for (const int x : {15, 30, 30}) REQUIRE(path.locate(Scalar(x), 0, point) == Status::kOk);
  CHECK(std::fabs(double(point.direction_rad) - std::atan2(3, 1)) < 1e-5);
}

TEST_CASE_TEMPLATE("spline: from far beside a bend it does not run over to the next leg", Scalar,
                   float, double) {
  // The leg from (50, 0) to (50, 40) bulges by 40 / 8 |T_1 - T_2| = 40 / 9. Newton's first step
  // there, unlimited, is 1.2 legs.
  const Points<Scalar> plan = {{0, 0}, {50, 0}, {50, 40}, {0, 40}};
  auto path = spline(plan);
  PathPoint<Scalar> point;
  for (const int x : {20, 40, 50, 50}) REQUIRE(path.locate(Scalar(x), 0, point) == Status::kOk);
  for (int k = 0; k < 2; ++k) REQUIRE(path.locate(80, 20, point) == Status::kOk);
  CHECK(path.leg() == 1);
  CHECK(std::fabs(double(point.cross_m) + 30 - 40.0 / 9) < 1e-3);
}

TEST_CASE_TEMPLATE("spline: through waypoints on a circle it is nearly the circle", Scalar, float,
                   double) {
  Points<Scalar> plan;
  for (int k = 0; k <= 12; ++k) {
    plan.push_back({Scalar(40 * std::cos(kPi * k / 8)), Scalar(40 * std::sin(kPi * k / 8))});
  }
  auto path = spline(plan);
  PathPoint<Scalar> point;
  double length = 0;
  for (double angle = 0.01; angle < 1.49 * kPi; angle += 0.02) {
    const bool inside = angle > kPi / 8 && angle < 11 * kPi / 8;
    REQUIRE(path.locate(Scalar(37 * std::cos(angle)), Scalar(37 * std::sin(angle)), point) ==
            Status::kOk);
    if (!inside) continue;  // the ends know no neighbour
    // Clockwise, and 3 m inside: to starboard. With chords of 2 a it is (1 - cos a - sin^2 a cos a
    // / 2) R off between two waypoints, and bends by (3 / cos^2 a - 2) / R at them.
    const double a = kPi / 16, c = std::cos(a);
    const double off = 40 * (1 - c - (1 - c * c) * c / 2);
    CHECK(std::fabs(double(point.cross_m) - 3) < 1.001 * off);
    CHECK(std::fabs(double(point.curvature) * 40 - 1) < 3 / (c * c) - 3 + 1e-4);
    CHECK(apart(double(point.direction_rad), angle + kPi / 2) < 0.01);
    length = double(point.along_m) + double(path.remaining_m());
    CHECK(std::fabs(length - 40 * kPi / 8) < 0.02);
  }
}

TEST_CASE_TEMPLATE("spline: flown exactly it meets every waypoint without a step in direction",
                   Scalar, float, double) {
  const Points<Scalar> plan = {{0, 0}, {60, 10}, {90, 60}, {40, 90}, {60, 150}};
  auto path = spline(plan);
  const auto flown = fly<Scalar>(path, {0, 0, 0}, 400);
  CHECK(path.finished());
  const PathPoint<double>* before = &flown.front();
  for (const auto& point : flown) {
    CHECK(std::fabs(point.cross_m) < 0.03);
    CHECK(apart(point.direction_rad, before->direction_rad) < 0.012);  // the tightest bend: 5 m
    // It turns by its curvature, which may jump at a waypoint.
    const double turn = std::remainder(point.direction_rad - before->direction_rad, 2 * kPi);
    const bool smooth = std::fabs(point.curvature - before->curvature) < 0.01;
    if (smooth && &point != &flown.front()) {
      CHECK(std::fabs(turn - 0.025 * (point.curvature + before->curvature)) < 6e-4);
    }
    before = &point;
  }
  for (const auto& corner : plan) {
    double nearest = 1e9;
    for (const auto& point : flown) {
      nearest = std::fmin(
          nearest, std::hypot(point.cosine - double(corner.x_m), point.sine - double(corner.y_m)));
    }
    CHECK(nearest < 0.06);
  }
}

TEST_CASE("spline: the point beside the vehicle is the nearest one, by search") {
  const Points<double> plan = {{0, 0}, {60, 10}, {90, 60}, {40, 90}, {60, 150}};
  auto line = spline(plan);
  const auto curve = fly<double>(line, {0, 0, 0}, 400);
  auto path = spline(plan);
  PathPoint<double> point;
  for (std::size_t k = 0; k + 1 < curve.size(); k += 200) {  // 10 m at once
    const double aside = 2.5 * std::sin(0.1 * double(k));
    const double x = curve[k].cosine - aside * std::sin(curve[k].direction_rad);
    const double y = curve[k].sine + aside * std::cos(curve[k].direction_rad);
    double nearest = 1e9;
    for (const auto& other : curve) {
      nearest = std::fmin(nearest, std::hypot(other.cosine - x, other.sine - y));
    }
    REQUIRE(path.locate(x, y, point) == Status::kOk);
    CHECK(std::fabs(std::fabs(point.cross_m) - nearest) < 0.03);
  }
}

TEST_CASE_TEMPLATE("spline: another lane that comes near is not jumped to", Scalar, float, double) {
  const Points<Scalar> plan = {{0, 0}, {100, 0}, {110, 15}, {100, 30}, {0, 6}};
  auto path = spline(plan);
  PathPoint<Scalar> point;
  for (double x = 0; x < 80; x += 0.5) {
    REQUIRE(path.locate(Scalar(x), 5, point) == Status::kOk);  // nearer to the way back at first
    CHECK(path.leg() == 0);
  }
}

TEST_CASE_TEMPLATE("spline: what is refused, warned of, and held at the end", Scalar, float,
                   double) {
  SplinePath<Scalar> path;
  PathPoint<Scalar> point;
  CHECK(path.locate(0, 0, point) == Status::kNotInitialised);
  const Points<Scalar> good = {{0, 0}, {50, 0}, {100, 50}};
  REQUIRE(path.start(good.data(), 3) == Status::kOk);
  CHECK(path.report().problem == PlanProblem::kNone);
  CHECK(path.report().leg == 0);
  const Points<Scalar> twice = {{0, 0}, {50, 0}, {50, 0}};
  CHECK(path.start(twice.data(), 3) == Status::kBadParameter);
  CHECK(path.report().problem == PlanProblem::kTooClose);
  CHECK(path.report().leg == 1);
  const Points<Scalar> nowhere = {{0, 0}, {Scalar(kNan), 0}};
  CHECK(path.start(nowhere.data(), 2) == Status::kNotFinite);
  CHECK(path.start(good.data(), 1) == Status::kBadParameter);
  CHECK(path.locate(Scalar(kNan), 0, point) == Status::kNotFinite);
  REQUIRE(path.locate(10, 1, point) == Status::kOk);  // the old plan goes on
  // A corner that bends on 10 m is too much for a hull that turns on 14.3, not for one on 5.
  const Points<Scalar> bent = {{0, 0}, {100, 0}, {105, 10}, {100, 20}, {0, 20}};
  CHECK(spline(bent, 14.3).report().problem == PlanProblem::kTightLeg);
  CHECK(spline(bent, 14.3).report().leg > 0);
  CHECK(spline(good, 14.3).report().problem == PlanProblem::kNone);
  // The end: north-east.
  auto whole = spline(good);
  for (double s = 0; s <= 1; s += 0.05) {
    REQUIRE(whole.locate(Scalar(50 + 60 * s), Scalar(60 * s), point) == Status::kOk);
  }
  CHECK(whole.finished());
  REQUIRE(whole.locate(130, 80, point) == Status::kOk);
  CHECK(std::fabs(double(point.cross_m)) < 1e-3);
  CHECK(std::fabs(double(whole.remaining_m()) + 30 * std::sqrt(2.0)) < 1e-2);
  CHECK(point.curvature == Scalar(0));
  typename SplinePath<Scalar>::Params wrong;
  wrong.hull_m = -1;
  CHECK(SplinePath<Scalar>(wrong).start(good.data(), 3) == Status::kBadParameter);
}

}  // namespace
