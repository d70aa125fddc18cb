// The pilot: what it does with sensors that are silent, readings that cannot be true, fixes that
// are late, and a plan that ends. That it steers as the closed loop does is tested in Python, to
// the bit (tests/python/test_vehicle_in_the_loop.py).
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "auvest/mission/pilot.hpp"

namespace {

using auvest::PilotMode;
using auvest::Status;

template <class Scalar>
constexpr Scalar nan_of() {
  return std::numeric_limits<Scalar>::quiet_NaN();
}

template <class Scalar>
const auvest::Waypoint<Scalar>* plan() {
  static const auvest::Waypoint<Scalar> points[] = {{0, 0}, {30, 0}, {30, 30}};
  return points;
}

template <class Scalar>
typename auvest::Pilot<Scalar>::Params settings() {
  typename auvest::Pilot<Scalar>::Params p;
  p.sonar.station_x_m = p.sonar.station_y_m = -50;
  p.sonar.sigma_range_m = Scalar(0.3);
  p.sonar.sigma_bearing_rad = Scalar(0.02);
  return p;
}

template <class Pilot>
Pilot started(const typename Pilot::Params& params,
              const typename Pilot::Policy& policy = typename Pilot::Policy()) {
  Pilot pilot(params, policy);
  REQUIRE(pilot.start(plan<typename Pilot::Scalar>(), 3, 0, 0, 0) == Status::kOk);
  return pilot;
}

/// A vehicle that goes north at 1.5 m/s, 5 m deep, and is heard by all its sensors.
template <class Scalar>
auvest::PilotReadings<Scalar> steady() {
  auvest::PilotReadings<Scalar> r;
  r.speed_m_s = Scalar(1.5);
  r.depth_m = 5;
  r.heard = 15;
  return r;
}

template <class Pilot>
auvest::TorpedoCommand<typename Pilot::Scalar> step(
    Pilot& pilot, const auvest::PilotReadings<typename Pilot::Scalar>& readings) {
  using Scalar = typename Pilot::Scalar;
  auvest::TorpedoCommand<Scalar> command;
  REQUIRE(pilot.predict(readings, Scalar(0.1)) == Status::kOk);
  REQUIRE(pilot.steer(command) == Status::kOk);
  return command;
}

template <class Scalar>
bool off(const auvest::TorpedoCommand<Scalar>& c) {
  return c.rudder_rad == Scalar(0) && c.stern_planes_rad == Scalar(0) &&
         c.propeller_rev_s == Scalar(0);
}

template <class Pilot>
typename Pilot::Sonar::Measurement fix_of(const Pilot& pilot, double x, double y) {
  using Scalar = typename Pilot::Scalar;
  const auto& sonar = pilot.params().sonar;
  const double dx = x - double(sonar.station_x_m);
  const double dy = y - double(sonar.station_y_m);
  typename Pilot::Sonar::Measurement z;
  z(0) = Scalar(std::sqrt(dx * dx + dy * dy));
  z(1) = Scalar(std::atan2(dy, dx));
  return z;
}

}  // namespace

TEST_CASE_TEMPLATE("pilot: nothing before it is started, and no start with what it refuses", Scalar,
                   float, double) {
  using Pilot = auvest::Pilot<Scalar>;
  Pilot pilot(settings<Scalar>());
  auvest::TorpedoCommand<Scalar> command;
  command.propeller_rev_s = 7;
  CHECK(pilot.predict(steady<Scalar>(), Scalar(0.1)) == Status::kNotInitialised);
  CHECK(pilot.update(fix_of(pilot, 0, 0), Scalar(0)).status == Status::kNotInitialised);
  CHECK(pilot.steer(command) == Status::kNotInitialised);
  CHECK(off(command));
  CHECK_FALSE(pilot.wants_fix());

  CHECK(pilot.start(plan<Scalar>(), 1, 0, 0, 0) == Status::kBadParameter);
  CHECK(pilot.path().report().problem == auvest::PlanProblem::kTooFew);
  CHECK(pilot.start(plan<Scalar>(), 3, nan_of<Scalar>(), 0, 0) == Status::kNotFinite);
  CHECK(pilot.start(plan<Scalar>(), 3, 0, 0, nan_of<Scalar>()) == Status::kNotFinite);
  CHECK(pilot.steer(command) == Status::kNotInitialised);

  for (int which = 0; which < 4; ++which) {
    auto bad = settings<Scalar>();
    if (which == 0) bad.period_s = 0;
    if (which == 1) bad.speed_m_s = -1;
    if (which == 2) bad.sonar.sigma_range_m = 0;
    if (which == 3) bad.heading.share = 2;
    Pilot refused(bad);
    CHECK(refused.check() == Status::kBadParameter);
    CHECK(refused.start(plan<Scalar>(), 3, 0, 0, 0) == Status::kBadParameter);
  }
  auvest::FixedInterval<Scalar> never;
  never.params.interval_s = 0;
  CHECK(Pilot(settings<Scalar>(), never).start(plan<Scalar>(), 3, 0, 0, 0) ==
        Status::kBadParameter);
}

