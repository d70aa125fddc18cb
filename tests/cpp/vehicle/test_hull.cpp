// What a hull must do whatever its coefficients: conserve, dissipate, be invariant; and what the
// peers' hulls do not.
#include "auvest/vehicle/hull.hpp"

#include <Eigen/Eigenvalues>
#include <limits>

#include "auvest/vehicle/spheroid.hpp"
#include "close.hpp"
#include "peer_hull.hpp"
#include "support.hpp"

namespace {

using namespace vehicle;
using auvest::Matrix;
using auvest::Status;

template <class Scalar>
constexpr double epsilon() {
  return double(std::numeric_limits<Scalar>::epsilon());
}

/// remus100 in an ideal fluid: no damping, no lift, the whole of C_A.
template <class Scalar>
typename Remus<Scalar>::Params ideal() {
  auto p = auvest::remus100<Scalar>();
  p.linear_damping = decltype(p.linear_damping)();
  p.lift_drag.drag = p.lift_drag.lift_slope = Scalar(0);
  p.cross_flow.drag = Scalar(0);
  p.added_mass.munk = true;
  return p;
}

// ---- The parameters -----------------------------------------------------------------------------

TEST_CASE("remus100: the numbers follow from length, diameter and stated ratios") {
  const auto p = auvest::remus100<double>();
  const double L = 1.6, d = 0.19;
  const auvest::Spheroid<double> shape = {1.0096 * L / 2, 1.0096 * d / 2, 1026};
  const auto body = shape.body();
  const auto added = shape.added_mass();
  CHECK(p.body.mass_kg == close_to(body.mass_kg, 1e-14));
  CHECK(p.body.ixx_kg_m2 == close_to(body.ixx_kg_m2, 1e-14));
  CHECK(p.body.iyy_kg_m2 == close_to(body.iyy_kg_m2, 1e-14));
  CHECK(p.body.izz_kg_m2 == p.body.iyy_kg_m2);
  CHECK(p.added_mass.surge_kg == close_to(added.surge_kg, 1e-12));
  CHECK(p.added_mass.sway_kg == close_to(added.sway_kg, 1e-12));
  CHECK(p.added_mass.heave_kg == p.added_mass.sway_kg);
  CHECK(p.added_mass.roll_kg_m2 == close_to(0.3 * body.ixx_kg_m2, 1e-14));
  CHECK(p.added_mass.pitch_kg_m2 == close_to(added.pitch_kg_m2, 1e-12));
  CHECK(p.added_mass.yaw_kg_m2 == p.added_mass.pitch_kg_m2);
  CHECK(p.lift_drag.area_m2 == close_to(0.7 * L * d, 1e-14));
  CHECK(p.lift_drag.aspect_ratio == close_to(d * d / p.lift_drag.area_m2, 1e-14));
  const double b = shape.b_m;
  CHECK(p.lift_drag.drag == close_to(0.42 * kPi * b * b / p.lift_drag.area_m2, 1e-14));
  CHECK(p.lift_drag.lift_slope ==
        close_to(auvest::low_aspect_lift_slope(p.lift_drag.aspect_ratio), 1e-14));
  CHECK(p.rudder.x_m == close_to(-shape.a_m, 1e-15));
  CHECK(p.restoring.weight_n == close_to(313.2494, 2e-7));

  const Remus<double> hull(p);
  const auto& M = hull.mass_matrix();
  const double diagonal[6] = {32.79494, 62.22524, 62.22524, 0.165519, 7.831479, 7.818706};
  for (int i = 0; i < 6; ++i) CHECK(M(i, i) == close_to(diagonal[i], 2e-6));
  CHECK(M(0, 4) == close_to(0.638633, 1e-6));
  CHECK(M(1, 3) == close_to(-0.638633, 1e-6));
  CHECK(M.isApprox(M.transpose()));
  const double w4 = std::sqrt(p.restoring.weight_n * 0.02 / M(3, 3));
  const double w5 = std::sqrt(p.restoring.weight_n * 0.02 / M(4, 4));
  CHECK(p.linear_damping.surge_kg_s == close_to(M(0, 0) / 20, 1e-13));
  CHECK(p.linear_damping.sway_kg_s == close_to(M(1, 1) / 20, 1e-13));
  CHECK(p.linear_damping.roll_kg_m2_s == close_to(2 * 0.3 * w4 * M(3, 3), 1e-13));
  CHECK(p.linear_damping.pitch_kg_m2_s == close_to(2 * 0.8 * w5 * M(4, 4), 1e-13));
  CHECK(p.linear_damping.yaw_kg_m2_s == close_to(M(5, 5), 1e-13));
}

TEST_CASE("spheroid: the sphere's added mass is half of its displacement") {
  // e = 0.02: the series of alpha and beta have lost 8 of their 16 digits, not more.
  const auvest::Spheroid<double> ball = {1.0002, 1, 1000};
  CHECK(ball.added_mass().surge_kg / ball.body().mass_kg == close_to(0.5, 1e-3));
  CHECK(ball.added_mass().sway_kg / ball.body().mass_kg == close_to(0.5, 1e-3));
  const auvest::Spheroid<float> slender = {0.80768f, 0.095912f, 1026.0f};
  CHECK(double(slender.added_mass().sway_kg) == close_to(30.2936055, 1e-5));
}

TEST_CASE("mass matrix: steps from the centre of gravity to the origin, for any place of it") {
  auvest::RigidBody<double>::Params p;
  p.mass_kg = 7;
  p.ixx_kg_m2 = 1;
  p.iyy_kg_m2 = 2;
  p.izz_kg_m2 = 3;
  p.xg_m = 0.3;
  p.yg_m = -0.2;
  p.zg_m = 0.1;
  Matrix<double, 6, 6> M = Matrix<double, 6, 6>::Zero();
  auvest::RigidBody<double>(p).add_to(M);
  peer::Mat6 H = peer::Mat6::Identity();
  H.topRightCorner<3, 3>() = -peer::skew(peer::Vec3(0.3, -0.2, 0.1));
  peer::Mat6 about_cg = peer::Mat6::Zero();
  about_cg.diagonal() << 7, 7, 7, 1, 2, 3;
  CHECK((M - H.transpose() * about_cg * H).norm() < 1e-14);
}

// ---- Coriolis -----------------------------------------------------------------------------------

TEST_CASE_TEMPLATE("Coriolis: does no work, for every symmetric M", Scalar, float, double) {
  Uniform uniform;
  const auto p = auvest::remus100<Scalar>();
  Matrix<Scalar, 6, 6> rigid = Matrix<Scalar, 6, 6>::Zero();
  auvest::RigidBody<Scalar>(p.body).add_to(rigid);
  Matrix<Scalar, 6, 6> added = Matrix<Scalar, 6, 6>::Zero();
  auvest::AddedMass<Scalar>(p.added_mass).add_to(added);
  for (int k = 0; k < 3000; ++k) {
    Matrix<Scalar, 6, 6> any;
    Scalar nu[6];
    for (int i = 0; i < 6; ++i) {
      nu[i] = Scalar(uniform());
      for (int j = 0; j <= i; ++j) any(i, j) = any(j, i) = Scalar(20 * uniform());
    }
    for (int which = 0; which < 5; ++which) {
      CAPTURE(which);
      Scalar tau[6] = {0, 0, 0, 0, 0, 0};
      if (which == 0) auvest::subtract_coriolis(rigid, nu, tau, auvest::SixDof());
      if (which == 1) auvest::subtract_coriolis(added, nu, tau, auvest::SixDof());
      if (which == 2) {
        const Matrix<Scalar, 6, 6> both = rigid + added;
        auvest::subtract_coriolis(both, nu, tau, auvest::SixDof());
      }
      if (which == 3) {
        auvest::AddedMass<Scalar>(p.added_mass)
            .subtract_reduced_coriolis(nu, tau, auvest::SixDof());
      }
      if (which == 4) auvest::subtract_coriolis(any, nu, tau, auvest::SixDof());
      double work = 0, size = 0;
      for (int i = 0; i < 6; ++i) {
        work += double(nu[i]) * double(tau[i]);
        size += std::fabs(double(nu[i]) * double(tau[i]));
      }
      // A few roundings per product; 100 N m/s are the largest.
      CHECK(std::fabs(work) <= 20 * epsilon<Scalar>() * (size + 100));
      if (which != 4) continue;
      peer::Vec6 v;
      peer::Mat6 m;
      for (int i = 0; i < 6; ++i) {
        v(i) = double(nu[i]);
        for (int j = 0; j < 6; ++j) m(i, j) = double(any(i, j));
      }
      const peer::Mat6 C = peer::coriolis(m, v);
      CHECK((C + C.transpose()).norm() == 0);
      const peer::Vec6 expected = -C * v;
      for (int i = 0; i < 6; ++i) {
        CHECK(std::fabs(double(tau[i]) - expected(i)) <= 1000 * epsilon<Scalar>());
      }
    }
  }
}

TEST_CASE("Coriolis: what is left without the Munk moment") {
  const auto p = auvest::remus100<double>();
  const auvest::AddedMass<double> added(p.added_mass);
  const double nu[6] = {1, 0.2, -0.3, 0.4, 0.5, -0.6};
  double tau[6] = {0, 0, 0, 0, 0, 0};
  added.subtract_reduced_coriolis(nu, tau, auvest::SixDof());
  // C_A nu with the pairs (5,1), (5,3), (6,1), (6,2) and their mirrors struck out.
  peer::Mat6 M = peer::Mat6::Zero();
  M.diagonal() << p.added_mass.surge_kg, p.added_mass.sway_kg, p.added_mass.heave_kg,
      p.added_mass.roll_kg_m2, p.added_mass.pitch_kg_m2, p.added_mass.yaw_kg_m2;
  peer::Vec6 v;
  for (int i = 0; i < 6; ++i) v(i) = nu[i];
  peer::Mat6 C = peer::coriolis(M, v);
  const int pairs[4][2] = {{4, 0}, {4, 2}, {5, 0}, {5, 1}};
  for (const auto& pair : pairs) C(pair[0], pair[1]) = C(pair[1], pair[0]) = 0;
  const peer::Vec6 expected = -C * v;
  for (int i = 0; i < 6; ++i) CHECK(std::fabs(tau[i] - expected(i)) < 1e-14);
  CHECK(tau[1] == close_to(30.2936055125789 * 0.3 * -0.4, 1e-14));
}

// ---- Conservation -------------------------------------------------------------------------------

TEST_CASE("ideal fluid: energy and momentum are conserved (Kirchhoff), RK4's drift is of order 5") {
  using Hull = Remus<double>;
  auto p = ideal<double>();
  p.body.zg_m = 0;
  const Hull hull(p);
  const auto still = current<Hull>(0, 0, 0);
  const double start[6] = {1, 0.3, -0.2, 0.4, 0.3, -0.5};
  const double steps[] = {0.04, 0.02, 0.01};
  const double drift[] = {-9.8e-8, -3.4e-9, -1.2e-10};  // of the energy, two digits
  const auto energy = [&](const Hull::State& x) {
    const peer::Vec6 nu = x.segment<6>(6);
    return nu.dot(hull.mass_matrix() * nu);
  };
  for (int i = 0; i < 3; ++i) {
    CAPTURE(steps[i]);
    Hull::State x = Hull::State::Zero();
    for (int k = 0; k < 6; ++k) x(6 + k) = start[k];
    const double before = energy(x);
    run(hull, x, command<Hull>(0, 0, 0), still, steps[i], int(std::lround(4 / steps[i])));
    const double last_digit = std::pow(10.0, std::floor(std::log10(-drift[i])) - 1);
    CHECK(std::fabs(energy(x) / before - 1 - drift[i]) <= 0.6 * last_digit);

    const peer::Vec6 nu = x.segment<6>(6);
    const peer::Vec6 momenta = hull.mass_matrix() * nu;
    const peer::Mat3 R = peer::rotation(x(3), x(4), x(5));
    const peer::Vec3 P = R * momenta.head<3>();
    const peer::Vec3 H = R * momenta.tail<3>() + peer::Vec3(x.head<3>()).cross(P);
    const double expected[6] = {32.79494, 18.667573, -12.445049, 0.061098, 2.345612, -3.909353};
    for (int k = 0; k < 6; ++k) {
      const double found = k < 3 ? P(k) : H(k - 3);
      // 4e-6 of RK4 at 0.01 s, and up by the fourth power; half a digit of the table.
      CHECK(std::fabs(found - expected[k]) < 5.1e-6 + 4e-6 * std::pow(steps[i] / 0.01, 4));
    }
  }
}

TEST_CASE("ideal fluid: in float the energy drifts by rounding alone") {
  using Hull = Remus<float>;
  auto p = ideal<float>();
  p.body.zg_m = 0;
  const Hull hull(p);
  Hull::State x = Hull::State::Zero();
  const float start[6] = {1, 0.3f, -0.2f, 0.4f, 0.3f, -0.5f};
  for (int k = 0; k < 6; ++k) x(6 + k) = start[k];
  const auto energy = [&] {
    const peer::Vec6 nu = x.segment<6>(6).cast<double>();
    return nu.dot(hull.mass_matrix().cast<double>() * nu);
  };
  const double before = energy();
  run(hull, x, command<Hull>(0, 0, 0), current<Hull>(0, 0, 0), 0.02, 200);
  CHECK(std::fabs(energy() / before - 1) < 200 * 1.2e-7);  // one epsilon per step
}

TEST_CASE("RK4: of fourth order through actuators, fins and propeller") {
  using Hull = Remus<double>;
  const Hull hull(auvest::remus100<double>());
  const auto still = current<Hull>(0, 0, 0);
  const auto go = [&](double h) {
    Hull::State x = Hull::State::Zero();
    x(6) = 1.5;
    x(12 + auvest::kPropeller) = 15;
    run(hull, x, command<Hull>(5, 1, 1000), still, h, int(std::lround(4 / h)));
    return x;
  };
  const Hull::State exact = go(0.0025);
  const double steps[] = {0.1, 0.05, 0.025};
  const double printed[] = {3.4e-6, 1.5e-7, 7.7e-9};
  for (int i = 0; i < 3; ++i) {
    CAPTURE(steps[i]);
    const double worst = (go(steps[i]) - exact).head<12>().cwiseAbs().maxCoeff();
    const double last_digit = std::pow(10.0, std::floor(std::log10(printed[i])) - 1);
    CHECK(std::fabs(worst - printed[i]) <= 0.5001 * last_digit);
  }
}

// ---- Natural periods ----------------------------------------------------------------------------

/// The mean period of an angle over ten zero crossings.
template <class Hull>
double period(const Hull& hull, int angle) {
  const auto still = current<Hull>(0, 0, 0);
  typename Hull::State x = Hull::State::Zero();
  const typename Hull::Command none = Hull::Command::Zero();
  x(angle) = 0.5 * kDegree;
  const double h = 0.005;
  double first = 0;
  int crossings = 0;
  double t = 0;
  while (crossings < 11) {
    const double before = x(angle);
    auvest::Rk4::step(hull, x, none, still, h);
    if (before * x(angle) < 0) {
      const double at = t + h * before / (before - x(angle));
      if (crossings == 0) first = at;
      if (crossings == 10) return (at - first) / 5;
      ++crossings;
    }
    t += h;
  }
  return 0;
}

TEST_CASE("natural periods: sway and surge swing with the hull") {
  const Remus<double> remus(ideal<double>());
  const peer::Mat6 inverse = remus.mass_matrix().inverse();
  const double stiff = remus.params().restoring.weight_n * 0.02;
  const double roll = 2 * kPi / std::sqrt(stiff * inverse(3, 3));
  const double pitch = 2 * kPi / std::sqrt(stiff * inverse(4, 4));
  // Half a degree lengthens a pendulum's period by (0.5 deg)^2 / 16 = 5e-6.
  const double swung[2] = {period(remus, 3), period(remus, 4)};
  CHECK(swung[0] == close_to(roll, 2e-5));
  CHECK(swung[1] == close_to(pitch, 2e-5));
  CHECK(std::fabs(swung[0] - 1.0009) <= 0.5e-4);
  CHECK(std::fabs(swung[1] - 7.0194) <= 0.5e-4);
  CHECK(2 * kPi * std::sqrt(remus.mass_matrix()(3, 3) / stiff) == close_to(1.0213, 1e-4));

  auto p = auvest::bluerov2_heavy<double>();
  p.linear_damping = decltype(p.linear_damping)();
  p.quadratic_damping = decltype(p.quadratic_damping)();
  p.restoring.weight_n = p.restoring.buoyancy_n;
  CHECK(period(Rov<double>(p), 3) == close_to(3.6703, 2e-5));
  CHECK(period(Rov<double>(p), 4) == close_to(3.3092, 2e-5));
}

// ---- Invariance ---------------------------------------------------------------------------------

TEST_CASE_TEMPLATE("Galilei: a current only carries the hull away", Scalar, float, double) {
  using Hull = Remus<Scalar>;
  const Hull hull(auvest::remus100<Scalar>());
  const auto stream = current<Hull>(0.3, -0.4, 0.1);
  const auto still = current<Hull>(0, 0, 0);
  typename Hull::State a = hull.at_rest(still);
  typename Hull::State b = hull.at_rest(still);
  a(3) = b(3) = Scalar(0.1);
  a(4) = b(4) = Scalar(-0.2);
  run(hull, a, command<Hull>(5, 1, 1200), still, 0.02, 1000);
  run(hull, b, command<Hull>(5, 1, 1200), stream, 0.02, 1000);
  for (int i = 3; i < Hull::kStates; ++i) CHECK(a(i) == b(i));  // to the bit
  // Positions: 1,000 roundings of numbers below 40 m.
  for (int i = 0; i < 3; ++i) {
    CHECK(std::fabs(double(b(i) - a(i)) - 20 * double(stream(i))) < 1000 * 20 * epsilon<Scalar>());
  }
  const auto ground = hull.ground_velocity(b, stream);
  const peer::Mat3 R = peer::rotation(double(b(3)), double(b(4)), double(b(5)));
  const peer::Vec3 expected = R.transpose() * peer::Vec3(0.3, -0.4, 0.1);
  for (int i = 0; i < 3; ++i) {
    CHECK(std::fabs(double(ground(i) - b(6 + i)) - expected(i)) < 4 * epsilon<Scalar>());
  }
}

/// The difference that a current of 0.5 m/s makes to a run of 20 s, seen from the water.
double galilean_error(const peer::Form& form, double tilt, double* heading = nullptr) {
  using State = Eigen::Matrix<double, 15, 1>;
  const peer::Torpedo hull(form);
  const peer::Vec3 stream(0.3, -0.4, 0);
  State a = State::Zero(), b = State::Zero();
  a(3) = b(3) = tilt;
  a(4) = b(4) = -2 * tilt;
  b.segment<3>(6) = peer::rotation(b(3), b(4), b(5)).transpose() * stream;
  for (int k = 0; k < 2000; ++k) {
    const peer::Vec3 command(5 * kDegree, 1 * kDegree, 20);
    hull.rk4(a, command, peer::Vec3::Zero(), 0.01);
    hull.rk4(b, command, stream, 0.01);
  }
  if (heading) *heading = std::fabs(b(5) - a(5)) / kDegree;
  return (b.head<3>() - a.head<3>() - 20 * stream).norm();
}

TEST_CASE("Galilei: the peers' hulls feel a current that they cannot feel") {
  CHECK(galilean_error(peer::Form(), 0) < 1e-11);  // nu as the state: to the order of RK4
  CHECK(galilean_error(peer::Form(), 0.1) < 1e-7);
  peer::Form ground;
  ground.ground_thrust = true;
  double heading = 0;
  CHECK(galilean_error(ground, 0, &heading) > 1);
  CHECK(heading > 1);
  peer::Form yaw_only;
  yaw_only.yaw_only_current = true;
  CHECK(galilean_error(yaw_only, 0) > 1e-3);
}

TEST_CASE_TEMPLATE("yaw: start, current and result turn together", Scalar, float, double) {
  using Hull = Remus<Scalar>;
  const Hull hull(auvest::remus100<Scalar>());
  const double turn = 1;
  const auto stream = current<Hull>(0.3, -0.4, 0.1);
  const auto turned = current<Hull>(0.3 * std::cos(turn) + 0.4 * std::sin(turn),
                                    0.3 * std::sin(turn) - 0.4 * std::cos(turn), 0.1);
  typename Hull::State a = hull.at_rest(stream);
  typename Hull::State b = a;
  b(5) = Scalar(turn);
  run(hull, a, command<Hull>(5, 1, 1200), stream, 0.02, 500);
  run(hull, b, command<Hull>(5, 1, 1200), turned, 0.02, 500);
  const double x = double(a(0)), y = double(a(1));
  const double bound = 500 * 16 * epsilon<Scalar>();  // roundings of numbers below 16
  CHECK(std::fabs(double(b(0)) - (x * std::cos(turn) - y * std::sin(turn))) < bound);
  CHECK(std::fabs(double(b(1)) - (x * std::sin(turn) + y * std::cos(turn))) < bound);
  CHECK(std::fabs(double(b(5)) - double(a(5)) - turn) < bound);
  for (int i : {2, 3, 4, 6, 7, 8, 9, 10, 11}) CHECK(a(i) == b(i));
}

TEST_CASE("without thrust a hull ends adrift, level") {
  using Hull = Remus<double>;
  const Hull hull(auvest::remus100<double>());
  const auto stream = current<Hull>(0.35, 0.35, 0.1);
  Hull::State x = hull.at_rest(stream);
  run(hull, x, command<Hull>(0, 0, 0), stream, 0.1, 7000);
  for (int i = 6; i < 12; ++i) CHECK(std::fabs(x(i)) < 1e-12);
  CHECK(std::fabs(x(3)) < 1e-12);
  CHECK(std::fabs(x(4)) < 1e-12);
}

template <class Hull>
void check_stays(const Hull& hull) {
  using Scalar = typename Hull::Scalar;
  const auto still = current<Hull>(0, 0, 0);
  typename Hull::State x = hull.at_rest(still);
  x(5) = Scalar(0.7);
  x(0) = Scalar(3);
  const typename Hull::State start = x;
  run(hull, x, typename Hull::Command(Hull::Command::Zero()), still, 0.05, 100);
  for (int i = 0; i < Hull::kStates; ++i) CHECK(x(i) == start(i));
}

TEST_CASE_TEMPLATE("neutral, level and at rest it stays, bit for bit", Scalar, float, double) {
  check_stays(Remus<Scalar>(auvest::remus100<Scalar>()));
  auto p = auvest::bluerov2_heavy<Scalar>();
  p.restoring.buoyancy_n = p.restoring.weight_n;
  check_stays(Rov<Scalar>(p));
}

// ---- Terminal speeds ----------------------------------------------------------------------------

TEST_CASE("torpedo: speed per revolution, once the linear drag is left out") {
  auto p = auvest::remus100<double>();
  p.linear_damping.surge_kg_s = 0;
  const Remus<double> hull(p);
  // 0.9 T(n, u) = drag u^2 is homogeneous in (n, u): u/n is one number.
  for (const double n : {5.0, 15.0, 25.0}) {
    const double nu[6] = {0.0999430 * n, 0, 0, 0, 0, 0};
    const double actuators[3] = {0, 0, n};
    const double scale = p.lift_drag.drag * 0.5 * 1026 * 0.2128 * nu[0] * nu[0];
    CHECK(std::fabs(forces(hull, nu, nullptr, actuators)(0)) < 2e-6 * scale);
  }
}

template <class Scalar>
void check_rov_terminal(double relative) {
  auto p = auvest::bluerov2_heavy<Scalar>();
  {
    // 33 w + 190 w^2 = W - B.
    const Rov<Scalar> sinking(p);
    typename Rov<Scalar>::State x = Rov<Scalar>::State::Zero();
    const typename Rov<Scalar>::Command none = Rov<Scalar>::Command::Zero();
    run(sinking, x, none, current<Rov<Scalar>>(0, 0, 0), 0.05, 2000);
    CHECK(double(x(8)) == close_to(0.0258964, 4e-6 + relative * 140));  // W - B cancels 2 digits
  }
  p.restoring.buoyancy_n = p.restoring.weight_n;
  const Rov<Scalar> hull(p);
  const auto& thrusters = hull.vehicle().thrusters;
  const Scalar full = thrusters.curve.input(Scalar(30.4));
  using Planar = auvest::Hull<auvest::Rov<Scalar, 8>, auvest::ThreeDof>;
  const Planar planar(p);
  const auto steady = [&](int s1, int s2, int s3, int s4) {
    typename Planar::State x = Planar::State::Zero();
    typename Planar::Command c = Planar::Command::Zero();
    const int sign[4] = {s1, s2, s3, s4};
    for (int i = 0; i < 4; ++i) c(i) = Scalar(sign[i]) * full;
    run(planar, x, c, current<Planar>(0, 0, 0), 0.02, 2000);
    return x;
  };
  CHECK(double(steady(1, 1, -1, -1)(3)) == close_to(0.733836, 1e-6 + relative));
  CHECK(double(steady(-1, 1, -1, 1)(4)) == close_to(0.629476, 1e-6 + relative));
  const auto spin = steady(-1, 1, 1, -1);
  CHECK(double(spin(5)) == close_to(3.912, 1.3e-4 + relative));
  CHECK(1.5 * double(spin(5)) * double(spin(5)) == close_to(22.958, 3e-5 + 2 * relative));

  typename Rov<Scalar>::State x = Rov<Scalar>::State::Zero();
  typename Rov<Scalar>::Command c = Rov<Scalar>::Command::Zero();
  for (int i = 4; i < 8; ++i) c(i) = -full;
  run(hull, x, c, current<Rov<Scalar>>(0, 0, 0), 0.02, 2000);
  CHECK(double(x(8)) == close_to(0.717858, 1e-6 + relative));
}

TEST_CASE("ROV: terminal speeds") { check_rov_terminal<double>(0); }
TEST_CASE("ROV: terminal speeds in float") { check_rov_terminal<float>(1e-6); }

// ---- Dissipation and symmetry -------------------------------------------------------------------

/// Damping, lift and drag alone.
template <class Hull>
peer::Vec6 loads(const Hull& hull, const double* nu) {
  using Scalar = typename Hull::Scalar;
  Scalar v[6], tau[6] = {0, 0, 0, 0, 0, 0};
  const Scalar none[Hull::kActuators] = {};
  for (int i = 0; i < 6; ++i) v[i] = Scalar(nu[i]);
  auvest::Flow<Scalar> flow;
  flow.set(v, Hull::Vehicle::kNeedsSpeed, auvest::SixDof());
  hull.vehicle().add_loads(tau, flow, none, auvest::SixDof());
  peer::Vec6 result;
  for (int i = 0; i < 6; ++i) result(i) = double(tau[i]);
  return result;
}

TEST_CASE_TEMPLATE("damping takes energy, ahead, astern and sideways", Scalar, float, double) {
  Uniform uniform;
  const Remus<Scalar> remus(auvest::remus100<Scalar>());
  const Rov<Scalar> rov(auvest::bluerov2_heavy<Scalar>());
  for (int k = 0; k < 3000; ++k) {
    double nu[6];
    peer::Vec6 v;
    for (int i = 0; i < 6; ++i) v(i) = nu[i] = double(Scalar(2 * uniform()));
    CHECK(v.dot(loads(remus, nu)) < 0);
    CHECK(v.dot(forces(remus, nu)) < 0);  // with Coriolis, level
    CHECK(v.dot(loads(rov, nu)) < 0);
  }
}

TEST_CASE("drag is the same ahead and astern; the peer's linear lift is not") {
  const Remus<double> hull(auvest::remus100<double>());
  for (const double sign : {1.0, -1.0}) {
    const double straight[6] = {sign, 0, 0, 0, 0, 0};
    const double oblique[6] = {sign, 0.1 * sign, 0.1 * sign, 0, 0, 0};
    CHECK(std::fabs(loads(hull, straight)(0) + sign * 6.308402) < 5e-7);
    CHECK(std::fabs(loads(hull, oblique)(0) + sign * 6.194889) < 5e-7);
  }
  peer::Form form;
  form.linear_lift = form.short_spheroid = true;
  const peer::Torpedo pvs(form);
  peer::Vec6 nu = peer::Vec6::Zero();
  nu(0) = 1;
  const double ahead = pvs.force(peer::Vec6::Zero(), nu, nu, peer::Vec3::Zero())(0);
  const double astern = pvs.force(peer::Vec6::Zero(), -nu, -nu, peer::Vec3::Zero())(0);
  CHECK(std::fabs(-ahead - 6.2) < 0.1);
  CHECK(std::fabs(astern) > 200);  // 210 N against 6.2
}

TEST_CASE_TEMPLATE("a body of revolution: forces turn with it", Scalar, float, double) {
  auto p = auvest::remus100<Scalar>();
  p.linear_damping.pitch_kg_m2_s = p.linear_damping.yaw_kg_m2_s;  // those of the set differ
  const Remus<Scalar> hull(p);
  Uniform uniform;
  for (int k = 0; k < 300; ++k) {
    double nu[6];
    for (double& v : nu) v = double(Scalar(uniform()));
    const double quarter[6] = {nu[0], -nu[2], nu[1], nu[3], -nu[5], nu[4]};
    const peer::Vec6 a = loads(hull, nu);
    const peer::Vec6 b = loads(hull, quarter);
    const peer::Vec6 expected = (peer::Vec6() << a(0), -a(2), a(1), a(3), -a(5), a(4)).finished();
    CHECK((b - expected).cwiseAbs().maxCoeff() <= 64 * epsilon<Scalar>() * (1 + a.norm()));

    // Lift and drag alone turn at any angle.
    auto smooth = p;
    smooth.cross_flow.drag = Scalar(0);
    const Remus<Scalar> without(smooth);
    const double c = std::cos(0.4), s = std::sin(0.4);
    const double any[6] = {nu[0], c * nu[1] - s * nu[2], s * nu[1] + c * nu[2], 0, 0, 0};
    const double from[6] = {nu[0], nu[1], nu[2], 0, 0, 0};
    const peer::Vec6 d = loads(without, from);
    const peer::Vec6 e = loads(without, any);
    CHECK(std::fabs(e(0) - d(0)) <= 64 * epsilon<Scalar>() * (1 + d.norm()));
    CHECK(std::fabs(e(1) - (c * d(1) - s * d(2))) <= 64 * epsilon<Scalar>() * (1 + d.norm()));
    CHECK(std::fabs(e(2) - (s * d(1) + c * d(2))) <= 64 * epsilon<Scalar>() * (1 + d.norm()));
  }
}

TEST_CASE_TEMPLATE("the same acceleration by matrices, angles and quadrature", Scalar, float,
                   double) {
  const Remus<Scalar> hull(auvest::remus100<Scalar>());
  const peer::Torpedo other;
  Uniform uniform;
  for (int k = 0; k < 2000; ++k) {
    typename Remus<Scalar>::State x = Remus<Scalar>::State::Zero();
    peer::Vec6 eta = peer::Vec6::Zero(), nu;
    for (int i = 3; i < 6; ++i) eta(i) = double(x(i) = Scalar(uniform()));
    for (int i = 0; i < 6; ++i) nu(i) = double(x(6 + i) = Scalar(2 * uniform()));
    x(12) = Scalar(0.26 * uniform());
    x(13) = Scalar(0.26 * uniform());
    x(14) = Scalar(25 * uniform());
    const peer::Vec3 actuators = x.template tail<3>().template cast<double>();
    Scalar rate[6];
    hull.acceleration(hull.attitude(x), x.data() + 6, x.data() + 12, rate);
    const peer::Vec6 expected = other.acceleration(eta, nu, actuators, peer::Vec3::Zero());
    for (int i = 0; i < 6; ++i) {
      // Moments of 100 N m over the smallest inertia, 0.15 kg m^2.
      CHECK(std::fabs(double(rate[i]) - expected(i)) <= 3000 * epsilon<Scalar>());
    }
  }
}

// ---- Straight-line stability --------------------------------------------------------------------

/// Eigenvalues of (v, r) at speed u, the smaller first.
template <class Hull>
Eigen::Vector2d yaw_modes(const Hull& hull, double u) {
  const double delta = 1e-6;
  Eigen::Matrix2d A;
  for (int j = 0; j < 2; ++j) {
    double rate[2][3];
    for (int sign = 0; sign < 2; ++sign) {
      typename Hull::State x = Hull::State::Zero();
      x(3) = u;
      x(4 + j) = sign == 0 ? delta : -delta;
      hull.acceleration(hull.attitude(x), x.data() + 3, x.data() + 6, rate[sign]);
    }
    for (int i = 0; i < 2; ++i) A(i, j) = (rate[0][1 + i] - rate[1][1 + i]) / (2 * delta);
  }
  Eigen::Vector2d modes = A.eigenvalues().real();
  if (modes(0) > modes(1)) std::swap(modes(0), modes(1));
  return modes;
}

TEST_CASE("Munk moment: unstable above 0.316 m/s; a keel aft holds the hull") {
  using Planar = auvest::Hull<Yacht<double>, auvest::ThreeDof>;
  auto p = auvest::remus100<double, auvest::Keel<double>>();
  CHECK(yaw_modes(Planar(p), 1.5)(1) < 0);
  p.added_mass.munk = true;
  const Planar bare(p);
  CHECK(yaw_modes(bare, 0.315)(1) < 0);
  CHECK(yaw_modes(bare, 0.317)(1) > 0);
  const auto without = yaw_modes(bare, 1.5);
  CHECK(std::fabs(without(1) - 1.189) <= 0.5e-3);
  CHECK(std::fabs(without(0) + 3.039) <= 0.5e-3);
  p.keel.foil.area_m2 = 0.02;
  p.keel.foil.aspect_ratio = 2;
  p.keel.foil.drag = 0.01;
  p.keel.foil.lift_slope = auvest::low_aspect_lift_slope(2.0);
  p.keel.x_m = -0.5;
  p.keel.z_m = 0.2;
  const auto with = yaw_modes(Planar(p), 1.5);
  CHECK(std::fabs(with(1) + 0.629) <= 0.5e-3);
  CHECK(std::fabs(with(0) + 3.153) <= 0.5e-3);
}

}  // namespace
