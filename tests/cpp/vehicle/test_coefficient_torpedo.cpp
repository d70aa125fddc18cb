// A torpedo by published coefficients.
#include <limits>

#include "auvest/vehicle/remus100_prestero.hpp"
#include "close.hpp"
#include "peer_hull.hpp"
#include "support.hpp"

namespace {

using namespace vehicle;
using auvest::Status;

template <class Scalar, class Freedom = auvest::SixDof>
using Prestero = auvest::Hull<auvest::CoefficientTorpedo<Scalar>, Freedom>;

TEST_CASE("remus100_prestero: what it says about added mass twice agrees") {
  const auto p = auvest::remus100_prestero<double>();
  const Prestero<double> hull(p);
  REQUIRE(hull.check() == Status::kOk);
  // -C_A nu where u = 0, from M_A; the coefficients have the terms of it that do not go with u.
  peer::Mat6 added = hull.mass_matrix();
  peer::Mat6 rigid = peer::Mat6::Zero();
  auvest::Matrix<double, 6, 6> m = auvest::Matrix<double, 6, 6>::Zero();
  auvest::RigidBody<double>(p.body).add_to(m);
  rigid = m;
  added -= rigid;
  auto only = p;  // without damping
  only.y_vv = only.y_rr = only.z_ww = only.z_qq = only.k_pp = 0;
  only.m_ww = only.m_qq = only.n_vv = only.n_rr = 0;
  const auvest::CoefficientTorpedo<double> loads(only);
  Uniform uniform;
  for (int k = 0; k < 200; ++k) {
    peer::Vec6 nu;
    double v[6], tau[6] = {};
    for (int i = 0; i < 6; ++i) nu(i) = v[i] = i == 0 ? 0 : uniform();
    auvest::Flow<double> flow;
    flow.set(v, false, auvest::SixDof());
    const double none[3] = {};
    loads.add_loads(tau, flow, none, auvest::SixDof());
    const peer::Vec6 expected = -peer::coriolis(added, nu) * nu;
    for (int i = 0; i < 6; ++i) {
      CAPTURE(i);
      // M_rp and N_pq are printed for the theoretical K_pdot: 4.86 for 4.81.
      CHECK(std::fabs(tau[i] - expected(i)) < (i < 4 ? 1e-12 : 0.0505));
    }
  }
}

TEST_CASE("remus100_prestero: on its side it is the same body of revolution") {
  auto only = auvest::remus100_prestero<double>();  // what goes with u, and the fins
  only.y_vv = only.y_rr = only.z_ww = only.z_qq = 0;
  only.m_ww = only.m_qq = only.n_vv = only.n_rr = 0;
  const auvest::CoefficientTorpedo<double> loads(only);
  const double u = 1.5, v = 0.3, r = 0.2, fin = 0.1;
  // Rolled by 90 degrees to port: sway is heave, and a yaw rate one in pitch with the other sign.
  const double turning[6] = {u, v, 0, 0, 0, r}, rolled[6] = {u, 0, v, 0, -r, 0};
  double rudder[3] = {}, stern_planes[3] = {};
  rudder[auvest::kRudder] = fin;
  stern_planes[auvest::kSternPlanes] = fin;  // down, as the turned rudder goes to starboard
  double yawed[6] = {}, pitched[6] = {};
  auvest::Flow<double> flow;
  flow.set(turning, false, auvest::SixDof());
  loads.add_loads(yawed, flow, rudder, auvest::SixDof());
  flow.set(rolled, false, auvest::SixDof());
  loads.add_loads(pitched, flow, stern_planes, auvest::SixDof());
  CHECK(yawed[0] == close_to(pitched[0], 1e-12));
  CHECK(yawed[1] == close_to(pitched[2], 1e-12));
  CHECK(yawed[5] == close_to(-pitched[4], 1e-12));
}

TEST_CASE_TEMPLATE("remus100_prestero: steady speed, and the signs of its fins", Scalar, float,
                   double) {
  const double speed = std::sqrt(3.86 / 1.62);
  CHECK(std::fabs(speed - 1.54) < 0.005);
  const auto p = auvest::remus100_prestero<Scalar>();
  using Planar = Prestero<Scalar, auvest::ThreeDof>;
  const Planar planar(p);
  typename Planar::State y = Planar::State::Zero();
  run(planar, y, command<Planar>(0, 0, 1500), current<Planar>(0, 0, 0), 0.05, 4000);
  CHECK(double(y(3)) == close_to(speed, 1e-5));

  using Body = Prestero<Scalar>;
  const Body hull(p);
  typename Body::State x = Body::State::Zero();
  x(6) = Scalar(speed);
  x(12 + auvest::kPropeller) = Scalar(25);
  const auto still = current<Body>(0, 0, 0);
  typename Body::State straight = x, turned = x, dived = x;
  run(hull, straight, command<Body>(0, 0, 1500), still, 0.05, 20);
  run(hull, turned, command<Body>(5, 0, 1500), still, 0.05, 20);
  run(hull, dived, command<Body>(0, 5, 1500), still, 0.05, 20);
  CHECK(turned(11) - straight(11) > Scalar(0.05));
  CHECK(dived(4) - straight(4) < Scalar(-0.01));
  CHECK(dived(10) - straight(10) < Scalar(0));
}

TEST_CASE("remus100_prestero: unstable in its linear terms, held by the quadratic ones") {
  using Body = Prestero<double, auvest::ThreeDof>;
  const auto p = auvest::remus100_prestero<double>();
  // Y_uv N_ur - N_uv (Y_ur - m) = 57 - 606.
  const double stability = p.y_uv * p.n_ur - p.n_uv * (p.y_ur - p.body.mass_kg);
  CHECK(stability == doctest::Approx(57.2 - 606.24));
  const Body hull(p);
  const auto still = current<Body>(0, 0, 0);
  Body::State x = Body::State::Zero();
  x(3) = 1.54;
  x(5) = 1e-4;
  x(6 + auvest::kPropeller) = 25;
  run(hull, x, command<Body>(0, 0, 1500), still, 0.05, 100);
  CHECK(std::fabs(x(5)) > 1e-3);  // ten times as fast after 5 s
  run(hull, x, command<Body>(0, 0, 1500), still, 0.05, 4000);
  CHECK(std::fabs(x(5)) < 0.5);  // and a steady turn in the end
  CHECK(std::fabs(x(5)) > 0.01);
}

TEST_CASE("remus100_prestero: bad parameters are reported") {
  auto p = auvest::remus100_prestero<double>();
  p.n_uv = std::numeric_limits<double>::quiet_NaN();
  CHECK(Prestero<double>(p).check() == Status::kBadParameter);
  p = auvest::remus100_prestero<double>();
  p.shaft.time_constant_s = 0;
  CHECK(Prestero<double>(p).check() == Status::kBadParameter);
  p = auvest::remus100_prestero<double>();
  p.added_mass.sway_yaw_kg_m = -60;
  CHECK(Prestero<double>(p).check() == Status::kNotPositiveDefinite);
}

}  // namespace
