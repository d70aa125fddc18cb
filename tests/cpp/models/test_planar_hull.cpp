// The hull in the plane as a process, and the sensor that goes with it: against the hull itself,
// the closed forms of its speeds, and derivatives of fourth order.
#include <doctest/doctest.h>

#include <cmath>

#include "auvest/filters/ekf.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/models/heading_speed.hpp"
#include "auvest/models/planar_hull.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/vehicle/integrate.hpp"

namespace {

using auvest::Status;
using Process = auvest::PlanarHull<double>;
using State = Process::State;

State state(double x, double y, double psi, double u, double v, double r, double vx, double vy) {
  State s;
  s << x, y, psi, u, v, r, vx, vy;
  return s;
}

Process driven(double rudder, double propeller) {
  Process process;
  process.input << rudder, propeller;
  return process;
}

TEST_CASE("planar hull: moves as the hull of three degrees of freedom, its actuators at rest") {
  using Hull = auvest::Hull<auvest::Torpedo<double>, auvest::ThreeDof>;
  const Hull hull(auvest::remus100<double>());
  const Process process = driven(0.1, 18);
  State x = state(3, -2, 0.7, 1.2, 0.05, 0.1, 0.2, -0.1);
  Hull::State body;
  body << 3, -2, 0.7, 1.2, 0.05, 0.1, 0.1, 0, 18;
  Hull::Command command;
  command << 0.1, 0, 18;
  Hull::Current current;
  current << 0.2, -0.1, 0;
  for (int k = 0; k < 300; ++k) {
    x = process.f(x, 0.3);  // three steps of RK4
    for (int i = 0; i < 3; ++i) {
      REQUIRE(auvest::advance<auvest::Rk4>(hull, body, command, current, 0.1) == Status::kOk);
    }
  }
  for (int i = 0; i < 6; ++i) {
    const double difference = x(i) - body(i);
    CHECK(std::fabs(i == 2 ? auvest::math::wrap(difference) : difference) < 1e-10);
  }
  CHECK(x(6) == 0.2);
  CHECK(x(7) == -0.1);
}

TEST_CASE("planar hull: ends at the speed where thrust is drag") {
  // 300, 900 and 1525 rpm; the drag of the linear term counts at low speed only.
  const double speeds[][2] = {{5, 0.48298}, {15, 1.49833}, {1525.0 / 60, 2.54018}};
  for (const auto& pair : speeds) {
    const State x = driven(0, pair[0]).f(state(0, 0, 0.5, 0.3, 0, 0, 0, 0), 600);
    CHECK(std::fabs(x(3) - pair[1]) < 1e-5);
    CHECK(x(2) == 0.5);
    CHECK(std::fabs(x(0) * std::sin(0.5) - x(1) * std::cos(0.5)) < 1e-9);
  }
}

TEST_CASE("planar hull: the current carries it, and does nothing else") {
  const Process process = driven(-0.15, 15);
  const State still = process.f(state(0, 0, 1, 1.4, 0.1, -0.1, 0, 0), 20);
  const State carried = process.f(state(0, 0, 1, 1.4, 0.1, -0.1, 0.3, -0.2), 20);
  CHECK(std::fabs(carried(0) - still(0) - 6) < 1e-12);
  CHECK(std::fabs(carried(1) - still(1) + 4) < 1e-12);
  for (int i = 2; i < 6; ++i) CHECK(carried(i) == still(i));
}

TEST_CASE("planar hull: hours on a circle, of which only the beginning is integrated") {
  Process fine = driven(0.05, 15);
  fine.params.step_s = 0.5;  // integrates for 2,048 s
  const Process coarse = driven(0.05, 15);
  const State x = state(0, 0, 0, 1, 0, 0, 0.1, 0.05);
  const State long_way = fine.f(x, 2000);
  const State short_way = coarse.f(x, 2000);  // integrates for 410 s
  for (int i = 0; i < 8; ++i) {
    const double difference = fine.residual(short_way, long_way)(i);
    CAPTURE(i);
    CHECK(std::fabs(difference) < (i < 2 ? 1e-2 : i == 2 ? 1e-3 : 1e-6));
  }
  const State straight = driven(0, 15).f(state(0, 0, 0, 1.49833, 0, 0, 0, 0), 7200);
  CHECK(std::fabs(straight(0) - 7200 * 1.49833) < 0.05);
}

TEST_CASE("planar hull: Phi is the Jacobian of f") {
  const State places[] = {state(5, 3, 0.4, 1.5, 0.02, 0.05, 0.3, -0.1),
                          state(-7, 1, 3.1, 1.4, -0.2, 0.15, 0, 0.2),
                          state(0, 0, -2, 0.4, 0.1, -0.2, 0.1, 0)};
  const Process process = driven(0.12, 14);
  double worst = 0;
  for (const State& x : places) {
    for (const double dt : {0.05, 0.5, 3.0}) {
      const auto phi = process.Phi(x, dt);
      const double h = 2e-3;
      for (int j = 0; j < 8; ++j) {
        // Of fourth order, and with another step than that of Phi.
        const auto slope = [&](double e) {
          State up = x, down = x;
          up(j) += e;
          down(j) -= e;
          return State(process.residual(process.f(up, dt), process.f(down, dt)) / (2 * e));
        };
        const State expected = (4 * slope(h / 2) - slope(h)) / 3;
        for (int i = 0; i < 8; ++i) worst = std::fmax(worst, std::fabs(phi(i, j) - expected(i)));
      }
    }
  }
  // The second derivative of the cross-flow drag jumps where v and r pass each other: an error of a
  // fraction of Phi's own step, 2^-8.
  CHECK(worst < 5e-4);
}

TEST_CASE("planar hull: forces come through the mass matrix") {
  Process::Params p;
  p.surge_psd = 2;
  p.sway_psd = 3;
  p.yaw_psd = 0.5;
  const auto q = Process(p).Q(0.2);
  // Surge, sway and yaw of remus100 have no common entries in the plane.
  CHECK(std::fabs(q(3, 3) - 0.2 * 2 / (32.79494 * 32.79494)) < 1e-9);
  CHECK(std::fabs(q(4, 4) - 0.2 * 3 / (62.22524 * 62.22524)) < 1e-9);
  CHECK(std::fabs(q(5, 5) - 0.2 * 0.5 / (7.818706 * 7.818706)) < 1e-9);
  CHECK(std::fabs(q(4, 5)) < 1e-15);
  CHECK(std::fabs(q(0, 0) - (0.2 * 1e-3 + 1e-5 * 0.008 / 3)) < 1e-15);
  CHECK(std::fabs(q(6, 0) - 1e-5 * 0.04 / 2) < 1e-18);
  CHECK(std::fabs(q(7, 7) - 1e-5 * 0.2) < 1e-18);

  // A centre of gravity ahead of the origin couples sway and yaw: M Q_nu M = q dt.
  auto ahead = auvest::remus100<double>();
  ahead.body.xg_m = 0.1;
  const Process coupled(p, ahead);
  REQUIRE(coupled.check() == Status::kOk);
  const auvest::Hull<auvest::Torpedo<double>, auvest::ThreeDof> hull(ahead);
  const auto& full = hull.mass_matrix();
  auvest::Matrix<double, 3, 3> m;
  const int axes[] = {0, 1, 5};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m(i, j) = full(axes[i], axes[j]);
  }
  CHECK(m(1, 2) > 3);
  const auvest::Matrix<double, 3, 3> forces =
      m * coupled.Q(1).template block<3, 3>(3, 3) * m.transpose();
  const double expected[] = {2, 3, 0.5};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      CHECK(std::fabs(forces(i, j) - (i == j ? expected[i] : 0)) < 1e-10);
    }
  }
}

