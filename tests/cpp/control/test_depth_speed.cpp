// Speed, depth, pitch: their laws, their loops on simple models, wind-up, refusals.
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <limits>

#include "auvest/control/depth_control.hpp"
#include "auvest/control/pitch_control.hpp"
#include "auvest/control/speed_control.hpp"

namespace {

using auvest::Status;

constexpr double kDegree = 3.14159265358979323846 / 180;

template <class Scalar>
double epsilon(double roundings) {
  return roundings * double(std::numeric_limits<Scalar>::epsilon());
}

TEST_CASE_TEMPLATE("integral: at either limit it takes only what leads away from there", Scalar,
                   float, double) {
  auvest::SpeedControl<Scalar> speed;  // a positive error raises the command
  Scalar out = 0;
  const auto integral_after = [&](double start, double wanted, double measured) {
    REQUIRE(speed.restart(Scalar(start)) == Status::kOk);
    REQUIRE(speed.update(Scalar(wanted), Scalar(measured), Scalar(0.5), out) == Status::kOk);
    return double(speed.integral());
  };
  CHECK(integral_after(1, 1.5, 1) == 1.25);  // within
  CHECK(!speed.saturated());
  CHECK(integral_after(30, 1.5, 1) == 30);  // above, and the error asks for more
  CHECK(speed.saturated());
  CHECK(integral_after(30, 1.5, 2) == 29.75);  // above, and it asks for less
  CHECK(speed.saturated());
  CHECK(integral_after(-30, 1.5, 2) == -30);
  CHECK(speed.saturated());
  CHECK(integral_after(-30, 1.5, 1) == -29.75);
  CHECK(speed.saturated());
}

TEST_CASE_TEMPLATE("speed, depth and pitch: their laws, step by step", Scalar, float, double) {
  auvest::SpeedControl<Scalar> speed;
  auvest::DepthControl<Scalar> depth;
  auvest::PitchControl<Scalar> pitch;
  Scalar rev = 0, theta = 0, plane = 0;
  double speed_sum = 0, depth_sum = 0, pitch_sum = 0;
  for (int k = 0; k < 10; ++k) {
    const double u = 1.4 + 0.02 * k, z = 5.2 - 0.03 * k, t = 0.01 * k - 0.05, q = 0.02 - 0.001 * k;
    REQUIRE(speed.update(Scalar(1.5), Scalar(u), Scalar(0.1), rev) == Status::kOk);
    CHECK(std::fabs(double(rev) - (1.5 / 0.1 + 5 * (1.5 - u) + speed_sum)) < epsilon<Scalar>(64));
    speed_sum += 0.1 * (1.5 - u);
    REQUIRE(depth.update(5, Scalar(z), Scalar(0.1), theta) == Status::kOk);
    CHECK(std::fabs(double(theta) - (0.1 * (z - 5) + 0.005 * depth_sum)) < epsilon<Scalar>(8));
    depth_sum += 0.1 * (z - 5);
    REQUIRE(pitch.update(Scalar(0.02), Scalar(t), Scalar(q), Scalar(0.1), plane) == Status::kOk);
    CHECK(std::fabs(double(plane) - (1.5 * (t - 0.02) + q + 0.2 * pitch_sum)) < epsilon<Scalar>(8));
    pitch_sum += 0.1 * (t - 0.02);
  }
  CHECK(std::fabs(double(speed.integral()) - speed_sum) < epsilon<Scalar>(8));
  CHECK(std::fabs(double(depth.integral()) - depth_sum) < epsilon<Scalar>(8));
  CHECK(std::fabs(double(pitch.integral()) - pitch_sum) < epsilon<Scalar>(8));
}

TEST_CASE_TEMPLATE("limits: the command stops there and says so", Scalar, float, double) {
  auvest::SpeedControl<Scalar> speed;
  auvest::DepthControl<Scalar> depth;
  auvest::PitchControl<Scalar> pitch;
  Scalar out = 0;
  REQUIRE(speed.update(3, 0, 1, out) == Status::kOk);
  CHECK(std::fabs(double(out) - 1525.0 / 60) < epsilon<Scalar>(64));
  CHECK(speed.saturated());
  REQUIRE(speed.update(0, 3, 1, out) == Status::kOk);
  CHECK(out == Scalar(0));  // it does not run backwards
  CHECK(speed.saturated());
  REQUIRE(depth.update(0, 50, 1, out) == Status::kOk);
  CHECK(std::fabs(double(out) - 20 * kDegree) < epsilon<Scalar>(2));  // too deep: nose up
  CHECK(depth.saturated());
  REQUIRE(pitch.update(0, 1, 0, 1, out) == Status::kOk);
  CHECK(std::fabs(double(out) - 15 * kDegree) < epsilon<Scalar>(2));  // nose too high: down
  CHECK(pitch.saturated());
  CHECK(speed.integral() == Scalar(0));
  CHECK(depth.integral() == Scalar(0));
  CHECK(pitch.integral() == Scalar(0));
  REQUIRE(pitch.update(0, 0, 0, 1, out) == Status::kOk);
  CHECK(!pitch.saturated());
}

/// A mass with linear drag: u' = (n c - u) / tau; time until the speed stays within 5 % of 1.5 m/s
/// after so many seconds held fast.
template <class Scalar>
double speed_recovery(double held_for) {
  auvest::SpeedControl<Scalar> control;
  Scalar rev = 0;
  for (int k = 0; k < held_for * 10; ++k) {
    REQUIRE(control.update(Scalar(1.5), Scalar(-2), Scalar(0.1), rev) == Status::kOk);
    CHECK(control.saturated());
  }
  double u = 0, last = 0;
  for (int k = 0; k < 3000; ++k) {
    REQUIRE(control.update(Scalar(1.5), Scalar(u), Scalar(0.1), rev) == Status::kOk);
    for (int i = 0; i < 10; ++i) u += 0.01 * (double(rev) * 0.1 - u) / 5;
    if (std::fabs(u - 1.5) > 0.075) last = 0.1 * k;
  }
  CHECK(std::fabs(u - 1.5) < 1e-4);
  return last;
}

/// A torpedo's vertical plane, z' = -u theta, with pitch following its command with 1 s.
template <class Scalar>
double depth_recovery(double held_for) {
  auvest::DepthControl<Scalar> control;
  Scalar wanted = 0;
  for (int k = 0; k < held_for * 10; ++k) {
    REQUIRE(control.update(5, 15, Scalar(0.1), wanted) == Status::kOk);
    CHECK(control.saturated());
  }
  double z = 15, theta = 0, last = 0;
  for (int k = 0; k < 6000; ++k) {
    REQUIRE(control.update(5, Scalar(z), Scalar(0.1), wanted) == Status::kOk);
    for (int i = 0; i < 10; ++i) {
      z -= 0.01 * 1.5 * std::sin(theta);
      theta += 0.01 * (double(wanted) - theta);
    }
    if (std::fabs(z - 5) > 0.5) last = 0.1 * k;
  }
  CHECK(std::fabs(z - 5) < 1e-3);
  return last;
}

/// A pitch that follows the stern plane, theta'' = -plane - theta' - 0.8 theta + trim.
template <class Scalar>
double pitch_recovery(double held_for) {
  auvest::PitchControl<Scalar> control;
  Scalar plane = 0;
  for (int k = 0; k < held_for * 10; ++k) {
    REQUIRE(control.update(0, Scalar(0.5), 0, Scalar(0.1), plane) == Status::kOk);
    CHECK(control.saturated());
  }
  double theta = 0.15, q = 0, last = 0;
  for (int k = 0; k < 3000; ++k) {
    REQUIRE(control.update(0, Scalar(theta), Scalar(q), Scalar(0.1), plane) == Status::kOk);
    for (int i = 0; i < 10; ++i) {
      theta += 0.01 * q;
      q += 0.01 * (-double(plane) - q - 0.8 * theta + 0.05);
    }
    if (std::fabs(theta) > 0.02) last = 0.1 * k;
  }
  CHECK(std::fabs(theta) < 1e-4);
  return last;
}

TEST_CASE_TEMPLATE("a minute of saturation costs less than one rise time, in each integrator",
                   Scalar, float, double) {
  // Rise times from 10 to 90 %: speed 2 s, depth 20 s (at 20 degrees 10 m take that), pitch 2 s.
  CHECK(std::fabs(speed_recovery<Scalar>(60) - speed_recovery<Scalar>(0)) < 2);
  CHECK(std::fabs(depth_recovery<Scalar>(60) - depth_recovery<Scalar>(0)) < 20);
  CHECK(std::fabs(pitch_recovery<Scalar>(60) - pitch_recovery<Scalar>(0)) < 2);
}

TEST_CASE_TEMPLATE("pitch: the error is the smallest signed angle", Scalar, float, double) {
  auvest::PitchControl<Scalar> control;
  Scalar plane = 0;
  REQUIRE(control.update(Scalar(3.1), Scalar(-3.1), 0, Scalar(0.1), plane) == Status::kOk);
  CHECK(std::fabs(double(plane) - 1.5 * (2 * 180 * kDegree - 6.2)) < epsilon<Scalar>(16));
}

TEST_CASE_TEMPLATE("speed, depth and pitch: what is refused changes nothing", Scalar, float,
                   double) {
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  const Scalar most = std::numeric_limits<Scalar>::max();
  auvest::SpeedControl<Scalar> speed;
  auvest::DepthControl<Scalar> depth;
  auvest::PitchControl<Scalar> pitch;
  REQUIRE(speed.restart(Scalar(0.25)) == Status::kOk);
  REQUIRE(depth.restart(Scalar(0.25)) == Status::kOk);
  REQUIRE(pitch.restart(Scalar(0.25)) == Status::kOk);
  Scalar out = 7;
  CHECK(speed.update(nan, 1, 1, out) == Status::kNotFinite);
  CHECK(speed.update(1, nan, 1, out) == Status::kNotFinite);
  CHECK(speed.update(1, 1, nan, out) == Status::kNotFinite);
  CHECK(speed.update(1, 1, -1, out) == Status::kTimeBackwards);
  CHECK(speed.update(most, 1, 1, out) == Status::kOverflow);
  CHECK(depth.update(nan, 1, 1, out) == Status::kNotFinite);
  CHECK(depth.update(1, nan, 1, out) == Status::kNotFinite);
  CHECK(depth.update(1, 1, -1, out) == Status::kTimeBackwards);
  CHECK(depth.update(-most, most, 1, out) == Status::kOverflow);
  CHECK(pitch.update(nan, 1, 1, 1, out) == Status::kNotFinite);
  CHECK(pitch.update(1, nan, 1, 1, out) == Status::kNotFinite);
  CHECK(pitch.update(1, 1, nan, 1, out) == Status::kNotFinite);
  CHECK(pitch.update(1, 1, 1, -1, out) == Status::kTimeBackwards);
  CHECK(speed.restart(nan) == Status::kNotFinite);
  CHECK(depth.restart(nan) == Status::kNotFinite);
  CHECK(pitch.restart(nan) == Status::kNotFinite);
  CHECK(out == Scalar(7));
  CHECK(speed.integral() == Scalar(0.25));
  CHECK(depth.integral() == Scalar(0.25));
  CHECK(pitch.integral() == Scalar(0.25));

  typename auvest::SpeedControl<Scalar>::Params s;
  s.advance_m = 0;
  CHECK(auvest::SpeedControl<Scalar>(s).update(1, 1, 1, out) == Status::kBadParameter);
  typename auvest::DepthControl<Scalar>::Params d;
  d.max_pitch_rad = nan;
  CHECK(auvest::DepthControl<Scalar>(d).update(1, 1, 1, out) == Status::kBadParameter);
  typename auvest::PitchControl<Scalar>::Params p;
  p.integral = -1;
  CHECK(auvest::PitchControl<Scalar>(p).update(1, 1, 1, 1, out) == Status::kBadParameter);
}

}  // namespace
