// Heading: references, both rudder controllers on Nomoto's model, wrap-around and wind-up.
#include <doctest/doctest.h>

#include <cmath>
#include <complex>
#include <initializer_list>
#include <limits>
#include <vector>

#include "auvest/control/heading_control.hpp"
#include "auvest/control/heading_filter.hpp"
#include "auvest/control/heading_reference.hpp"
#include "auvest/control/heading_sliding_mode.hpp"
#include "auvest/control/reference_model.hpp"

namespace {

using auvest::GuidanceCommand;
using auvest::Reference;
using auvest::Status;

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;

double apart(double a, double b) { return std::fabs(std::remainder(a - b, 2 * kPi)); }

template <class Scalar>
double epsilon(double roundings) {
  return roundings * double(std::numeric_limits<Scalar>::epsilon());
}

template <class Scalar>
Reference<Scalar> reference_at(double value, double rate = 0, double acceleration = 0) {
  Reference<Scalar> reference;
  reference.value = Scalar(value);
  reference.rate = Scalar(rate);
  reference.acceleration = Scalar(acceleration);
  return reference;
}

/// Nomoto's model, T r' + r = K (delta + offset), in steps of 1 ms.
struct Nomoto {
  double heading = 0, rate = 0;
  double time_constant = 1, gain = 0.6, offset = 0;