TEST_CASE_TEMPLATE("pilot: a start that is refused leaves the mission under way as it is", Scalar,
                   float, double) {
  using Pilot = auvest::Pilot<Scalar>;
  using Point = auvest::Waypoint<Scalar>;
  Pilot pilot = started<Pilot>(settings<Scalar>());
  Pilot twin = started<Pilot>(settings<Scalar>());
  const Scalar nan = nan_of<Scalar>();
  static const Point back[] = {{50, 50}, {-30, 50}};
  static const Point twice[] = {{5, 5}, {5, 5}};
  for (int k = 0; k < 40; ++k) {
    if (k % 10 == 5) {
      CHECK(pilot.start(back, 2, 50, 50, nan) == Status::kNotFinite);
      CHECK(pilot.start(back, 2, nan, 50, 2) == Status::kNotFinite);
      CHECK(pilot.start(back, 2, 50, std::numeric_limits<Scalar>::max(), 2) != Status::kOk);
      CHECK(pilot.start(twice, 2, 50, 50, 2) == Status::kBadParameter);
      CHECK(pilot.path().report().problem == auvest::PlanProblem::kTooClose);
      CHECK(pilot.start(back, 1, 50, 50, 2) == Status::kBadParameter);
    }
    const auto command = step(pilot, steady<Scalar>());
    const auto expected = step(twin, steady<Scalar>());
    REQUIRE(command.rudder_rad == expected.rudder_rad);
    REQUIRE(command.propeller_rev_s == expected.propeller_rev_s);
    REQUIRE(pilot.mode() == PilotMode::kUnderWay);
    REQUIRE(pilot.filter().x()(0) == twin.filter().x()(0));
    REQUIRE(pilot.filter().P()(0, 0) == twin.filter().P()(0, 0));
    REQUIRE(pilot.wants_fix() == twin.wants_fix());
    REQUIRE(pilot.cross_track_m() == twin.cross_track_m());
  }
  // A fix that was so before the refusals is still taken at its own time.
  const auto fix = fix_of(pilot, 5, 0.2);
  CHECK(pilot.update(fix, Scalar(1)).status == Status::kOk);
  CHECK(twin.update(fix, Scalar(1)).status == Status::kOk);
  CHECK(pilot.filter().x()(1) == twin.filter().x()(1));
}

TEST_CASE_TEMPLATE("pilot: a silent sensor stops the vehicle after its time, or does not", Scalar,
                   float, double) {
  using Pilot = auvest::Pilot<Scalar>;
  auto params = settings<Scalar>();
  params.hold_s = Scalar(0.5);
  params.compass_s = Scalar(0.8);
  // Bit of the sensor, and the periods for which something stands for it; 0: for ever.
  const int cases[][2] = {{auvest::kCompassHeard, 8},
                          {auvest::kGyroHeard, 5},
                          {auvest::kLogHeard, 0},
                          {auvest::kDepthHeard, 5}};
  for (const auto& c : cases) {
    CAPTURE(c[0]);
    Pilot pilot = started<Pilot>(params);
    auto readings = steady<Scalar>();
    for (int k = 0; k < 3; ++k) CHECK_FALSE(off(step(pilot, readings)));
    readings.heard = static_cast<std::uint8_t>(15 & ~c[0]);
    for (int k = 1; k <= 12; ++k) {
      CAPTURE(k);
      const bool stops = c[1] > 0 && k > c[1];
      CHECK(off(step(pilot, readings)) == stops);
      CHECK(pilot.mode() == (stops ? PilotMode::kSilent : PilotMode::kUnderWay));
    }
    readings.heard = 15;
    CHECK_FALSE(off(step(pilot, readings)));
    CHECK(pilot.mode() == PilotMode::kUnderWay);
  }
}

