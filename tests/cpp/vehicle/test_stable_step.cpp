// Bad input, and steps that are too long: refused, with nothing lost.
#include "auvest/vehicle/stable_step.hpp"

#include <cmath>
#include <complex>
#include <cstring>
#include <limits>

#include "support.hpp"

namespace {

using namespace vehicle;
using auvest::Rk4;
using auvest::SemiImplicit;
using auvest::Status;

template <class Scalar>
typename Remus<Scalar>::State at_speed(const Remus<Scalar>& hull, double rpm) {
  using Hull = Remus<Scalar>;
  typename Hull::State x = Hull::State::Zero();
  run(hull, x, command<Hull>(0, 0, rpm), current<Hull>(0, 0, 0), 0.05, 1200);
  return x;
}

TEST_CASE_TEMPLATE("largest step: the lag of a fin bounds Rk4 by 2.785 T, one evaluation by 2 T",
                   Scalar, float, double) {
  using Hull = Remus<Scalar>;
  const Hull hull(auvest::remus100<Scalar>());
  const typename Hull::State x = at_speed(hull, 900);
  const auto c = command<Hull>(0, 0, 900);
  CHECK(double(auvest::largest_stable_step<Rk4>(hull, x, c)) ==
        doctest::Approx(0.278529).epsilon(1e-3));
  CHECK(double(auvest::largest_stable_step<SemiImplicit>(hull, x, c)) ==
        doctest::Approx(0.2).epsilon(1e-3));
  CHECK(auvest::check_step<Rk4>(hull, x, c, Scalar(0.27)) == Status::kOk);
  CHECK(auvest::check_step<Rk4>(hull, x, c, Scalar(0.29)) == Status::kUnstableStep);
  CHECK(auvest::check_step<SemiImplicit>(hull, x, c, Scalar(0.21)) == Status::kUnstableStep);
  CHECK(auvest::check_step<Rk4>(hull, x, c, Scalar(0)) == Status::kUnstableStep);
  CHECK(auvest::check_step<Rk4>(hull, x, c, Scalar(-0.1)) == Status::kUnstableStep);
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  CHECK(auvest::check_step<Rk4>(hull, x, c, nan) == Status::kUnstableStep);
}

TEST_CASE("largest step: that of the shaft, the last state, where its lag is the shortest") {
  using Hull = Remus<double>;
  auto p = auvest::remus100<double>();
  p.propeller.shaft.time_constant_s = 0.02;
  const Hull hull(p);
  const auto c = command<Hull>(0, 0, 900);
  // 2.785 and 2 time constants, as of a fin.
  const Hull::State x = Hull::State::Zero();
  CHECK(auvest::largest_stable_step<Rk4>(hull, x, c) == doctest::Approx(0.0557058).epsilon(1e-3));
  CHECK(auvest::largest_stable_step<SemiImplicit>(hull, x, c) ==
        doctest::Approx(0.04).epsilon(1e-3));
}

/// How much a small push has grown after 400 steps.
template <class Method, class Hull>
double growth(const Hull& hull, typename Hull::State x, const typename Hull::Command& c, double h) {
  typename Hull::State y = x;
  y(3) += 1e-7;
  y(Hull::kVelocities + 4) += 1e-7;
  for (int i = 0; i < 3; ++i) y(2 * Hull::kVelocities + i) += 1e-7;
  const auto still = current<Hull>(0, 0, 0);
  double largest = 0;
  for (int k = 0; k < 400; ++k) {
    Method::step(hull, x, c, still, h);
    Method::step(hull, y, c, still, h);
    const auto difference = (y - x).tail(Hull::kStates - 3).eval();
    largest = std::max(largest, difference.cwiseAbs().maxCoeff());
  }
  return largest / 1e-7;
}

template <class Method>
void check_against_run(double servo_s) {
  using Hull = Remus<double>;
  auto p = auvest::remus100<double>();
  p.rudder.servo.time_constant_s = p.stern_planes.servo.time_constant_s = servo_s;
  const Hull hull(p);
  const auto c = command<Hull>(0, 0, 900);
  const Hull::State x = at_speed(hull, 900);
  const double limit = auvest::largest_stable_step<Method>(hull, x, c);
  CAPTURE(servo_s);
  CAPTURE(limit);
  CHECK(growth<Method>(hull, x, c, 0.97 * limit) < 100);
  CHECK(growth<Method>(hull, x, c, 1.03 * limit) > 100);
}

TEST_CASE("largest step: below it a push dies out, above it the run explodes") {
  // The lag decides at 0.1 s; at 1 s, roll does.
  check_against_run<Rk4>(0.1);
  check_against_run<Rk4>(1);
  check_against_run<SemiImplicit>(0.1);
  check_against_run<SemiImplicit>(1);
}

TEST_CASE("largest step: shorter where the ROV spins, and a Munk moment is no reason to refuse") {
  using Hull = Rov<double>;
  const Hull hull(auvest::bluerov2_heavy<double>());
  Hull::State x = Hull::State::Zero();
  const Hull::Command c = Hull::Command::Zero();
  CHECK(auvest::largest_stable_step<Rk4>(hull, x, c) == doctest::Approx(0.278529).epsilon(1e-3));
  x(11) = 3.912;
  // 2 x 1.5 x 3.912 / (0.37 + 0.222) = 19.82 1/s
  CHECK(auvest::largest_stable_step<Rk4>(hull, x, c) ==
        doctest::Approx(2.785294 / 19.8243).epsilon(1e-3));

  auto p = auvest::remus100<double>();
  p.added_mass.munk = true;
  const Remus<double> munk(p);
  Remus<double>::State y = Remus<double>::State::Zero();
  y(6) = 1.5;
  CHECK(auvest::largest_stable_step<Rk4>(munk, y, command<Remus<double>>(0, 0, 900)) ==
        doctest::Approx(0.278529).epsilon(1e-3));
}

TEST_CASE(
    "largest step: each of roll and pitch bounds it where its righting arm is the stiff one") {
  // M a'' + D a' + B arm a = 0: RK4 is stable while |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1, z = h l.
  for (const bool roll : {true, false}) {
    CAPTURE(roll);
    auto p = auvest::bluerov2_heavy<double>();
    p.restoring.zb_m = -2;
    (roll ? p.body.iyy_kg_m2 : p.body.ixx_kg_m2) = 500;
    const double inertia = roll ? p.body.ixx_kg_m2 + p.added_mass.roll_kg_m2
                                : p.body.iyy_kg_m2 + p.added_mass.pitch_kg_m2;
    const double decay =
        0.5 * (roll ? p.linear_damping.roll_kg_m2_s : p.linear_damping.pitch_kg_m2_s) / inertia;
    const double stiff = p.restoring.buoyancy_n * 2 / inertia;
    const std::complex<double> root(-decay, std::sqrt(stiff - decay * decay));
    double low = 0.01, high = 0.2;  // above it the mode grows
    for (int k = 0; k < 40; ++k) {
      const double h = 0.5 * (low + high);
      const auto z = h * root;
      (std::abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)))) <= 1 ? low : high) =
          h;
    }
    const Rov<double> hull(p);
    CHECK(auvest::largest_stable_step<Rk4>(hull, Rov<double>::State::Zero(),
                                           Rov<double>::Command::Zero()) ==
          doctest::Approx(low).epsilon(2e-3));
  }
}