  void step(double rudder) {
    const double dt = 1e-3;
    heading += dt * rate;
    rate += dt * (gain * (rudder + offset) - rate) / time_constant;
  }
};

template <class Control>
double rudder_of(Control& control, const Reference<typename Control::Scalar>& wanted,
                 const Nomoto& ship, double dt = 1e-3) {
  using Scalar = typename Control::Scalar;
  Scalar rudder = 0;
  REQUIRE(control.update(wanted, Scalar(std::remainder(ship.heading, 2 * kPi)), Scalar(ship.rate),
                         Scalar(1.5), Scalar(dt), rudder) == Status::kOk);
  return double(rudder);
}

/// e(t) of a loop that starts at e = e0, e' = 0 and int e = 0, and follows
/// e''' + a2 e'' + a1 e' + a0 e = 0 with e''(0) as the equation of the loop gives it.
double third_order(double a2, double a1, double a0, double e0, double second, double t) {
  // By small exact steps: the state's Taylor series to the fourth order.
  double y[3] = {e0, 0, second};
  const int steps = 20000;
  const double h = t / steps;
  for (int k = 0; k < steps; ++k) {
    const auto slope = [&](const double* x, double* d) {
      d[0] = x[1];
      d[1] = x[2];
      d[2] = -a2 * x[2] - a1 * x[1] - a0 * x[0];
    };
    double k1[3], k2[3], k3[3], k4[3], w[3];
    slope(y, k1);
    for (int i = 0; i < 3; ++i) w[i] = y[i] + h / 2 * k1[i];
    slope(w, k2);
    for (int i = 0; i < 3; ++i) w[i] = y[i] + h / 2 * k2[i];
    slope(w, k3);
    for (int i = 0; i < 3; ++i) w[i] = y[i] + h * k3[i];
    slope(w, k4);
    for (int i = 0; i < 3; ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  return y[0];
}

TEST_CASE_TEMPLATE("heading PID: on its own model the error has the polynomial that is stated",
                   Scalar, float, double) {
  // share 1: s^3 + 2 zeta w s^2 + w^2 s + w^3/10; share 0 adds 1/T to the second coefficient.
  for (const double share : {0.0, 0.4, 1.0}) {
    typename auvest::HeadingControl<Scalar>::Params p;
    p.share = Scalar(share);
    auvest::HeadingControl<Scalar> control(p);
    Nomoto ship;
    ship.heading = 0.1;
    const double w = 0.8, a2 = 2 * w + (1 - share), a1 = w * w, a0 = w * w * w / 10;
    for (int k = 0; k < 5000; ++k) {
      ship.step(rudder_of(control, reference_at<Scalar>(0), ship));
      CHECK(!control.saturated());
    }
    // T e'' = -2 zeta w e' - w^2 e ... at the start: e''(0) = -w^2 e0.
    const double closed = third_order(a2, a1, a0, 0.1, -w * w * 0.1, 5);
    CHECK(std::fabs(ship.heading - closed) < 2e-4);  // Euler of 1 ms; 0.1 rad at the start
  }
}

TEST_CASE("heading PID: the poles of the defaults, with the hull's own damping kept") {
  // s^3 + 2.6 s^2 + 0.64 s + 0.0512: -2.3353 and -0.1323 +- 0.0664 i.
  const auvest::HeadingControl<double> control;
  const auto& p = control.params();
  const double a2 = 2 * p.damping * p.frequency_rad_s + (1 - p.share) / p.time_constant_s;
  const double w = p.frequency_rad_s;
  for (const std::complex<double> s :
       {std::complex<double>(-2.3353, 0), std::complex<double>(-0.1323, 0.0664)}) {
    const auto value = ((s + a2) * s + w * w) * s + w * w * w / 10;
    const auto slope = (3.0 * s + 2 * a2) * s + w * w;
    CHECK(std::abs(value / slope) < 1e-4);
  }
}

TEST_CASE_TEMPLATE("sliding mode: within the layer its polynomial, outside it falls in", Scalar,
                   float, double) {
  auvest::HeadingSlidingMode<Scalar> control;
  const auto& p = control.params();
  const double l = double(p.bandwidth_rad_s);
  const double fall = 1 + double(p.damping) + double(p.switching_rad_s) / double(p.boundary_rad_s);
  Nomoto ship;
  ship.heading = 0.05;  // s = 2 l e = 0.03, inside the layer of 0.1
  double integral = 0;
  for (int k = 0; k < 3000; ++k) {
    const double error = ship.heading;
    ship.step(rudder_of(control, reference_at<Scalar>(0), ship));
    integral += 1e-3 * error;
    const double surface = ship.rate + 2 * l * ship.heading + l * l * integral;
    if (k % 500 == 0) {
      const double t = (k + 1) * 1e-3;
      CHECK(std::fabs(surface - 0.03 * std::exp(-fall * t)) < 1e-4);  // T = 1
    }
  }
  // A disturbance of the rudder by less than K_s is held; without the integral it could not be.
  ship.offset = 0.05;
  for (int k = 0; k < 60000; ++k) ship.step(rudder_of(control, reference_at<Scalar>(0), ship));
  CHECK(std::fabs(ship.heading) < (sizeof(Scalar) == 4 ? 1e-4 : 1e-6));
}

template <class Control>
void check_step_through_south() {
  using Scalar = typename Control::Scalar;
  // From 170 to -170 degrees: 20 degrees through 180, not 340 back through north.
  Control control;
  auvest::HeadingReference<Scalar> shaping;
  REQUIRE(shaping.restart(Scalar(170 * kDegree)) == Status::kOk);
  GuidanceCommand<Scalar> wanted;
  wanted.heading_rad = Scalar(-170 * kDegree);
  Nomoto ship;
  ship.heading = 170 * kDegree;
  Reference<Scalar> reference;
  double lowest = ship.heading, travel = 0, highest_rate = 0;
  for (int k = 0; k < 60000; ++k) {
    if (k % 100 == 0) {
      REQUIRE(shaping.update(wanted, Scalar(0.1), reference) == Status::kOk);
      CHECK(std::fabs(double(reference.value)) <= kPi + 1e-6);
      highest_rate = std::fmax(highest_rate, std::fabs(double(reference.rate)));
    }
    const double before = ship.heading;
    ship.step(rudder_of(control, reference, ship));
    lowest = std::fmin(lowest, ship.heading);
    travel += std::fabs(ship.heading - before);
  }
  CHECK(lowest >= 170 * kDegree - 1e-9);
  CHECK(std::fabs(ship.heading - 190 * kDegree) < 1e-3);
  CHECK(travel > 19.9 * kDegree);
  CHECK(travel < 26 * kDegree);  // the overshoot there and back
  CHECK(highest_rate <= 6 * kDegree + 1e-6);
}

TEST_CASE_TEMPLATE("heading: a step from 170 to -170 degrees goes through 180", Scalar, float,
                   double) {
  check_step_through_south<auvest::HeadingControl<Scalar>>();
  check_step_through_south<auvest::HeadingSlidingMode<Scalar>>();
}

TEST_CASE_TEMPLATE("reference of first order: moves first, then the rate once more", Scalar, float,
                   double) {
  auvest::HeadingReference<Scalar> shaping;
  REQUIRE(shaping.restart(3) == Status::kOk);
  GuidanceCommand<Scalar> wanted;
  wanted.heading_rad = Scalar(-3);  // 0.2832 rad on, through pi
  wanted.rate_rad_s = Scalar(0.02);
  Reference<Scalar> reference;
  REQUIRE(shaping.update(wanted, Scalar(0.1), reference) == Status::kOk);
  // 0.02 + 0.2832 is clipped to 6 deg/s, and is still so after 0.1 s.
  CHECK(apart(double(reference.value), 3 + 0.1 * 6 * kDegree) < epsilon<Scalar>(8));
  CHECK(std::fabs(double(reference.rate) - 6 * kDegree) < epsilon<Scalar>(8));
  CHECK(reference.acceleration == Scalar(0));
  // Close by: psi_d += dt (kappa U + error), then r_d from the error that is left.
  REQUIRE(shaping.restart(Scalar(kPi - 0.01)) == Status::kOk);
  wanted.heading_rad = Scalar(-kPi + 0.01);
  REQUIRE(shaping.update(wanted, Scalar(0.1), reference) == Status::kOk);
  const double moved = 0.1 * (0.02 + 0.02);
  CHECK(apart(double(reference.value), kPi - 0.01 + moved) < epsilon<Scalar>(16));
  CHECK(std::fabs(double(reference.rate) - (0.02 + 0.02 - moved)) < epsilon<Scalar>(16));
}

TEST_CASE_TEMPLATE("reference model: its step response, the short way round", Scalar, float,
                   double) {
  // All three poles at -w for zeta = 1: x = 1 - (1 + wt + (wt)^2/2) e^-wt.
  typename auvest::ReferenceModel<Scalar>::Params p;
  p.max_rate = 10;
  auvest::ReferenceModel<Scalar> model(p);
  const double start = 170 * kDegree;
  REQUIRE(model.restart(Scalar(start)) == Status::kOk);
  Reference<Scalar> reference;
  double t = 0;
  for (int k = 0; k < 10000; ++k) {
    REQUIRE(model.update(Scalar(-170 * kDegree), Scalar(1e-3), reference) == Status::kOk);
    t += 1e-3;
    if (k % 1000 == 999) {
      const double wt = 0.5 * t;
      const double x = 20 * kDegree * (1 - (1 + wt + wt * wt / 2) * std::exp(-wt));
      CHECK(apart(double(reference.value), start + x) < 4e-4);  // Euler of 1 ms, 0.35 rad
      CHECK(std::fabs(double(reference.value)) <= kPi + 1e-6);
    }
  }
  // A length is not wrapped.
  auvest::ReferenceModel<Scalar, false> depth(
      typename auvest::ReferenceModel<Scalar, false>::Params{});
  REQUIRE(depth.restart(20) == Status::kOk);
  CHECK(depth.state().value == Scalar(20));
}

TEST_CASE_TEMPLATE("reference model: at its rate limit nothing winds up", Scalar, float, double) {
  // 90 degrees at 6 deg/s at most: 15 s of travel, and no overshoot whatever was asked meanwhile.
  auvest::ReferenceModel<Scalar> model;
  REQUIRE(model.restart(0) == Status::kOk);
  Reference<Scalar> reference;
  double highest = 0, arrived = 0;
  for (int k = 1; k <= 600; ++k) {
    REQUIRE(model.update(Scalar(kPi / 2), Scalar(0.1), reference) == Status::kOk);
    CHECK(std::fabs(double(reference.rate)) <= 6 * kDegree + 1e-6);
    highest = std::fmax(highest, double(reference.value));
    if (arrived == 0 && double(reference.value) > 0.99 * kPi / 2) arrived = 0.1 * k;
    // Rate and acceleration are those of the value, at the limit too.
    if (k > 1 && std::fabs(double(reference.rate)) > 6 * kDegree - 1e-7) {
      CHECK(std::fabs(double(reference.acceleration)) < 0.05);
    }
  }
  CHECK(highest < kPi / 2 * 1.001);
  CHECK(arrived > 15);
  CHECK(arrived < 24);  // of the free model: 16.8 s
  CHECK(std::fabs(double(reference.value) - kPi / 2) < 1e-5);
}

/// Time until the error stays below a tenth of the step, of 0.3 rad, after so many seconds in
/// which the rudder could not do what was asked.
template <class Control>
double recovery(double saturated_for) {
  using Scalar = typename Control::Scalar;
  Control control;
  Nomoto ship;
  ship.heading = -0.3;
  // Held fast at an error of 1 rad with the rudder at its limit.
  Nomoto held;
  held.heading = -1;
  for (int k = 0; k < saturated_for * 1000; ++k) {
    rudder_of(control, reference_at<Scalar>(0), held);
    CHECK(control.saturated());
  }
  double last = 0;
  for (int k = 0; k < 100000; ++k) {
    ship.step(rudder_of(control, reference_at<Scalar>(0), ship));
    if (std::fabs(ship.heading) > 0.03) last = 1e-3 * k;
  }
  return last;
}

TEST_CASE_TEMPLATE("heading: a minute of saturation costs less than one rise time", Scalar, float,
                   double) {
  // Rise time of the loops from 10 to 90 %: some 5 s.
  CHECK(recovery<auvest::HeadingControl<Scalar>>(60) - recovery<auvest::HeadingControl<Scalar>>(0) <
        5);
  CHECK(recovery<auvest::HeadingSlidingMode<Scalar>>(60) -
            recovery<auvest::HeadingSlidingMode<Scalar>>(0) <
        5);
}

TEST_CASE_TEMPLATE("heading PID: the integral takes what leads away from a limit", Scalar, float,
                   double) {
  auvest::HeadingControl<Scalar> control;
  Scalar rudder = 0;
  const auto update = [&](double heading, double rate) {
    REQUIRE(control.update(reference_at<Scalar>(0), Scalar(heading), Scalar(rate), Scalar(1.5),
                           Scalar(0.5), rudder) == Status::kOk);
  };
  update(-0.1, 0);
  CHECK(!control.saturated());
  CHECK(std::fabs(double(control.integral()) + 0.05) < epsilon<Scalar>(1));
  update(-1, 0);  // rudder hard to starboard, and the error wants more of it
  CHECK(control.saturated());
  CHECK(rudder == control.params().max_rudder_rad);
  CHECK(std::fabs(double(control.integral()) + 0.05) < epsilon<Scalar>(1));
  update(0.2, -1);  // still hard to starboard, for the rate; the error now asks for less
  CHECK(control.saturated());
  CHECK(rudder == control.params().max_rudder_rad);
  CHECK(std::fabs(double(control.integral()) - 0.05) < epsilon<Scalar>(1));
}

TEST_CASE_TEMPLATE("steering: the gain goes with the square of the speed, down to the slowest",
                   Scalar, float, double) {
  auvest::Steering<Scalar> steering;
  CHECK(steering.gain_at(3) == Scalar(0.6));  // not scheduled
  steering.slowest_m_s = Scalar(0.5);
  CHECK(std::fabs(double(steering.gain_at(3)) - 2.4) < epsilon<Scalar>(4));
  CHECK(std::fabs(double(steering.gain_at(Scalar(1.5))) - 0.6) < epsilon<Scalar>(1));
  CHECK(std::fabs(double(steering.gain_at(Scalar(0.1))) - 0.6 / 9) < epsilon<Scalar>(1));
  typename auvest::HeadingControl<Scalar>::Params p;
  p.slowest_m_s = Scalar(0.5);
  auvest::HeadingControl<Scalar> control(p);
  Scalar slow = 0, fast = 0;
  REQUIRE(control.update(reference_at<Scalar>(0), Scalar(0.01), 0, Scalar(1.5), 0, slow) ==
          Status::kOk);
  REQUIRE(control.update(reference_at<Scalar>(0), Scalar(0.01), 0, 3, 0, fast) == Status::kOk);
  CHECK(std::fabs(double(slow / fast) - 4) < epsilon<Scalar>(16));
}

TEST_CASE_TEMPLATE("heading filter: the compass slowly, the gyro at once, around the circle",
                   Scalar, float, double) {
  auvest::HeadingFilter<Scalar> filter;
  CHECK(filter.predict(0, 1) == Status::kNotInitialised);
  CHECK(filter.update(0) == Status::kNotInitialised);
  REQUIRE(filter.restart(Scalar(3.1)) == Status::kOk);
  REQUIRE(filter.predict(Scalar(0.5), Scalar(0.1)) == Status::kOk);
  CHECK(apart(double(filter.heading_rad()), 3.15) < epsilon<Scalar>(4));
  CHECK(double(filter.heading_rad()) < 0);             // past pi
  REQUIRE(filter.update(Scalar(3.1)) == Status::kOk);  // a twentieth of the way back over the cut
  CHECK(apart(double(filter.heading_rad()), 3.15 - 0.05 * 0.05) < epsilon<Scalar>(8));
  // A compass that stays where it is is approached by 0.95 per reading.
  REQUIRE(filter.restart(0) == Status::kOk);
  for (int k = 0; k < 30; ++k) {
    REQUIRE(filter.predict(0, Scalar(0.1)) == Status::kOk);
    REQUIRE(filter.update(1) == Status::kOk);
  }
  CHECK(std::fabs(double(filter.heading_rad()) - (1 - std::pow(0.95, 30))) < epsilon<Scalar>(16));
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  const Scalar before = filter.heading_rad();
  CHECK(filter.update(nan) == Status::kNotFinite);
  CHECK(filter.predict(nan, 1) == Status::kNotFinite);
  CHECK(filter.predict(0, -1) == Status::kTimeBackwards);
  CHECK(filter.restart(nan) == Status::kNotFinite);
  CHECK(filter.heading_rad() == before);
  typename auvest::HeadingFilter<Scalar>::Params p;
  p.share = Scalar(1.5);
  CHECK(auvest::HeadingFilter<Scalar>(p).check() == Status::kBadParameter);
}

template <class Control>
void check_refusals() {
  using Scalar = typename Control::Scalar;
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  Control control;
  REQUIRE(control.restart(Scalar(0.25)) == Status::kOk);
  Scalar rudder = 7;
  const auto good = reference_at<Scalar>(0);
  CHECK(control.update(reference_at<Scalar>(std::nan("")), 0, 0, 1, 1, rudder) ==
        Status::kNotFinite);
  CHECK(control.update(reference_at<Scalar>(0, std::nan("")), 0, 0, 1, 1, rudder) ==
        Status::kNotFinite);
  CHECK(control.update(good, nan, 0, 1, 1, rudder) == Status::kNotFinite);
  CHECK(control.update(good, 0, nan, 1, 1, rudder) == Status::kNotFinite);
  CHECK(control.update(good, 0, 0, nan, 1, rudder) == Status::kNotFinite);
  CHECK(control.update(good, 0, 0, 1, nan, rudder) == Status::kNotFinite);
  CHECK(control.update(good, 0, 0, 1, -1, rudder) == Status::kTimeBackwards);
  CHECK(control.update(good, 0, std::numeric_limits<Scalar>::max(), 1, 1, rudder) ==
        Status::kOverflow);
  CHECK(control.restart(nan) == Status::kNotFinite);
  CHECK(rudder == Scalar(7));
  CHECK(control.integral() == Scalar(0.25));
  typename Control::Params p;
  p.gain = 0;
  Control wrong(p);
  CHECK(wrong.check() == Status::kBadParameter);
  CHECK(wrong.update(good, 0, 0, 1, 1, rudder) == Status::kBadParameter);
}

TEST_CASE_TEMPLATE("heading: what is refused changes nothing", Scalar, float, double) {
  check_refusals<auvest::HeadingControl<Scalar>>();
  check_refusals<auvest::HeadingSlidingMode<Scalar>>();
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  auvest::HeadingReference<Scalar> shaping;
  REQUIRE(shaping.restart(Scalar(0.5)) == Status::kOk);
  GuidanceCommand<Scalar> wanted;
  Reference<Scalar> reference = reference_at<Scalar>(7);
  wanted.heading_rad = nan;
  CHECK(shaping.update(wanted, 1, reference) == Status::kNotFinite);
  wanted.heading_rad = 0;
  CHECK(shaping.update(wanted, -1, reference) == Status::kTimeBackwards);
  CHECK(shaping.restart(nan) == Status::kNotFinite);
  CHECK(shaping.heading_rad() == Scalar(0.5));
  auvest::ReferenceModel<Scalar> model;
  REQUIRE(model.restart(Scalar(0.5)) == Status::kOk);
  CHECK(model.update(nan, 1, reference) == Status::kNotFinite);
  CHECK(model.update(0, -1, reference) == Status::kTimeBackwards);
  CHECK(reference.value == Scalar(7));
  CHECK(model.update(3, 0, reference) == Status::kOk);  // no time: it stays where it is
  CHECK(reference.value == Scalar(0.5));
  reference = reference_at<Scalar>(7);
  CHECK(model.restart(nan) == Status::kNotFinite);
  CHECK(model.state().value == Scalar(0.5));
  CHECK(reference.value == Scalar(7));
  typename auvest::ReferenceModel<Scalar>::Params p;
  p.max_rate = 0;
  auvest::ReferenceModel<Scalar> wrong(p);
  CHECK(wrong.check() == Status::kBadParameter);
  CHECK(wrong.update(0, 1, reference) == Status::kBadParameter);
  CHECK(reference.value == Scalar(7));
}

}  // namespace