TEST_CASE_TEMPLATE("pilot: it resumes with empty integrals at its own heading", Scalar, float,
                   double) {
  using Pilot = auvest::Pilot<Scalar>;
  Pilot pilot = started<Pilot>(settings<Scalar>());
  auto readings = steady<Scalar>();
  readings.depth_m = Scalar(4.5);  // 0.5 m too high for 2 s: the integral of the depth is filled
  for (int k = 0; k < 20; ++k) step(pilot, readings);
  readings.heard = 15 & ~auvest::kGyroHeard;
  for (int k = 0; k < 20; ++k) step(pilot, readings);
  REQUIRE(pilot.mode() == PilotMode::kSilent);
  readings.heard = 15;
  const auto resumed = step(pilot, readings);

  Pilot fresh = started<Pilot>(settings<Scalar>());
  const auto first = step(fresh, readings);
  CHECK(resumed.stern_planes_rad == first.stern_planes_rad);
  CHECK(resumed.propeller_rev_s == first.propeller_rev_s);
}

TEST_CASE_TEMPLATE("pilot: without a log the wanted speed is what it goes", Scalar, float, double) {
  using Pilot = auvest::Pilot<Scalar>;
  Pilot pilot = started<Pilot>(settings<Scalar>());
  auto readings = steady<Scalar>();
  readings.speed_m_s = 1;
  step(pilot, readings);
  readings.heard = 15 & ~auvest::kLogHeard;
  std::vector<double> moved;
  for (int k = 1; k <= 15; ++k) {
    const double before = double(pilot.filter().x()(0));
    step(pilot, readings);
    moved.push_back(double(pilot.filter().x()(0)) - before);
  }
  for (int k = 1; k <= 15; ++k) {
    CAPTURE(k);
    const double speed = k <= 10 ? 1 : 1.5;  // hold_s is 1 s
    CHECK(moved[std::size_t(k - 1)] == doctest::Approx(0.1 * speed).epsilon(1e-4));
  }
}

TEST_CASE_TEMPLATE("pilot: what cannot be true is as if it had not come, and is counted", Scalar,
                   float, double) {
  using Pilot = auvest::Pilot<Scalar>;
  using Readings = auvest::PilotReadings<Scalar>;
  struct Lie {
    int bit;
    Scalar Readings::*number;
    Scalar value;
  };
  const Scalar nan = nan_of<Scalar>();
  const Scalar inf = std::numeric_limits<Scalar>::infinity();
  const Lie lies[] = {{auvest::kCompassHeard, &Readings::heading_rad, nan},
                      {auvest::kCompassHeard, &Readings::heading_rad, Scalar(-6.4)},
                      {auvest::kCompassHeard, &Readings::pitch_rad, Scalar(1.5)},
                      {auvest::kGyroHeard, &Readings::yaw_rate_rad_s, inf},
                      {auvest::kGyroHeard, &Readings::pitch_rate_rad_s, Scalar(-2.1)},
                      {auvest::kLogHeard, &Readings::speed_m_s, Scalar(5.1)},
                      {auvest::kLogHeard, &Readings::sway_m_s, nan},
                      {auvest::kDepthHeard, &Readings::depth_m, Scalar(-2.1)},
                      {auvest::kDepthHeard, &Readings::depth_m, Scalar(200.1)},
                      {auvest::kDepthHeard, &Readings::depth_m, nan}};
  for (const Lie& lie : lies) {
    CAPTURE(lie.bit);
    Pilot lied = started<Pilot>(settings<Scalar>());
    Pilot silent = lied;
    for (int k = 0; k < 40; ++k) {
      auto readings = steady<Scalar>();
      readings.heading_rad = Scalar(0.01) * Scalar(k);
      auto none = readings;
      if (k >= 5 && k < 30) {
        readings.*lie.number = lie.value;
        none.heard = static_cast<std::uint8_t>(15 & ~lie.bit);
      }
      const auto a = step(lied, readings);
      const auto b = step(silent, none);
      REQUIRE(a.rudder_rad == b.rudder_rad);
      REQUIRE(a.stern_planes_rad == b.stern_planes_rad);
      REQUIRE(a.propeller_rev_s == b.propeller_rev_s);
      REQUIRE(lied.filter().x()(0) == silent.filter().x()(0));
      REQUIRE(lied.mode() == silent.mode());
    }
    CHECK(lied.implausible() == 25);
    CHECK(silent.implausible() == 0);
  }
}

