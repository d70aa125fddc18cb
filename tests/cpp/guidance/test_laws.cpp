// The guidance laws: closed forms, where they come to rest in a current, and what they refuse.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <initializer_list>
#include <limits>

#include "auvest/guidance/adaptive_line_of_sight.hpp"
#include "auvest/guidance/circle.hpp"
#include "auvest/guidance/crab_feed_forward.hpp"
#include "auvest/guidance/integral_line_of_sight.hpp"
#include "auvest/guidance/line.hpp"
#include "auvest/guidance/line_of_sight.hpp"
#include "auvest/guidance/vector_field.hpp"
#include "auvest/guidance/vertical_line_of_sight.hpp"

namespace {

using auvest::GuidanceCommand;
using auvest::PathPoint;
using auvest::Status;

constexpr double kPi = 3.14159265358979323846;

double apart(double a, double b) { return std::fabs(std::remainder(a - b, 2 * kPi)); }

template <class Scalar>
double tolerance(double roundings) {
  return roundings * double(std::numeric_limits<Scalar>::epsilon());
}

template <class Scalar>
PathPoint<Scalar> point_at(double direction, double cross, double curvature = 0) {
  PathPoint<Scalar> point;
  point.direction_rad = Scalar(direction);
  point.sine = Scalar(std::sin(direction));
  point.cosine = Scalar(std::cos(direction));
  point.along_m = Scalar(0);
  point.cross_m = Scalar(cross);
  point.curvature = Scalar(curvature);
  return point;
}

/// The heading that a law gives with its memory as it is.
template <class Law, class Scalar>
double heading_of(Law& law, const PathPoint<Scalar>& point, double speed = 1.5) {
  GuidanceCommand<Scalar> command;
  REQUIRE(law.update(point, Scalar(speed), Scalar(0), command) == Status::kOk);
  CHECK(double(command.heading_rad) <= kPi + 1e-7);
  CHECK(double(command.heading_rad) > -kPi - 1e-7);
  return double(command.heading_rad);
}

TEST_CASE_TEMPLATE("laws: their closed forms, around the circle", Scalar, float, double) {
  auvest::LineOfSight<Scalar> sight;
  typename auvest::VectorField<Scalar>::Params field_params;
  field_params.approach_rad = Scalar(1.2);
  field_params.gain = Scalar(0.2);
  auvest::VectorField<Scalar> field(field_params);
  auvest::IntegralLineOfSight<Scalar> integral;
  REQUIRE(integral.restart(3) == Status::kOk);
  auvest::AdaptiveLineOfSight<Scalar> adaptive;
  REQUIRE(adaptive.restart(Scalar(0.1)) == Status::kOk);
  auvest::CrabFeedForward<Scalar> crab;
  REQUIRE(crab.set_current(Scalar(0.2), Scalar(-0.3)) == Status::kOk);
  const double bound = tolerance<Scalar>(8);
  for (int k = -12; k <= 12; ++k) {
    const double direction = kPi * k / 12;
    for (const double e : {-300.0, -4.0, 0.0, 0.3, 25.0}) {
      const auto p = point_at<Scalar>(direction, e);
      CHECK(apart(heading_of(sight, p), direction - std::atan(e / 10)) < bound);
      CHECK(apart(heading_of(field, p), direction - 1.2 * 2 / kPi * std::atan(0.2 * e)) < bound);
      CHECK(apart(heading_of(integral, p), direction - std::atan((e + 1.5) / 10)) < bound);
      CHECK(apart(heading_of(adaptive, p), direction - 0.1 - std::atan(e / 10)) < bound);
      const double across = -0.2 * std::sin(direction) - 0.3 * std::cos(direction);
      CHECK(apart(heading_of(crab, p), direction - std::asin(across / 1.5) - std::atan(e / 10)) <
            bound);
    }
  }
}

TEST_CASE_TEMPLATE("laws: on a curve the feed-forward is the yaw rate that follows it", Scalar,
                   float, double) {
  auvest::LineOfSight<Scalar> law;
  GuidanceCommand<Scalar> command;
  REQUIRE(law.update(point_at<Scalar>(1, 2, -0.025), Scalar(1.5), Scalar(0.1), command) ==
          Status::kOk);
  CHECK(double(command.rate_rad_s) == close_to(-0.0375, 1e-6));
}

TEST_CASE_TEMPLATE("integral and adaptive laws: their memories follow their equations", Scalar,
                   float, double) {
  auvest::IntegralLineOfSight<Scalar> integral;
  auvest::AdaptiveLineOfSight<Scalar> adaptive;
  auvest::VerticalLineOfSight<Scalar> vertical;
  GuidanceCommand<Scalar> command;
  Scalar pitch = 0;
  double ei = 0, b = 0, a = 0;
  for (int k = 0; k < 40; ++k) {
    const double e = 6 - 0.4 * k;
    REQUIRE(integral.update(point_at<Scalar>(0, e), 1, Scalar(0.1), command) == Status::kOk);
    CHECK(std::fabs(double(command.heading_rad) + std::atan((e + 0.5 * ei) / 10)) <
          tolerance<Scalar>(16));
    ei += 0.1 * 10 * e / (100 + (e + 0.5 * ei) * (e + 0.5 * ei));
    // The old b in the heading, then the new one.
    REQUIRE(adaptive.update(point_at<Scalar>(0, e), 1, Scalar(0.1), command) == Status::kOk);
    CHECK(std::fabs(double(command.heading_rad) + b + std::atan(e / 10)) < tolerance<Scalar>(16));
    b += 0.1 * 0.008 * 10 * e / std::sqrt(100 + e * e);
    REQUIRE(vertical.update(Scalar(0.2), Scalar(e), Scalar(0.1), pitch) == Status::kOk);
    CHECK(std::fabs(double(pitch) - (0.2 + a + std::atan(e / 10))) < tolerance<Scalar>(16));
    a += 0.1 * 0.008 * 10 * e / std::sqrt(100 + e * e);
  }
  CHECK(std::fabs(double(integral.integral()) - ei) < tolerance<Scalar>(40));
  CHECK(std::fabs(double(adaptive.crab_rad()) - b) < tolerance<Scalar>(8));
  CHECK(std::fabs(double(vertical.attack_rad()) - a) < tolerance<Scalar>(8));
}

/// Where a vehicle that takes on each heading at once comes to rest beside a line, in a current of
/// 0.3 m/s across it, at 1.5 m/s through the water: the cross-track error.
template <class Law>
double rest_in_current(Law& law, double seconds) {
  using Scalar = typename Law::Scalar;
  const double direction = 2.9;  // so that headings pass through pi
  auvest::Line<Scalar> line;
  REQUIRE(line.aim(0, 0, Scalar(1000 * std::cos(direction)), Scalar(1000 * std::sin(direction))) ==
          Status::kOk);
  const double cx = -0.3 * std::sin(direction), cy = 0.3 * std::cos(direction);  // to starboard
  double x = 0, y = 0;
  GuidanceCommand<Scalar> command;
  for (double t = 0; t < seconds; t += 0.1) {
    REQUIRE(law.update(line.locate(Scalar(x), Scalar(y)), Scalar(1.5), Scalar(0.1), command) ==
            Status::kOk);
    x += 0.1 * (1.5 * std::cos(double(command.heading_rad)) + cx);
    y += 0.1 * (1.5 * std::sin(double(command.heading_rad)) + cy);
  }
  return double(line.locate(Scalar(x), Scalar(y)).cross_m);
}

TEST_CASE_TEMPLATE("laws in a current: line of sight drifts, the others come to the line", Scalar,
                   float, double) {
  const double bound = sizeof(Scalar) == 4 ? 2e-3 : 1e-6;  // positions of 600 m in float
  // At rest the heading holds against the current: 1.5 sin(atan(e/Delta)) = 0.3.
  auvest::LineOfSight<Scalar> sight;
  CHECK(std::fabs(rest_in_current(sight, 300) - 10 * std::tan(std::asin(0.2))) < bound);
  auvest::IntegralLineOfSight<Scalar> integral;
  CHECK(std::fabs(rest_in_current(integral, 400)) < bound);
  CHECK(std::fabs(double(integral.integral()) * 0.5 - 10 * std::tan(std::asin(0.2))) < 10 * bound);
  auvest::AdaptiveLineOfSight<Scalar> adaptive;
  CHECK(std::fabs(rest_in_current(adaptive, 400)) < bound);
  CHECK(std::fabs(double(adaptive.crab_rad()) - std::asin(0.2)) < bound);
  auvest::CrabFeedForward<Scalar> crab;
  REQUIRE(crab.set_current(Scalar(-0.3 * std::sin(2.9)), Scalar(0.3 * std::cos(2.9))) ==
          Status::kOk);
  CHECK(std::fabs(rest_in_current(crab, 300)) < bound);
}

TEST_CASE(
    "adaptive law: near the line of second order, frequency sqrt(U gamma), damping as stated") {
  // For small e: e' = U (-b - e/Delta), b' = gamma e (no current): e'' + U/Delta e' + U gamma e =
  // 0.
  auvest::AdaptiveLineOfSight<double> law;
  const double u = 1.5, w = std::sqrt(u * 0.008), zeta = u / 10 / (2 * w);
  CHECK(zeta == close_to(0.685, 1e-3));
  GuidanceCommand<double> command;
  double e = 1e-4;
  const double dt = 1e-3;
  for (int k = 0; k < 30000; ++k) {
    REQUIRE(law.update(point_at<double>(0, e), u, dt, command) == Status::kOk);
    e += dt * u * std::sin(command.heading_rad);
  }
  const double wd = w * std::sqrt(1 - zeta * zeta), t = 30;
  // e(0) = e0, e'(0) = -U e0 / Delta.
  const double s = (-u / 10 + zeta * w) / wd;
  const double closed = 1e-4 * std::exp(-zeta * w * t) * (std::cos(wd * t) + s * std::sin(wd * t));
  CHECK(std::fabs(e - closed) < 1e-8);  // Euler of 1 ms
}

TEST_CASE_TEMPLATE("laws: limits", Scalar, float, double) {
  auvest::AdaptiveLineOfSight<Scalar> adaptive;
  GuidanceCommand<Scalar> command;
  for (int k = 0; k < 2000; ++k) {
    REQUIRE(adaptive.update(point_at<Scalar>(0, -40), 1, Scalar(0.1), command) == Status::kOk);
  }
  CHECK(adaptive.crab_rad() == Scalar(-0.5));
  REQUIRE(adaptive.restart(2) == Status::kOk);
  CHECK(adaptive.crab_rad() == Scalar(0.5));

  // A current that the vehicle cannot hold against, or no speed: the ratio stays at its limit.
  auvest::CrabFeedForward<Scalar> crab;
  REQUIRE(crab.set_current(0, 5) == Status::kOk);
  CHECK(std::fabs(heading_of(crab, point_at<Scalar>(0, 0)) + std::asin(0.9)) < 1e-6);
  CHECK(std::fabs(heading_of(crab, point_at<Scalar>(0, 0), 0) + std::asin(0.9)) < 1e-6);
  REQUIRE(crab.set_current(0, -5) == Status::kOk);
  CHECK(std::fabs(heading_of(crab, point_at<Scalar>(0, 0)) - std::asin(0.9)) < 1e-6);
  REQUIRE(crab.set_current(0, 0) == Status::kOk);
  CHECK(heading_of(crab, point_at<Scalar>(0, 0), 0) == 0);

  // Absurdly far away: aim at the path at a right angle, all numbers finite.
  auvest::IntegralLineOfSight<Scalar> integral;
  const double far = double(std::numeric_limits<Scalar>::max()) / 4;
  REQUIRE(integral.update(point_at<Scalar>(0, far), 1, Scalar(0.1), command) == Status::kOk);
  CHECK(std::fabs(double(command.heading_rad) + kPi / 2) < 1e-6);
  CHECK(std::isfinite(double(integral.integral())));
  REQUIRE(adaptive.update(point_at<Scalar>(0, -far), 1, Scalar(0.1), command) == Status::kOk);
  CHECK(std::isfinite(double(adaptive.crab_rad())));
}

TEST_CASE_TEMPLATE("laws: what is refused changes nothing", Scalar, float, double) {
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  auvest::AdaptiveLineOfSight<Scalar> law;
  REQUIRE(law.restart(Scalar(0.25)) == Status::kOk);
  GuidanceCommand<Scalar> command;
  command.heading_rad = 7;
  command.rate_rad_s = 8;
  const auto good = point_at<Scalar>(0.5, 3);
  auto bad = good;
  bad.cross_m = nan;
  CHECK(law.update(bad, 1, Scalar(0.1), command) == Status::kNotFinite);
  bad = good;
  bad.direction_rad = std::numeric_limits<Scalar>::infinity();
  CHECK(law.update(bad, 1, Scalar(0.1), command) == Status::kNotFinite);
  CHECK(law.update(good, nan, Scalar(0.1), command) == Status::kNotFinite);
  CHECK(law.update(good, 1, nan, command) == Status::kNotFinite);
  CHECK(law.update(good, 1, Scalar(-0.1), command) == Status::kTimeBackwards);
  CHECK(law.update(good, -1, Scalar(0.1), command) == Status::kBadParameter);
  bad = good;
  bad.curvature = std::numeric_limits<Scalar>::max();
  CHECK(law.update(bad, 10, Scalar(0.1), command) == Status::kOverflow);
  CHECK(law.restart(nan) == Status::kNotFinite);
  CHECK(law.crab_rad() == Scalar(0.25));
  CHECK(command.heading_rad == Scalar(7));
  CHECK(command.rate_rad_s == Scalar(8));

  auvest::IntegralLineOfSight<Scalar> integral;
  REQUIRE(integral.restart(Scalar(0.25)) == Status::kOk);
  CHECK(integral.restart(nan) == Status::kNotFinite);
  CHECK(integral.integral() == Scalar(0.25));

  auvest::CrabFeedForward<Scalar> crab;
  REQUIRE(crab.set_current(0, Scalar(0.3)) == Status::kOk);
  const double before = heading_of(crab, good);
  CHECK(crab.set_current(nan, 0) == Status::kNotFinite);
  CHECK(heading_of(crab, good) == before);

  auvest::VerticalLineOfSight<Scalar> vertical;
  Scalar pitch = 7;
  CHECK(vertical.update(0, nan, Scalar(0.1), pitch) == Status::kNotFinite);
  CHECK(vertical.update(0, 1, -1, pitch) == Status::kTimeBackwards);
  CHECK(pitch == Scalar(7));
  CHECK(vertical.attack_rad() == Scalar(0));
}

template <class Law, class Change>
void check_refused(Change&& change) {
  typename Law::Params params;
  change(params);
  Law law(params);
  CHECK(law.check() == Status::kBadParameter);
  GuidanceCommand<typename Law::Scalar> command;
  CHECK(law.update(point_at<typename Law::Scalar>(0, 1), 1, 1, command) == Status::kBadParameter);
}

TEST_CASE_TEMPLATE("laws: parameters out of range", Scalar, float, double) {
  using Sight = auvest::LineOfSight<Scalar>;
  using Integral = auvest::IntegralLineOfSight<Scalar>;
  using Adaptive = auvest::AdaptiveLineOfSight<Scalar>;
  using Crab = auvest::CrabFeedForward<Scalar>;
  using Field = auvest::VectorField<Scalar>;
  check_refused<Sight>([](typename Sight::Params& p) { p.lookahead_m = 0; });
  check_refused<Integral>([](typename Integral::Params& p) { p.gain_m_s = Scalar(-0.1); });
  check_refused<Adaptive>([](typename Adaptive::Params& p) { p.adaptation = Scalar(-0.1); });
  check_refused<Adaptive>([](typename Adaptive::Params& p) { p.limit_rad = Scalar(NAN); });
  check_refused<Crab>([](typename Crab::Params& p) { p.limit = Scalar(1.1); });
  check_refused<Field>([](typename Field::Params& p) { p.approach_rad = Scalar(1.6); });
  check_refused<Field>([](typename Field::Params& p) { p.gain = 0; });
}

}  // namespace