// ---- Bad parameters -----------------------------------------------------------------------------

template <class Change>
Status remus_with(Change change) {
  auto p = auvest::remus100<double>();
  change(p);
  return Remus<double>(p).check();
}

TEST_CASE("bad parameters are reported") {
  using P = auvest::Torpedo<double>::Params;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(remus_with([](P&) {}) == Status::kOk);
  CHECK(remus_with([](P& p) { p.body.mass_kg = 0; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.body.mass_kg = -30; }) == Status::kBadParameter);
  CHECK(remus_with([&](P& p) { p.body.mass_kg = nan; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.body.iyy_kg_m2 = 0; }) == Status::kBadParameter);
  CHECK(remus_with([&](P& p) { p.body.zg_m = nan; }) == Status::kBadParameter);
  CHECK(remus_with([&](P& p) { p.added_mass.sway_kg = nan; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.restoring.buoyancy_n = -1; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.density_kg_m3 = 0; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.linear_damping.yaw_kg_m2_s = -1; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.lift_drag.aspect_ratio = 0; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.cross_flow.drag = -1; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.propeller.advance_1 = 0; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.propeller.shaft.time_constant_s = 0; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.rudder.servo.low = 0.1; }) == Status::kBadParameter);
  CHECK(remus_with([](P& p) { p.stern_planes.area_m2 = -1; }) == Status::kBadParameter);
  // Added mass with the wrong sign, as some transcriptions of the ROV's table have it.
  CHECK(remus_with([](P& p) { p.added_mass.sway_kg = -40; }) == Status::kNotPositiveDefinite);
  CHECK(remus_with([](P& p) { p.added_mass.sway_yaw_kg_m = 30; }) == Status::kNotPositiveDefinite);

  auto p = auvest::bluerov2_heavy<double>();
  CHECK(Rov<double>(p).check() == Status::kOk);
  p.quadratic_damping.surge_kg_m = -141;  // damping that feeds energy
  CHECK(Rov<double>(p).check() == Status::kBadParameter);
  p = auvest::bluerov2_heavy<double>();
  p.added_mass.roll_kg_m2 = -0.3;
  CHECK(Rov<double>(p).check() == Status::kNotPositiveDefinite);
  p = auvest::bluerov2_heavy<double>();
  p.thrusters.mounts[2].forward = 1;  // no unit vector
  CHECK(Rov<double>(p).check() == Status::kBadParameter);
  p = auvest::bluerov2_heavy<double>();
  p.thrusters.time_constant_s = 0;
  CHECK(Rov<double>(p).check() == Status::kBadParameter);
  CHECK(auvest::Hull<auvest::Rov<double, 8>>(auvest::bluerov2_heavy_wu2018<double>()).check() ==
        Status::kOk);
  CHECK(auvest::Hull<Yacht<double>>(auvest::remus100<double, auvest::Keel<double>>()).check() ==
        Status::kOk);
}