TEST_CASE_TEMPLATE("pilot: fixes that cannot be true are not taken", Scalar, float, double) {
  using Pilot = auvest::Pilot<Scalar>;
  Pilot pilot = started<Pilot>(settings<Scalar>());
  step(pilot, steady<Scalar>());
  const auto before = pilot.filter().x();
  const Scalar nan = nan_of<Scalar>();
  const Scalar wrong[][2] = {{Scalar(-0.1), 0}, {Scalar(2000.1), 0}, {70, Scalar(6.4)}};
  typename Pilot::Sonar::Measurement z;
  for (const auto& w : wrong) {
    z(0) = w[0];
    z(1) = w[1];
    CHECK(pilot.update(z, Scalar(0)).status == Status::kBadParameter);
  }
  CHECK(pilot.implausible() == 3);
  z(0) = nan;
  CHECK(pilot.update(z, Scalar(0)).status == Status::kNotFinite);
  z = fix_of(pilot, 0, 0);
  CHECK(pilot.update(z, nan).status == Status::kNotFinite);
  CHECK(pilot.update(z, Scalar(-1)).status == Status::kTimeBackwards);
  CHECK(pilot.update(z, Scalar(60)).status == Status::kTimeBackwards);
  for (int i = 0; i < 4; ++i) CHECK(pilot.filter().x()(i) == before(i));
}

TEST_CASE_TEMPLATE("pilot: a late fix leaves the bits of one in time", Scalar, float, double) {
  using Pilot = auvest::Pilot<Scalar>;
  Pilot late = started<Pilot>(settings<Scalar>());
  Pilot prompt = late;
  const auto z = fix_of(prompt, 1.2, -0.4);
  for (int k = 0; k < 12; ++k) {
    auto readings = steady<Scalar>();
    readings.heading_rad = Scalar(0.02) * Scalar(k);
    auvest::TorpedoCommand<Scalar> command;
    for (Pilot* pilot : {&late, &prompt})
      REQUIRE(pilot->predict(readings, Scalar(0.1)) == Status::kOk);
    if (k == 4) REQUIRE(prompt.update(z, Scalar(0)).status == Status::kOk);
    if (k == 9) {
      CHECK(late.filter().x()(0) != prompt.filter().x()(0));
      REQUIRE(late.update(z, Scalar(0.5)).status == Status::kOk);
    }
    const bool same = late.filter().x()(0) == prompt.filter().x()(0) &&
                      late.filter().x()(1) == prompt.filter().x()(1) &&
                      late.filter().belief().P(2, 0) == prompt.filter().belief().P(2, 0);
    CHECK(same == (k < 4 || k >= 9));
    for (Pilot* pilot : {&late, &prompt}) REQUIRE(pilot->steer(command) == Status::kOk);
  }
}

