// The forces and actuators one by one, against closed forms and independent integrals.
#include <Eigen/Geometry>
#include <limits>

#include "auvest/vehicle/cross_flow.hpp"
#include "auvest/vehicle/remus100_prestero.hpp"
#include "auvest/vehicle/thrust_curve.hpp"
#include "close.hpp"
#include "peer_hull.hpp"
#include "support.hpp"

namespace {

using namespace vehicle;
using auvest::Status;

template <class Scalar>
double epsilon() {
  return double(std::numeric_limits<Scalar>::epsilon());
}

// ---- Cross flow ---------------------------------------------------------------------------------

TEST_CASE_TEMPLATE("cross flow: the closed form is the integral", Scalar, float, double) {
  const double printed[4][4] = {{0.3, 0.2, 0.1576533, 0.0409600},
                                {0.05, 0.4, 0.0258083, 0.0343615},
                                {0, 0.5, 0, 0.0512},
                                {-0.2, 0.1, -0.0674133, 0.0136533}};
  for (const auto& row : printed) {
    Scalar i0, i1;
    auvest::cross_flow_integrals(Scalar(1.6), Scalar(row[0]), Scalar(row[1]), i0, i1);
    CHECK(std::fabs(double(i0) - row[2]) <= 0.5001e-7);
    CHECK(std::fabs(double(i1) - row[3]) <= 0.5001e-7);
  }
  Uniform uniform;
  for (int k = 0; k < 2000; ++k) {
    const Scalar v = Scalar(uniform() * (k % 3 == 0 ? 0.1 : 1));
    const Scalar r = Scalar(uniform());
    Scalar i0, i1;
    auvest::cross_flow_integrals(Scalar(1.6), v, r, i0, i1);
    double e0, e1;
    peer::cross_flow_quadrature(1.6, double(v), double(r), e0, e1);
    // The integrand is at most (1 + 0.8)^2 over 1.6 m.
    CHECK(std::fabs(double(i0) - e0) <= 8 * epsilon<Scalar>());
    CHECK(std::fabs(double(i1) - e1) <= 8 * epsilon<Scalar>());
  }
}

TEST_CASE("cross flow: continuous where the bow stands still, odd, and 0 at rest") {
  const double r = 0.25, edge = 0.2;  // |v| = |r| L/2
  double a0, a1, b0, b1;
  auvest::cross_flow_integrals(1.6, edge * (1 + 1e-12), r, a0, a1);
  auvest::cross_flow_integrals(1.6, edge * (1 - 1e-12), r, b0, b1);
  CHECK(a0 == close_to(b0, 1e-11));
  CHECK(a1 == close_to(b1, 1e-11));
  auvest::cross_flow_integrals(1.6, -edge, -r, b0, b1);
  auvest::cross_flow_integrals(1.6, edge, r, a0, a1);
  CHECK(b0 == -a0);
  CHECK(b1 == -a1);
  auvest::cross_flow_integrals(1.6, 0.0, 0.0, a0, a1);
  CHECK(a0 == 0);
  CHECK(a1 == 0);
}

TEST_CASE("cross flow: the peers' 21 strips of a twentieth exaggerate, by 5 and by 21 percent") {
  const auto strips = [](double v, double r, int moment) {
    double sum = 0;
    for (int i = 0; i <= 20; ++i) {
      const double x = -0.8 + i * 0.08;
      const double s = v + x * r;
      sum += (moment ? x : 1) * s * std::fabs(s) * 0.08;
    }
    return sum;
  };
  double i0, i1;
  auvest::cross_flow_integrals(1.6, 0.3, 0.0, i0, i1);
  CHECK(strips(0.3, 0, 0) / i0 == doctest::Approx(1.05).epsilon(1e-9));
  auvest::cross_flow_integrals(1.6, 0.0, 0.5, i0, i1);
  CHECK(strips(0, 0.5, 1) / i1 == doctest::Approx(1.21).epsilon(1e-2));
}

// ---- Lift and drag, keel ------------------------------------------------------------------------

TEST_CASE_TEMPLATE("lift does no work, and the drag takes C_D0 + C_L^2/(pi e A)", Scalar, float,
                   double) {
  typename auvest::LiftDrag<Scalar>::Params p;
  p.area_m2 = Scalar(0.2);
  p.aspect_ratio = Scalar(0.5);
  p.drag = Scalar(0.05);
  p.lift_slope = Scalar(0.7);
  p.oswald = Scalar(0.7);
  const auvest::LiftDrag<Scalar> body(p, Scalar(1000));
  for (int k = 0; k < 36; ++k) {
    const double angle = k * 10 * kDegree, U = 1.3;
    const Scalar u = Scalar(U * std::cos(angle)), v = Scalar(U * std::sin(angle));
    Scalar along, across;
    body.forces(u, Scalar(v * v), Scalar(U), along, across);
    const double q = 0.5 * 1000 * 0.2 * U * U;
    const double CL = 0.7 * std::sin(angle) * std::cos(angle);
    const double CD = 0.05 + CL * CL / (kPi * 0.7 * 0.5);
    const double X = q * (CL * std::sin(angle) - CD * std::cos(angle));
    const double Y = q * (-CL * std::cos(angle) - CD * std::sin(angle));
    CHECK(std::fabs(double(along) - X) <= 16 * epsilon<Scalar>() * q);
    CHECK(std::fabs(double(across * v) - Y) <= 16 * epsilon<Scalar>() * q);
    const double power = double(along * u + across * v * v);
    CHECK(power == doctest::Approx(-q * CD * U).epsilon(32 * epsilon<Scalar>()));
  }
  Scalar along, across;
  body.forces(Scalar(0), Scalar(0), Scalar(0), along, across);
  CHECK(along == Scalar(0));
  CHECK(across == Scalar(0));
}

template <class Scalar>
typename auvest::Keel<Scalar>::Params example_keel() {
  typename auvest::Keel<Scalar>::Params p;
  p.foil.area_m2 = Scalar(0.02);
  p.foil.aspect_ratio = Scalar(2);
  p.foil.drag = Scalar(0.01);
  p.foil.lift_slope = auvest::low_aspect_lift_slope(Scalar(2));
  p.x_m = Scalar(-0.5);
  p.z_m = Scalar(0.2);
  return p;
}

TEST_CASE_TEMPLATE("keel: the example, dissipation, and none of area 0", Scalar, float, double) {
  const auvest::Keel<Scalar> keel(example_keel<Scalar>(), Scalar(1026));
  auvest::Flow<Scalar> flow;
  const Scalar example[6] = {Scalar(1.5), Scalar(0.1), Scalar(0),
                             Scalar(0),   Scalar(0),   Scalar(0.1)};
  flow.set(example, true, auvest::SixDof());
  Scalar tau[6] = {};
  keel.add_to(tau, flow, auvest::SixDof());
  const double printed[6] = {-0.203695, -2.010588, 0, 0.402118, -0.040739, 1.005294};
  for (int i = 0; i < 6; ++i)
    CHECK(std::fabs(double(tau[i]) - printed[i]) <= 0.5001e-6 + 4 * epsilon<Scalar>());

  Uniform uniform;
  for (int k = 0; k < 3000; ++k) {
    Scalar nu[6];
    for (Scalar& v : nu) v = Scalar(uniform());
    flow.set(nu, true, auvest::SixDof());
    Scalar f[6] = {};
    keel.add_to(f, flow, auvest::SixDof());
    double power = 0;
    for (int i = 0; i < 6; ++i) power += double(nu[i]) * double(f[i]);
    CHECK(power <= 1e-6);
  }

  const Remus<Scalar> without(auvest::remus100<Scalar>());
  const auvest::Hull<Yacht<Scalar>> none(auvest::remus100<Scalar, auvest::Keel<Scalar>>());
  typename Remus<Scalar>::State a = Remus<Scalar>::State::Zero(), b = a;
  run(without, a, command<Remus<Scalar>>(10, 2, 1200), current<Remus<Scalar>>(0, 0, 0), 0.02, 100);
  run(none, b, command<Remus<Scalar>>(10, 2, 1200), current<Remus<Scalar>>(0, 0, 0), 0.02, 100);
  for (int i = 0; i < Remus<Scalar>::kStates; ++i) CHECK(a(i) == b(i));
}

// ---- Propeller and fins -------------------------------------------------------------------------

TEST_CASE_TEMPLATE("propeller: its coefficients at two advance ratios, braking, and backwards",
                   Scalar, float, double) {
  const auto p = auvest::remus100<Scalar>().propeller;
  const auvest::Propeller<Scalar> propeller(p, Scalar(1026));
  const double D = 0.14, n = 20, J1 = 0.6632;
  const double unit = 1026 * std::pow(D, 4) * n * n;
  const double u1 = J1 * n * D / 0.944;
  const double tolerance = 8 * epsilon<Scalar>();
  CHECK(double(propeller.thrust(Scalar(n), Scalar(0))) == close_to(unit * 0.4566, tolerance));
  CHECK(double(propeller.thrust(Scalar(n), Scalar(u1))) == close_to(unit * 0.1798, 4 * tolerance));
  CHECK(double(propeller.torque(Scalar(n), Scalar(0))) == close_to(unit * D * 0.0700, tolerance));
  CHECK(double(propeller.torque(Scalar(n), Scalar(u1))) ==
        close_to(unit * D * 0.0312, 4 * tolerance));
  // Zero thrust at J = 1.094; more inflow brakes.
  const double zero = 0.4566 / (0.4566 - 0.1798) * J1;
  CHECK(std::fabs(zero - 1.094) <= 0.5e-3);
  const double u0 = zero * n * D / 0.944;
  CHECK(double(propeller.thrust(Scalar(n), Scalar(1.001 * u0))) < 0);
  CHECK(double(propeller.thrust(Scalar(n), Scalar(0.999 * u0))) > 0);
  // Backwards, and with the water from behind, no term in J.
  CHECK(propeller.thrust(Scalar(-n), Scalar(2)) == -propeller.thrust(Scalar(n), Scalar(0)));
  CHECK(propeller.thrust(Scalar(n), Scalar(-2)) == propeller.thrust(Scalar(n), Scalar(0)));
  CHECK(propeller.thrust(Scalar(0), Scalar(2)) == Scalar(0));
}

TEST_CASE_TEMPLATE("propeller: the inverse of its curve", Scalar, float, double) {
  const auto p = auvest::remus100<Scalar>().propeller;
  const auvest::Propeller<Scalar> propeller(p, Scalar(1026));
  for (const double u : {0.0, 0.5, 1.5, 2.0}) {
    for (const double force : {-30.0, -5.0, -0.1, 0.1, 5.0, 20.0}) {
      CAPTURE(u);
      CAPTURE(force);
      const Scalar n = propeller.speed_for(Scalar(force), Scalar(u));
      const Scalar given = p.thrust_deduction * propeller.thrust(n, Scalar(u));
      // At 2 m/s a small thrust is the difference of two of 60 N.
      CHECK(std::fabs(double(given) - force) <= 64 * epsilon<Scalar>() * 60);
    }
  }
  CHECK(propeller.speed_for(Scalar(1e4), Scalar(0)) == p.shaft.high);
  CHECK(propeller.speed_for(Scalar(-1e4), Scalar(0)) == p.shaft.low);
}

TEST_CASE(
    "fins: positive rudder turns to starboard, positive planes take the nose down; astern not") {
  const Remus<double> hull(auvest::remus100<double>());
  for (const double u : {2.0, -2.0}) {
    CAPTURE(u);
    const double nu[6] = {u, 0, 0, 0, 0, 0};
    const double rudder[3] = {0.1, 0, 0};
    const double planes[3] = {0, 0.1, 0};
    const peer::Vec6 straight = forces(hull, nu);
    const peer::Vec6 r = forces(hull, nu, nullptr, rudder) - straight;
    const peer::Vec6 s = forces(hull, nu, nullptr, planes) - straight;
    const double q = 0.5 * 1026 * 0.0133 * 4;
    const double sign = u > 0 ? 1 : -1;
    const peer::Vec6 er = (peer::Vec6() << -q * 0.5 * 0.01, -sign * q * 0.5 * 0.1, 0, 0, 0,
                           sign * 0.80768 * q * 0.5 * 0.1)
                              .finished();
    const peer::Vec6 es = (peer::Vec6() << -q * 0.7 * 0.01, 0, -sign * q * 0.7 * 0.1, 0,
                           -sign * 0.80768 * q * 0.7 * 0.1, 0)
                              .finished();
    CHECK((r - er).norm() < 1e-13);
    CHECK((s - es).norm() < 1e-13);
  }
}

// ---- Lags and thrust curves ---------------------------------------------------------------------

TEST_CASE("restoring: weight and buoyancy pull at their own centres, in any attitude") {
  // All arms differ, and so do W and B: r_g x W d - r_b x B d, d the down of the body's frame.
  auto p = auvest::remus100<double>();
  p.body.xg_m = 0.03, p.body.yg_m = -0.02, p.body.zg_m = 0.05;
  p.restoring.xb_m = -0.07, p.restoring.yb_m = 0.04, p.restoring.zb_m = -0.01;
  p.restoring.weight_n = 300, p.restoring.buoyancy_n = 310;
  const Remus<double> hull(p);
  const double still[6] = {0, 0, 0, 0, 0, 0};
  const double angles[3] = {0.4, -0.7, 2};
  const Eigen::Vector3d down(std::sin(0.7), std::cos(0.7) * std::sin(0.4),
                             std::cos(0.7) * std::cos(0.4));
  const Eigen::Vector3d weight = 300 * down, lift = -310 * down;
  const Eigen::Vector3d moment = Eigen::Vector3d(0.03, -0.02, 0.05).cross(weight) +
                                 Eigen::Vector3d(-0.07, 0.04, -0.01).cross(lift);
  const auto tau = forces(hull, still, angles);
  for (int i = 0; i < 3; ++i) {
    CAPTURE(i);
    CHECK(tau(i) == close_to(weight(i) + lift(i), 1e-13));
    CHECK(tau(3 + i) == close_to(moment(i), 1e-13));
  }
}

/// Actuators beyond limits of which no two are alike, and within them.
template <class Hull>
void check_limits(const typename Hull::Params& params) {
  const Hull hull(params);
  double beyond[3] = {9, 9, 9}, below[3] = {-9, -9, -9}, within[3] = {0.05, -0.1, 0.2};
  hull.vehicle().limit_actuators(beyond);
  hull.vehicle().limit_actuators(below);
  hull.vehicle().limit_actuators(within);
  for (int i = 0; i < 3; ++i) {
    CAPTURE(i);
    CHECK(beyond[i] == 0.1 * (i + 1));
    CHECK(below[i] == -0.2 * (i + 1));
    CHECK(within[i] == (i == 0 ? 0.05 : i == 1 ? -0.1 : 0.2));
  }
}

template <class Params>
void set_limits(Params& lag, int i) {
  lag.high = 0.1 * (i + 1);
  lag.low = -0.2 * (i + 1);
}

TEST_CASE("torpedoes: rudder, stern planes and shaft stay within their own limits") {
  auto p = auvest::remus100<double>();
  set_limits(p.rudder.servo, 0), set_limits(p.stern_planes.servo, 1);
  set_limits(p.propeller.shaft, 2);
  check_limits<Remus<double>>(p);
  auto q = auvest::remus100_prestero<double>();
  set_limits(q.rudder, 0), set_limits(q.stern_planes, 1), set_limits(q.shaft, 2);
  check_limits<auvest::Hull<auvest::CoefficientTorpedo<double>>>(q);
}

TEST_CASE("lag: saturation, dead band, rate limit, and the exponential between them") {
  auto p = auvest::Lag<double>::Params::symmetric(0.25, 0.1);
  p.dead_band = 0.02;
  p.rate_limit = 0.5;
  const auvest::Lag<double> lag(p);
  CHECK(lag.demand(0.3) == 0.25);
  CHECK(lag.demand(-0.3) == -0.25);
  CHECK(lag.demand(0.1) == 0.1);
  CHECK(lag.demand(0.019) == 0);
  CHECK(lag.demand(-0.019) == 0);
  CHECK(lag.demand(-0.02) == -0.02);
  CHECK(std::isnan(lag.demand(std::numeric_limits<double>::quiet_NaN())));
  CHECK(lag.rate(0.0, 0.25) == 0.5);
  CHECK(lag.rate(0.25, -0.25) == -0.5);
  CHECK(lag.rate(0.0, 0.04) == doctest::Approx(0.4));

  using Hull = Remus<double>;
  const Hull hull(auvest::remus100<double>());
  Hull::State x = Hull::State::Zero();
  run(hull, x, command<Hull>(20, -20, 3000), current<Hull>(0, 0, 0), 0.01, 50);
  const auto& params = hull.params();
  CHECK(x(12) == doctest::Approx(15 * kDegree * (1 - std::exp(-5))).epsilon(1e-6));
  CHECK(x(13) == doctest::Approx(-15 * kDegree * (1 - std::exp(-5))).epsilon(1e-6));
  CHECK(x(14) == doctest::Approx(1525 / 60.0 * (1 - std::exp(-0.5))).epsilon(1e-6));
  CHECK(hull.demands(command<Hull>(20, 0, 0))(0) == params.rudder.servo.high);
  // A state beyond its limit is brought back.
  x(12) = 1;
  run(hull, x, command<Hull>(20, 0, 0), current<Hull>(0, 0, 0), 0.001, 1);
  CHECK(x(12) == params.rudder.servo.high);
}

TEST_CASE_TEMPLATE("thrust of the ROV: its curve, its maximum, and its inverse", Scalar, float,
                   double) {
  const auto p = auvest::bluerov2_heavy<Scalar>().thrusters.curve;
  const auvest::OddThrust<Scalar> curve(p);
  CHECK(curve.check() == Status::kOk);
  CHECK(std::fabs(double(curve.highest()) - 30.62) < 0.005);
  CHECK(curve.lowest() == -curve.highest());
  CHECK(curve.thrust(Scalar(1)) == curve.highest());
  CHECK(curve.thrust(Scalar(-1)) == curve.lowest());
  for (int i = -200; i <= 200; ++i) {
    const Scalar f = Scalar(30.6 * i / 200);
    const Scalar c = curve.input(f);
    CHECK(double(c) * i >= 0);
    CHECK(std::fabs(double(curve.thrust(c) - f)) <= 64 * epsilon<Scalar>() * 30);
  }
  CHECK(curve.input(Scalar(0)) == Scalar(0));
  CHECK(curve.input(Scalar(100)) == p.limit);
  CHECK(curve.input(Scalar(-100)) == -p.limit);
  // To c = 1 the curve is not monotone: 30.4 N there, with a slope of -17.
  auto whole = p;
  whole.limit = Scalar(1);
  const auvest::OddThrust<Scalar> bent(whole);
  CHECK(double(bent.highest()) == doctest::Approx(30.4).epsilon(1e-5));
  CHECK(bent.check() == Status::kBadParameter);
}

TEST_CASE_TEMPLATE("thrust with dead band and less of it astern", Scalar, float, double) {
  typename auvest::QuadraticThrust<Scalar>::Params p;
  p.ahead_n = Scalar(51);
  p.astern_n = Scalar(40);
  p.dead_band = Scalar(0.08);
  const auvest::QuadraticThrust<Scalar> curve(p);
  CHECK(curve.check() == Status::kOk);
  CHECK(curve.thrust(Scalar(1)) == Scalar(51));
  CHECK(curve.thrust(Scalar(-1)) == Scalar(-40));
  CHECK(curve.thrust(Scalar(2)) == Scalar(51));
  for (const double c : {-0.0799, -0.01, 0.0, 0.01, 0.0799}) {
    CHECK(curve.thrust(Scalar(c)) == Scalar(0));
  }
  CHECK(double(curve.thrust(Scalar(0.54))) == doctest::Approx(51.0 / 4).epsilon(1e-6));
  for (int i = -40; i <= 51; ++i) {
    const Scalar c = curve.input(Scalar(i));
    CHECK(std::fabs(double(curve.thrust(c)) - i) <= 64 * epsilon<Scalar>() * 51);
    if (i != 0) CHECK(std::fabs(double(c)) > 0.08);
  }
  CHECK(curve.input(Scalar(0)) == Scalar(0));
  CHECK(curve.input(Scalar(-41)) == Scalar(-1));
  p.dead_band = Scalar(1);
  CHECK(auvest::QuadraticThrust<Scalar>(p).check() == Status::kBadParameter);
}

TEST_CASE("an asymmetric thruster drives the ROV like any other") {
  using Vehicle = auvest::Rov<double, 8, auvest::QuadraticThrust<double>>;
  using Body = auvest::Hull<Vehicle>;
  const auto heavy = auvest::bluerov2_heavy<double>();
  Vehicle::Params p;
  static_cast<auvest::HullParams<double>&>(p) = heavy;
  p.linear_damping = heavy.linear_damping;
  p.quadratic_damping = heavy.quadratic_damping;
  for (int i = 0; i < 8; ++i) {
    const auto& from = heavy.thrusters.mounts[i];
    auvest::detail::place_thruster(p.thrusters.mounts[i], from.x_m, from.y_m, from.z_m,
                                   from.forward, from.starboard, from.down);
  }
  p.thrusters.curve.ahead_n = 51;
  p.thrusters.curve.astern_n = 40;
  p.thrusters.time_constant_s = 0.1;
  const Body hull(p);
  REQUIRE(hull.check() == Status::kOk);
  Body::State x = Body::State::Zero();
  Body::Command c = Body::Command::Zero();
  for (int i = 4; i < 8; ++i) c(i) = -1;
  run(hull, x, c, current<Body>(0, 0, 0), 0.02, 2000);
  // 33 w + 190 w^2 = 4 x 40 N + 0.982 N
  CHECK(x(8) == doctest::Approx((-33 + std::sqrt(33 * 33 + 760 * (160 + 0.982))) / 380));
}

}  // namespace
