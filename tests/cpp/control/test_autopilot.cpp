// The controllers of a torpedo together.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "auvest/control/autopilot.hpp"

namespace {

using auvest::Status;

template <class Scalar>
struct Setting {
  auvest::GuidanceCommand<Scalar> wanted;
  auvest::AutopilotReadings<Scalar> now;
  auvest::TorpedoCommand<Scalar> out;
};

template <class Scalar>
Setting<Scalar> setting() {
  Setting<Scalar> s;
  s.wanted.heading_rad = Scalar(0.3);
  s.wanted.rate_rad_s = Scalar(0.01);
  s.now.heading_rad = Scalar(0.1);
  s.now.yaw_rate_rad_s = Scalar(0.02);
  s.now.speed_m_s = Scalar(1.4);
  s.now.depth_m = Scalar(5.2);
  s.now.pitch_rad = Scalar(0.03);
  s.now.pitch_rate_rad_s = Scalar(0.01);
  s.out.rudder_rad = s.out.stern_planes_rad = s.out.propeller_rev_s = 7;
  return s;
}

TEST_CASE_TEMPLATE("autopilot: each controller on its own gives the same bits", Scalar, float,
                   double) {
  auvest::Autopilot<Scalar> autopilot;
  auvest::HeadingReference<Scalar> shaping;
  auvest::HeadingControl<Scalar> heading;
  auvest::SpeedControl<Scalar> speed;
  auvest::DepthControl<Scalar> depth;
  auvest::PitchControl<Scalar> pitch;
  REQUIRE(autopilot.restart(Scalar(0.05)) == Status::kOk);
  REQUIRE(shaping.restart(Scalar(0.05)) == Status::kOk);
  const Scalar dt = Scalar(0.1);
  auto s = setting<Scalar>();
  for (int k = 0; k < 100; ++k) {
    s.now.heading_rad = Scalar(0.1 + 0.01 * k);
    s.now.depth_m = Scalar(5.2 - 0.01 * k);
    REQUIRE(autopilot.update(s.wanted, Scalar(1.5), 5, s.now, dt, s.out) == Status::kOk);
    auvest::Reference<Scalar> reference;
    Scalar rudder = 0, rev = 0, theta = 0, plane = 0;
    REQUIRE(shaping.update(s.wanted, dt, reference) == Status::kOk);
    REQUIRE(heading.update(reference, s.now.heading_rad, s.now.yaw_rate_rad_s, s.now.speed_m_s, dt,
                           rudder) == Status::kOk);
    REQUIRE(speed.update(Scalar(1.5), s.now.speed_m_s, dt, rev) == Status::kOk);
    REQUIRE(depth.update(5, s.now.depth_m, dt, theta) == Status::kOk);
    REQUIRE(pitch.update(theta, s.now.pitch_rad, s.now.pitch_rate_rad_s, dt, plane) == Status::kOk);
    CHECK(s.out.rudder_rad == rudder);
    CHECK(s.out.propeller_rev_s == rev);
    CHECK(s.out.stern_planes_rad == plane);
  }
  CHECK(autopilot.heading().integral() == heading.integral());
  CHECK(autopilot.depth().integral() == depth.integral());
  REQUIRE(autopilot.restart(0) == Status::kOk);
  CHECK(autopilot.depth().integral() == Scalar(0));
}

TEST_CASE_TEMPLATE("autopilot: what one controller refuses, none of them takes", Scalar, float,
                   double) {
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  auvest::Autopilot<Scalar> autopilot;
  auto s = setting<Scalar>();
  REQUIRE(autopilot.update(s.wanted, 1, 5, s.now, Scalar(0.1), s.out) == Status::kOk);
  const auvest::TorpedoCommand<Scalar> before = s.out;
  const Scalar headings = autopilot.reference().heading_rad();
  const Scalar integrals[] = {autopilot.heading().integral(), autopilot.speed().integral(),
                              autopilot.depth().integral(), autopilot.pitch().integral()};
  Scalar auvest::AutopilotReadings<Scalar>::*const members[] = {
      &auvest::AutopilotReadings<Scalar>::heading_rad,
      &auvest::AutopilotReadings<Scalar>::yaw_rate_rad_s,
      &auvest::AutopilotReadings<Scalar>::speed_m_s,
      &auvest::AutopilotReadings<Scalar>::depth_m,
      &auvest::AutopilotReadings<Scalar>::pitch_rad,
      &auvest::AutopilotReadings<Scalar>::pitch_rate_rad_s};
  for (const auto member : members) {
    auto bad = s.now;
    bad.*member = nan;
    CHECK(autopilot.update(s.wanted, 1, 5, bad, Scalar(0.1), s.out) == Status::kNotFinite);
  }
  CHECK(autopilot.update(s.wanted, nan, 5, s.now, Scalar(0.1), s.out) == Status::kNotFinite);
  CHECK(autopilot.update(s.wanted, 1, nan, s.now, Scalar(0.1), s.out) == Status::kNotFinite);
  CHECK(autopilot.update(s.wanted, 1, 5, s.now, -1, s.out) == Status::kTimeBackwards);
  auto wanted = s.wanted;
  wanted.heading_rad = nan;
  CHECK(autopilot.update(wanted, 1, 5, s.now, Scalar(0.1), s.out) == Status::kNotFinite);
  CHECK(s.out.rudder_rad == before.rudder_rad);
  CHECK(s.out.propeller_rev_s == before.propeller_rev_s);
  CHECK(s.out.stern_planes_rad == before.stern_planes_rad);
  CHECK(autopilot.reference().heading_rad() == headings);
  CHECK(autopilot.heading().integral() == integrals[0]);
  CHECK(autopilot.speed().integral() == integrals[1]);
  CHECK(autopilot.depth().integral() == integrals[2]);
  CHECK(autopilot.pitch().integral() == integrals[3]);

  typename auvest::Autopilot<Scalar>::Params p;
  p.pitch.max_plane_rad = 0;
  auvest::Autopilot<Scalar> wrong(p);
  CHECK(wrong.check() == Status::kBadParameter);
  CHECK(wrong.update(s.wanted, 1, 5, s.now, Scalar(0.1), s.out) == Status::kBadParameter);
}

}  // namespace
