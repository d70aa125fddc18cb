// Odometry with constants in the state, and the range that reads them: against the models without,
// closed forms, and derivatives.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "auvest/filters/ekf.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/odometry.hpp"
#include "auvest/models/scaled_range.hpp"

namespace {

using auvest::Status;
using Process = auvest::OdometryConstants<double>;
using Range = auvest::ScaledRange<double, 8>;
using State = Process::State;
using Covariance = Process::Covariance;

/// The speed's error is state 3, the turn rate's offset 5.
Process driven() {
  Process::Params p;
  p.speed_state = 3;
  p.turn_state = 5;
  p.walk_1 = 0.02;
  Process process(p);
  process.input << 2, 0.5, 0.7;
  return process;
}

/// The scale is state 4, the offset 7.
Range range() {
  Range::Params p;
  p.leader_x_m = 10;
  p.leader_y_m = -4;
  p.scale_state = 4;
  p.offset_state = 7;
  return Range(p);
}

State somewhere() {
  State x;
  x << 1, 2, 0.4, 0.05, -0.03, 0.01, 9, 0.6;
  return x;
}

template <class Function, class Jacobian>
void check_slope(const Function& f, const Jacobian& jacobian) {
  const State x = somewhere();
  for (int j = 0; j < 8; ++j) {
    State up = x;
    State down = x;
    up(j) += 1e-5;
    down(j) -= 1e-5;
    CHECK(((f(up) - f(down)) / 2e-5 - jacobian(x).col(j)).norm() < 1e-8);
  }
}

TEST_CASE("odometry with constants: distances grow by the speed's error, turns by the offset") {
  const Process process = driven();
  const State x = process.f(somewhere(), 0.5);
  const double c = std::cos(0.4);
  const double s = std::sin(0.4);
  CHECK(x(0) == doctest::Approx(1 + 1.05 * (2 * c - 0.5 * s)).epsilon(1e-14));
  CHECK(x(1) == doctest::Approx(2 + 1.05 * (2 * s + 0.5 * c)).epsilon(1e-14));
  CHECK(x(2) == doctest::Approx(0.4 + 0.7 + 0.5 * 0.01).epsilon(1e-14));
  CHECK(x.tail<5>() == somewhere().tail<5>());
  check_slope([&](const State& at) { return process.f(at, 0.5); },
              [&](const State& at) { return process.Phi(at, 0.5); });
  // The noise of the odometry as it is, and that of what walks.
  auvest::Odometry<double> odometry;
  odometry.input = process.input;
  Covariance q = Covariance::Zero();
  q.topLeftCorner<3, 3>() = odometry.Q(0.5);
  q(4, 4) = 0.5 * 0.02 * 0.02;
  CHECK(process.Q(0.5) == q);
  // Each constant walks by itself.
  Process walking = process;
  walking.params.walk_0 = 0.01, walking.params.walk_2 = 0.03;
  walking.params.walk_3 = 0.04, walking.params.walk_4 = 0.05;
  for (int i = 0; i < 5; ++i) {
    CHECK(walking.Q(0.5)(3 + i, 3 + i) == doctest::Approx(0.5 * 1e-4 * (i + 1) * (i + 1)));
  }
}

TEST_CASE("scaled range: its numbers, and what they hang on") {
  const Range model = range();
  const double distance = std::hypot(9, 6);
  CHECK(model.h(somewhere())(0) == doctest::Approx(0.97 * distance + 0.6).epsilon(1e-14));
  check_slope([&](const State& at) { return model.h(at); },
              [&](const State& at) { return model.H(at); });
  CHECK(model.R()(0, 0) == 1);
}

TEST_CASE("constants that nobody uses: the filter without") {
  Process process;
  auvest::Ekf<Process> augmented(process);
  auvest::Ekf<auvest::Odometry<double>> plain;
  const State x0 = (State() << 1, 2, 0.4, 0, 0, 0, 0, 0).finished();
  Covariance P0 = Covariance::Identity();
  P0(2, 2) = 0.01;
  REQUIRE(augmented.reset(x0, P0) == Status::kOk);
  REQUIRE(plain.reset(x0.head<3>(), P0.topLeftCorner<3, 3>()) == Status::kOk);
  for (int k = 0; k < 20; ++k) {
    const auvest::Vector<double, 3> step(1, 0.1, 0.05);
    REQUIRE(augmented.predict(0.5, step) == Status::kOk);
    REQUIRE(plain.predict(0.5, step) == Status::kOk);
    const double z = 12 + 0.3 * k;
    REQUIRE(augmented.update(z, Range()).status == Status::kOk);
    REQUIRE(plain.update(z, auvest::LeaderRange<double, 3>()).status == Status::kOk);
  }
  CHECK((augmented.x().head<3>() - plain.x()).norm() < 1e-12);
  CHECK((augmented.P().topLeftCorner<3, 3>() - plain.P()).norm() < 1e-12);
  CHECK(augmented.P().bottomRightCorner<5, 5>() ==
        Covariance::Identity().bottomRightCorner<5, 5>());
}

TEST_CASE("scaled range: one range at most halves what is not known of a constant") {
  // From a place that is known, a range of 100 m says the scale to 1 %; 20 % are known before.
  Range::Params p;
  p.leader_x_m = 100;
  p.scale_state = 4;
  auvest::Ekf<Process> filter{Process()};
  Covariance P0 = 1e-12 * Covariance::Identity();
  P0(4, 4) = 0.04;
  REQUIRE(filter.reset(State::Zero(), P0) == Status::kOk);
  REQUIRE(filter.update(107.0, Range(p)).status == Status::kOk);
  // S = 400 + (1 + 400) m^2, and P - P h^2 P / S of it is left.
  CHECK(filter.P()(4, 4) == doctest::Approx(0.04 - 0.04 * 400 / 801).epsilon(1e-9));
  CHECK(filter.x()(4) == doctest::Approx(7 * 0.04 * 100 / 801).epsilon(1e-9));
  // Afterwards it is worth what it is.
  for (int k = 0; k < 60; ++k) REQUIRE(filter.update(107.0, Range(p)).status == Status::kOk);
  CHECK(filter.x()(4) == doctest::Approx(0.07).epsilon(1e-3));
  CHECK(std::sqrt(filter.P()(4, 4)) == doctest::Approx(0.01 / std::sqrt(60.0)).epsilon(0.1));
}

TEST_CASE("constants: places that are none are refused") {
  for (const double place :
       {-1.0, 1.0, 2.0, 3.5, 8.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    Process::Params process;
    process.turn_state = place;
    CHECK(Process(process).check() == Status::kBadParameter);
    Range::Params range;
    range.offset_state = place;
    CHECK(Range(range).check() == Status::kBadParameter);
  }
  for (const double place : {0.0, 3.0, 7.0}) {
    Process::Params process;
    process.speed_state = place;
    CHECK(Process(process).check() == Status::kOk);
    Range::Params range;
    range.scale_state = place;
    CHECK(Range(range).check() == Status::kOk);
  }
  Process::Params process;
  process.walk_3 = -1;
  CHECK(Process(process).check() == Status::kBadParameter);
  Range::Params range;
  range.sigma_range_m = 0;
  CHECK(Range(range).check() == Status::kBadParameter);
}

}  // namespace