TEST_CASE_TEMPLATE("pilot: lost where the position is not known to lost_m, and back with a fix",
                   Scalar, float, double) {
  using Pilot = auvest::Pilot<Scalar>;
  auto params = settings<Scalar>();
  params.lost_m = Scalar(1.6);
  Pilot pilot = started<Pilot>(params);
  int stopped = 0;
  for (int k = 0; k < 60 && stopped < 10; ++k) {
    const bool is_off = off(step(pilot, steady<Scalar>()));
    const auto& P = pilot.filter().belief().P;
    const bool unknown = std::sqrt(double(P(0, 0) + P(1, 1))) >= 1.6;
    CHECK(is_off == unknown);
    CHECK((pilot.mode() == PilotMode::kLost) == unknown);
    if (unknown) ++stopped;
  }
  REQUIRE(stopped == 10);
  REQUIRE(pilot.predict(steady<Scalar>(), Scalar(0.1)) == Status::kOk);
  const double x = double(pilot.filter().x()(0));
  REQUIRE(pilot.update(fix_of(pilot, x, 0), Scalar(0)).status == Status::kOk);
  auvest::TorpedoCommand<Scalar> command;
  REQUIRE(pilot.steer(command) == Status::kOk);
  CHECK(pilot.mode() == PilotMode::kUnderWay);
  CHECK_FALSE(off(command));
}

namespace {

/// Asks every 0.3 s, first after 0.7 s, and notes what it was told.
template <class Scalar_>
struct NotingInterval {
  using Scalar = Scalar_;
  using Position = auvest::Vector<Scalar, 2>;
  std::vector<Position>* told = nullptr;

  Scalar initial() const { return Scalar(0.7); }
  void restart(const Position&, const Position&) {}
  template <class Filter>
  Scalar next(const Filter&, const Position& reference) {
    told->push_back(reference);
    return Scalar(0.3);
  }
  Status check() const { return Status::kOk; }
};

}  // namespace

TEST_CASE_TEMPLATE("pilot: the desired point moves on, and at the end nobody is asked", Scalar,
                   float, double) {
  using Pilot = auvest::Pilot<Scalar, NotingInterval<Scalar>>;
  std::vector<auvest::Vector<Scalar, 2>> told;
  NotingInterval<Scalar> policy;
  policy.told = &told;
  typename Pilot::Params params;
  const auto from = settings<Scalar>();
  params.sonar = from.sonar;
  params.waypoints.switch_m = 10;
  Pilot pilot = started<Pilot>(params, policy);
  // The vehicle is where its plan is, 0.15 m on in each period: north, then east.
  std::vector<int> asked;
  std::size_t told_at_end = 0;
  int finished = 0;
  for (int k = 0; finished < 40; ++k) {
    REQUIRE(k < 600);
    const double way = 0.15 * k;
    const bool first = way < 30;
    auto readings = steady<Scalar>();
    readings.heading_rad = Scalar(first ? 0 : 1.5707963);
    REQUIRE(pilot.predict(readings, Scalar(0.1)) == Status::kOk);
    if (pilot.wants_fix()) {
      pilot.asked();
      asked.push_back(k);
      const auto z = fix_of(pilot, first ? way : 30, first ? 0 : way - 30);
      const std::size_t before = told.size();
      REQUIRE(pilot.update(z, Scalar(0)).status == Status::kOk);
      if (finished == 0) {
        REQUIRE(told.size() == before + 1);
        // So many periods at 1.5 m/s along the plan: sums of 0.15 round.
        CHECK(std::fabs(double(told.back()(0)) - (first ? way : 30)) < 1e-3);
        CHECK(std::fabs(double(told.back()(1)) - (first ? 0 : way - 30)) < 1e-3);
      }
    }
    auvest::TorpedoCommand<Scalar> command;
    REQUIRE(pilot.steer(command) == Status::kOk);
    if (pilot.mode() == PilotMode::kFinished) {
      CHECK(off(command));
      if (finished++ == 0) told_at_end = told.size();
    }
  }
  CHECK(told.size() == told_at_end);
  REQUIRE(asked.size() > 10);
  CHECK(asked[0] == 7);
  CHECK(asked[1] == 10);
  // Asked for while under way by the policy, and when that is over in its first interval.
  const std::size_t last = asked.size() - 1;
  CHECK(asked[last] - asked[last - 1] == 7);
  CHECK(asked[last - 1] - asked[last - 2] == 7);
}

TEST_CASE("pilot: a float pilot takes what was promised") {
  CHECK(sizeof(auvest::Pilot<float>) <= 1920);
}