TEST_CASE("planar hull: what it refuses") {
  Process::Params p;
  for (const double step : {0.0, 0.009, 0.6, std::nan("")}) {
    p.step_s = step;
    CHECK(Process(p).check() == Status::kBadParameter);
  }
  auto hull = auvest::remus100<double>();
  hull.body.mass_kg = -1;
  CHECK(Process(Process::Params(), hull).check() != Status::kOk);
}

TEST_CASE_TEMPLATE("planar hull: fixes and commands alone find speed, heading and current", Filter,
                   auvest::Ekf<Process>, auvest::Ukf<Process>) {
  Process process;
  Filter filter{process};
  State truth = state(10, 5, 0.6, 1.5, 0, 0, 0.25, -0.15);
  State start = state(11, 4, 0.5, 1.2, 0, 0, 0, 0);
  auvest::Matrix<double, 8, 8> P = auvest::Matrix<double, 8, 8>::Zero();
  const double sigma[] = {1, 1, 0.2, 0.3, 0.1, 0.05, 0.3, 0.3};
  for (int i = 0; i < 8; ++i) P(i, i) = sigma[i] * sigma[i];
  REQUIRE(filter.reset(start, P) == Status::kOk);
  auvest::RangeBearing<double, 8>::Params usbl;
  usbl.station_x_m = usbl.station_y_m = -40;
  usbl.sigma_range_m = 0.3;
  usbl.sigma_bearing_rad = 0.02;
  const auvest::RangeBearing<double, 8> sonar(usbl);
  for (int k = 0; k < 300; ++k) {
    process.input << (k / 50 % 2 == 0 ? 0.1 : -0.1), 15;
    truth = process.f(truth, 0.5);
    REQUIRE(filter.predict(0.5, process.input) == Status::kOk);
    REQUIRE(filter.update(sonar.h(truth), sonar).status == Status::kOk);
  }
  const State error = process.residual(filter.x(), truth);
  const double most[] = {0.05, 0.05, 0.02, 0.02, 0.02, 0.01, 0.02, 0.02};
  for (int i = 0; i < 8; ++i) {
    CAPTURE(i);
    CHECK(std::fabs(error(i)) < most[i]);
  }
}

TEST_CASE("heading and speed: the short way round, and each number with its own sigma") {
  using Sensor = auvest::HeadingSpeed<double, 8>;
  Sensor::Params p;
  p.sigma_heading_rad = 0.02;
  p.sigma_forward_m_s = 0.1;
  p.sigma_starboard_m_s = 0.3;
  const Sensor sensor(p);
  REQUIRE(sensor.check() == Status::kOk);
  const State x = state(1, 2, 3.1, 1.5, -0.2, 0.1, 0, 0);
  Sensor::Measurement z;
  z << -3.1, 1.4, 0.1;
  const auto difference = sensor.residual(z, sensor.h(x));
  CHECK(std::fabs(difference(0) - (2 * 3.14159265358979323846 - 6.2)) < 1e-12);
  CHECK(std::fabs(difference(1) + 0.1) < 1e-15);
  CHECK(std::fabs(difference(2) - 0.3) < 1e-15);
  CHECK(std::fabs(sensor.R()(0, 0) - 4e-4) < 1e-18);
  CHECK(std::fabs(sensor.R()(1, 1) - 0.01) < 1e-16);
  CHECK(std::fabs(sensor.R()(2, 2) - 0.09) < 1e-16);
  for (double Sensor::Params::*const sigma :
       {&Sensor::Params::sigma_heading_rad, &Sensor::Params::sigma_forward_m_s,
        &Sensor::Params::sigma_starboard_m_s}) {
    Sensor::Params bad;
    bad.*sigma = 0;
    CHECK(Sensor(bad).check() == Status::kBadParameter);
  }
}

}  // namespace