TEST_CASE_TEMPLATE("a step that fails leaves the state as it was", Scalar, float, double) {
  using Hull = Remus<Scalar>;
  const Hull hull(auvest::remus100<Scalar>());
  const auto still = current<Hull>(0, 0, 0);
  const auto c = command<Hull>(5, 0, 900);
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  typename Hull::State x = Hull::State::Zero();
  x(6) = Scalar(1);
  const typename Hull::State start = x;
  const auto unchanged = [&] { return std::memcmp(x.data(), start.data(), sizeof x) == 0; };
  const auto step = [&](const typename Hull::Command& command_, double h) {
    return auvest::advance<Rk4>(hull, x, command_, still, Scalar(h));
  };
  auto bad = c;
  bad(1) = nan;
  CHECK(step(bad, 0.1) == Status::kNotFinite);
  CHECK(unchanged());
  CHECK(step(c, -0.1) == Status::kTimeBackwards);
  CHECK(auvest::advance<Rk4>(hull, x, c, still, nan) == Status::kNotFinite);
  auto stream = still;
  stream(0) = nan;
  CHECK(auvest::advance<Rk4>(hull, x, c, stream, Scalar(0.1)) == Status::kNotFinite);
  CHECK(step(c, 1e30) == Status::kOverflow);
  CHECK(unchanged());
  typename Hull::State lost = x;
  lost(3) = nan;
  CHECK(auvest::advance<Rk4>(hull, lost, c, still, Scalar(0.1)) == Status::kNotFinite);
  CHECK(step(c, 0.1) == Status::kOk);
  CHECK(!unchanged());

  typename Hull::State steep = start;
  steep(4) = Scalar(79.9 * kDegree);
  steep(10) = Scalar(1);
  const typename Hull::State before = steep;
  CHECK(auvest::advance<SemiImplicit>(hull, steep, c, still, Scalar(0.01)) == Status::kSteepPitch);
  CHECK(std::memcmp(steep.data(), before.data(), sizeof steep) == 0);
  steep(10) = Scalar(-1);
  CHECK(auvest::advance<SemiImplicit>(hull, steep, c, still, Scalar(0.01)) == Status::kOk);
}

}  // namespace
