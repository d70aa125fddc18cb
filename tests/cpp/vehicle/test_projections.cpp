// Five, four and three degrees of freedom are rows and columns of the six.
#include <array>
#include <limits>

#include "peer_hull.hpp"
#include "support.hpp"

namespace {

using namespace vehicle;
using auvest::FiveDof;
using auvest::FourDof;
using auvest::Hull;
using auvest::SixDof;
using auvest::ThreeDof;

/// M_s d(nu_s)/dt = E tau(E' nu_s), and the rates of the pose those of the six with the dropped
/// angles and velocities 0, for random states.
template <class Vehicle, class Freedom>
void check_rows(const typename Vehicle::Params& params, double epsilon) {
  using Scalar = typename Vehicle::Scalar;
  using Small = Hull<Vehicle, Freedom>;
  using Full = Hull<Vehicle, SixDof>;
  const Small small(params);
  const Full full(params);
  constexpr int n = Freedom::kSize;
  Uniform uniform;
  for (int trial = 0; trial < 200; ++trial) {
    typename Small::State x;
    typename Full::State X = Full::State::Zero();
    for (int i = 0; i < n; ++i) {
      const int axis = Freedom::axis(i);
      X(axis) = x(i) = Scalar(uniform());
      X(6 + axis) = x(n + i) = Scalar(2 * uniform());
    }
    for (int i = 0; i < Full::kActuators; ++i) {
      X(12 + i) = x(2 * n + i) = Scalar((i == auvest::kPropeller ? 20 : 0.2) * uniform());
    }
    const typename Full::Command demand = Full::Command::Zero();
    const auto stream = current<Full>(0.3, -0.2, 0.1);
    typename Small::State dx;
    typename Full::State dX;
    small.rate(x, demand, stream, dx);
    full.rate(X, demand, stream, dX);

    Scalar tau[6];
    full.forces(full.attitude(X), X.data() + 6, X.data() + 12, tau);
    Eigen::MatrixXd M(n, n);
    Eigen::VectorXd f(n);
    for (int i = 0; i < n; ++i) {
      CAPTURE(i);
      const int axis = Freedom::axis(i);
      CHECK(dx(i) == dX(axis));
      f(i) = double(tau[axis]);
      for (int j = 0; j < n; ++j) M(i, j) = double(full.mass_matrix()(axis, Freedom::axis(j)));
    }
    const Eigen::VectorXd expected = M.ldlt().solve(f);
    for (int i = 0; i < n; ++i) {
      // Moments of 100 N m over the smallest inertia, 0.15 kg m^2.
      CHECK(std::fabs(double(dx(n + i)) - expected(i)) <= 3000 * epsilon);
    }
    for (int i = 0; i < Full::kActuators; ++i) CHECK(dx(2 * n + i) == dX(12 + i));
  }
}

const Remus<double>::Command kNone = Remus<double>::Command::Zero();

template <class Scalar>
typename Yacht<Scalar>::Params yacht() {
  auto p = auvest::remus100<Scalar, auvest::Keel<Scalar>>();
  p.keel.foil.area_m2 = Scalar(0.02);
  p.keel.foil.aspect_ratio = Scalar(2);
  p.keel.foil.drag = Scalar(0.01);
  p.keel.foil.lift_slope = auvest::low_aspect_lift_slope(Scalar(2));
  p.keel.x_m = Scalar(-0.5);
  p.keel.z_m = Scalar(0.2);
  return p;
}

TEST_CASE_TEMPLATE("projections: rows and columns of the six degrees of freedom", Scalar, float,
                   double) {
  const double epsilon = double(std::numeric_limits<Scalar>::epsilon());
  for (const bool munk : {false, true}) {
    auto p = yacht<Scalar>();
    p.added_mass.munk = munk;
    p.body.xg_m = Scalar(0.05);  // no plane of symmetry is left
    p.body.yg_m = Scalar(0.03);
    p.restoring.buoyancy_n = Scalar(300);
    check_rows<Yacht<Scalar>, FiveDof>(p, epsilon);
    check_rows<Yacht<Scalar>, FourDof>(p, epsilon);
    check_rows<Yacht<Scalar>, ThreeDof>(p, epsilon);
    check_rows<Yacht<Scalar>, SixDof>(p, epsilon);
  }
  using Vehicle = auvest::Rov<Scalar, 8>;
  check_rows<Vehicle, FiveDof>(auvest::bluerov2_heavy<Scalar>(), epsilon);
  check_rows<Vehicle, FourDof>(auvest::bluerov2_heavy<Scalar>(), epsilon);
  check_rows<Vehicle, ThreeDof>(auvest::bluerov2_heavy<Scalar>(), epsilon);
}

TEST_CASE(
    "kinematics: position and angles follow rotation and Euler rates, each projection its own") {
  const Remus<double> six(auvest::remus100<double>());
  Uniform uniform;
  for (int k = 0; k < 200; ++k) {
    peer::Vec6 eta, nu;
    Remus<double>::State x = Remus<double>::State::Zero(), dx;
    for (int i = 0; i < 6; ++i) {
      eta(i) = x(i) = uniform();
      nu(i) = x(6 + i) = uniform();
    }
    six.rate(x, kNone, current<Remus<double>>(0.1, 0.2, 0.3), dx);
    const peer::Vec3 velocity = peer::rotation(eta(3), eta(4), eta(5)) * nu.head<3>();
    const peer::Vec3 turning = peer::euler_rates(eta(3), eta(4)) * nu.tail<3>();
    for (int i = 0; i < 3; ++i) {
      CHECK(std::fabs(dx(i) - velocity(i) - 0.1 * (i + 1)) < 1e-14);
      CHECK(std::fabs(dx(3 + i) - turning(i)) < 1e-13);
    }
  }
  const double u = 1.2, v = -0.3, w = 0.2, p = 0.1, q = 0.15, r = -0.2;
  const double phi = 0.2, theta = -0.3, psi = 0.5;
  {
    using Five = Remus<double, FiveDof>;
    const Five five(auvest::remus100<double>());
    Five::State x, dx;
    x << 0, 0, 0, theta, psi, u, v, w, q, r, 0, 0, 0;
    five.rate(x, kNone, current<Five>(0, 0, 0), dx);
    const peer::Vec3 velocity = peer::rotation(0, theta, psi) * peer::Vec3(u, v, w);
    for (int i = 0; i < 3; ++i) CHECK(std::fabs(dx(i) - velocity(i)) < 1e-15);
    CHECK(dx(3) == q);
    CHECK(dx(4) == r / std::cos(theta));
  }
  {
    using Four = Remus<double, FourDof>;
    const Four four(auvest::remus100<double>());
    Four::State x, dx;
    x << 0, 0, phi, psi, u, v, p, r, 0, 0, 0;
    four.rate(x, kNone, current<Four>(0, 0, 0), dx);
    CHECK(std::fabs(dx(0) - (u * std::cos(psi) - v * std::cos(phi) * std::sin(psi))) < 1e-15);
    CHECK(std::fabs(dx(1) - (u * std::sin(psi) + v * std::cos(phi) * std::cos(psi))) < 1e-15);
    CHECK(dx(2) == p);
    CHECK(dx(3) == r * std::cos(phi));
  }
}

/// x, y, psi, u, v, r of a run from rest with the rudder over.
template <class Freedom, class Scalar>
std::array<Scalar, 6> turn(const typename Remus<Scalar>::Params& params,
                           typename Remus<Scalar, Freedom>::State* end = nullptr) {
  using Body = Remus<Scalar, Freedom>;
  const Body hull(params);
  typename Body::State x = Body::State::Zero();
  run(hull, x, command<Body>(10, 0, 1200), current<Body>(0, 0, 0), 0.02, 2500);
  if (end) *end = x;
  std::array<Scalar, 6> result;
  std::size_t next = 0;
  for (int half = 0; half < 2; ++half) {
    for (int i = 0; i < Freedom::kSize; ++i) {
      const int axis = Freedom::axis(i);
      const bool planar = axis == auvest::kSurge || axis == auvest::kSway || axis == auvest::kYaw;
      if (planar) result[next++] = x(half * Freedom::kSize + i);
    }
  }
  return result;
}

TEST_CASE_TEMPLATE("without a righting arm and torque six degrees of freedom stay in the plane",
                   Scalar, float, double) {
  auto p = auvest::remus100<Scalar>();
  p.body.zg_m = Scalar(0);
  p.propeller.roll_torque = Scalar(0);
  typename Remus<Scalar>::State x;
  const auto six = turn<SixDof, Scalar>(p, &x);
  for (int i : {2, 3, 4, 8, 9, 10}) CHECK(x(i) == Scalar(0));  // z phi theta w p q
  CHECK(six == (turn<ThreeDof, Scalar>(p)));                   // to the bit
  CHECK(six == (turn<FourDof, Scalar>(p)));
  CHECK(six == (turn<FiveDof, Scalar>(p)));
}

TEST_CASE("with a righting arm roll makes the hull lighter in sway") {
  const auto p = auvest::remus100<double>();
  const auto planar = turn<ThreeDof, double>(p);
  const auto six = turn<SixDof, double>(p);
  const double printed[2][3] = {{-9.7192, 4.9670, 5.55368}, {-9.6810, 4.9012, 5.558145}};
  for (std::size_t i = 0; i < 3; ++i) {
    const double unit[2] = {i < 2 ? 1e-4 : 1e-5, i < 2 ? 1e-4 : 1e-6};
    CHECK(std::fabs(planar[i] - printed[0][i]) <= 0.5001 * unit[0]);
    CHECK(std::fabs(six[i] - printed[1][i]) <= 0.5001 * unit[1]);
  }
  const peer::Mat6 inverse = Remus<double>(p).mass_matrix().inverse();
  CHECK(std::fabs(1 / inverse(1, 1) - 59.761) <= 0.5e-3);
}

TEST_CASE_TEMPLATE("a current carries each projection, and nothing else", Freedom, FiveDof, FourDof,
                   ThreeDof) {
  using Body = Remus<double, Freedom>;
  constexpr int n = Freedom::kSize;
  const Body hull(auvest::remus100<double>());
  const auto stream = current<Body>(0.3, -0.4, 0);
  typename Body::State a = Body::State::Zero(), b = Body::State::Zero();
  run(hull, a, command<Body>(5, 0, 1200), current<Body>(0, 0, 0), 0.02, 1000);
  run(hull, b, command<Body>(5, 0, 1200), stream, 0.02, 1000);
  CHECK(std::fabs(b(0) - a(0) - 6) < 1e-11);
  CHECK(std::fabs(b(1) - a(1) + 8) < 1e-11);
  for (int i = 2; i < Body::kStates; ++i) {
    if (i != 2 || n != 5) CHECK(a(i) == b(i));
  }
  typename Body::Velocity still = Body::Velocity::Zero();
  hull.set_ground_velocity(b, still, stream);
  CHECK(hull.ground_velocity(b, stream).norm() == 0);
  CHECK(b.template segment<2>(n).norm() == doctest::Approx(0.5).epsilon(n == 3 ? 1e-14 : 2e-3));
}

}  // namespace
