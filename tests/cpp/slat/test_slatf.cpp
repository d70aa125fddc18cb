// SLATF against what it must equal: the EKF of the master to the bit, a posterior by brute force on
// a grid, the integral of Eq. (63); and Eq. (34), to the bit.
#include <doctest/doctest.h>

#include "brute_force.hpp"
#include "close.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "auvest/filters/ekf.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/slat/slatf.hpp"

namespace {

using namespace slat_test;

// ---- One particle, no noise of the slave
// ---------------------------------------------------------

template <class Filter>
void check_equals_ekf() {
  using Scalar = typename Filter::Scalar;
  using Process = typename Filter::Master;
  typename Filter::Motion::Params still;
  still.sigma_speed_m_s = still.sigma_heading_rad = Scalar(0);
  Owner<Filter> owner((typename Filter::Motion(still)), Process(), 1);
  Filter& slatf = owner.filter;
  Random random(51);
  typename Filter::SlaveBelief start;
  start.x << Scalar(10), Scalar(-5);
  start.P.setZero();
  const auto prior = master_belief<Scalar>(20, 280, 5, 1, 1);
  REQUIRE(slatf.reset(start, 1, random) == Status::kOk);
  REQUIRE(slatf.add_master(prior) == Status::kOk);
  auvest::Ekf<Process> ekf{Process()};
  REQUIRE(ekf.reset(prior.x, prior.P) == Status::kOk);

  typename auvest::Sonar<Scalar>::Params sonar;
  sonar.bearing = auvest::Bearing::kSlaveToMaster;
  sonar.sigma_range_m = Scalar(1);
  sonar.sigma_bearing_rad = Scalar(0.06);
  typename auvest::RangeBearing<Scalar, 6>::Params station;
  station.sigma_range_m = sonar.sigma_range_m;
  station.sigma_bearing_rad = sonar.sigma_bearing_rad;
  station.near_field = Scalar(0);
  for (int k = 0; k < 200; ++k) {
    const Vector<Scalar, 2> u(Scalar(5), Scalar(0.5 + 0.002 * k));
    REQUIRE(slatf.predict(Scalar(1), u, random) == Status::kOk);
    REQUIRE(ekf.predict(Scalar(1)) == Status::kOk);
    if (k % 2 == 0) continue;
    const auto slave = slatf.slave().x;
    Echo<Scalar> seen;
    seen.master = 0;
    seen.z(0) = Scalar(300 - 0.5 * k + random.normal<double>());
    seen.z(1) = Scalar(1.5 - 0.004 * k + 0.06 * random.normal<double>());
    station.station_x_m = slave(0);
    station.station_y_m = slave(1);
    const auto correction = ekf.update(seen.z, auvest::RangeBearing<Scalar, 6>(station));
    REQUIRE(correction.status == Status::kOk);
    REQUIRE(slatf.update(&seen, 1, auvest::Sonar<Scalar>(sonar), random) == Status::kOk);
    CHECK(slatf.slave().x == slave);
    const auto master = slatf.master(0);
    bool same = master.x == ekf.x();
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) same = same && master.P(i, j) == ekf.belief().P(i, j);
    }
    REQUIRE(same);
  }
}

TEST_CASE("SLATF: one particle and a slave without noise is the EKF of the master, bit for bit") {
  check_equals_ekf<auvest::Slatf1<Compass<float>, Master<float>, 1>>();
  check_equals_ekf<auvest::Slatf1<Compass<double>, Master<double>, 1>>();
  check_equals_ekf<auvest::Slatf2<Compass<float>, Master<float>, 1>>();
  check_equals_ekf<auvest::Slatf2<Compass<double>, Master<double>, 1>>();
}

// ---- One update by brute force
// -------------------------------------------------------------------

TEST_CASE_TEMPLATE(
    "SLATF: 1e5 particles are the posterior of a grid, after one echo and after two" *
        doctest::test_suite("statistics"),
    Filter, auvest::Slatf1<Compass<double>, Master<double>, 1>,
    auvest::Slatf2<Compass<double>, Master<double>, 1>) {
  FarApart problem;
  check_against_grid<Filter>(problem, typename Filter::Params());
  problem.hear(1, -0.001);  // its weight multiplies the one before
  check_against_grid<Filter>(problem, typename Filter::Params());
}

TEST_CASE("SLATF 2.0: the weight is the integral of Eq. (63), for measurements near and far off" *
          doctest::test_suite("statistics")) {
  for (const double offset : {-6.0, -2.0, 0.0, 2.0}) {
    FarApart problem;
    problem.start.P.setZero();  // one particle: its pose before the step is known
    problem.echoes[0].z(0) += offset;
    const Grid grid(problem);
    Owner<auvest::Slatf2<Compass<double>, Master<double>, 1>> owner(problem.motion,
                                                                    Master<double>(), 1);
    problem.run(owner.filter, 1, 62);
    CHECK(std::fabs(owner.filter.log_likelihood() - grid.log_evidence) < 0.01);
  }
}

TEST_CASE("SLATF 2.0: the drawn pose has the mean and the covariance of the conditional posterior" *
          doctest::test_suite("statistics")) {
  // With the pose before the step known, p(X | z) of Eqs. (57) and (58) is the grid's marginal.
  FarApart problem;
  problem.start.P.setZero();
  const Grid grid(problem);
  const int particles = 100000;
  auto params = paper<auvest::SlatfParams<double>>();
  params.resample_below = 0;
  Owner<auvest::Slatf2<Compass<double>, Master<double>, 1>> owner(problem.motion, Master<double>(),
                                                                  particles, params);
  problem.run(owner.filter, particles, 63);
  CHECK(owner.filter.effective_size() == close_to(particles, 1e-9));  // equal weights
  const auto slave = owner.filter.slave();
  for (int i = 0; i < 2; ++i) {
    CHECK(std::fabs(slave.x(i) - grid.mean(i)) <
          4.5 * std::sqrt(grid.covariance(i, i) / particles) + 2e-3);
    CHECK(slave.P(i, i) == close_to(grid.covariance(i, i), 0.03));
  }
}

// ---- Several masters
// -----------------------------------------------------------------------------

template <class Filter>
void check_independence() {
  using Scalar = typename Filter::Scalar;
  constexpr int masters = Filter::kMasters;
  const int particles = 40;
  auto params = paper<typename Filter::Params>();
  params.resample_below = Scalar(0);
  Owner<Filter> owner((typename Filter::Motion()), Master<Scalar>(), particles, params);
  Filter& filter = owner.filter;
  Random random(71);
  typename Filter::SlaveBelief start;
  start.x.setZero();
  start.P = Matrix<Scalar, Filter::kPose, Filter::kPose>::Identity();
  REQUIRE(filter.reset(start, particles, random) == Status::kOk);
  for (int n = 0; n < masters; ++n) {
    REQUIRE(filter.add_master(master_belief<Scalar>(100 + 50 * n, 200 - 80 * n, 1, 2, 3)) ==
            Status::kOk);
  }
  for (int trial = 0; trial < 30; ++trial) {
    REQUIRE(filter.predict(Scalar(1), Vector<Scalar, 2>(Scalar(5), Scalar(0.1)), random) ==
            Status::kOk);
    const std::vector<Scalar> before = owner.storage;
    Echo<Scalar> seen;
    seen.master = trial % masters;
    seen.z << Scalar(200 + random.normal<double>()), Scalar(-2 + 0.1 * random.normal<double>());
    REQUIRE(filter.update(&seen, 1, auvest::Sonar<Scalar>(), random) == Status::kOk);
    for (int i = 0; i < particles; ++i) {
      for (int n = 0; n < masters; ++n) {
        int changed = 0;
        for (int f = 0; f < Filter::kMasterNumbers; ++f) {
          const Scalar* now =
              filter.set().at(i, Filter::kMasterField + n * Filter::kMasterNumbers + f);
          changed += *now != before[static_cast<std::size_t>(now - owner.storage.data())] ? 1 : 0;
        }
        if (n == seen.master) {
          CHECK(changed > 10);
        } else {
          CHECK(changed == 0);
        }
      }
    }
  }
}

TEST_CASE("Eq. (34): a measurement of one master leaves all bits of the others") {
  check_independence<auvest::Slatf1<Compass<float>, Master<float>, 3>>();
  check_independence<auvest::Slatf2<Compass<float>, Master<float>, 3>>();
  check_independence<auvest::Slatf2<auvest::UnicycleMotion<double>, Master<double>, 2>>();
}

TEST_CASE("SLATF 2.0: two masters at once weigh what the joint Gaussian gives, in any order") {
  // One particle with a Gaussian pose: p(z1, z2) = N(.; G P_S G' + blockdiag(G_M P_M G_M' + R)).
  FarApart problem;
  problem.start.P.setZero();
  const auto first = master_belief<double>(1300, 900, 0, 0, 1);
  const auto second = master_belief<double>(-800, 1400, 0, 0, 2);
  auto slave = problem.moved();
  auvest::math::mirror_lower(slave.P);
  Eigen::Matrix<double, 4, 1> innovation;
  Eigen::Matrix<double, 4, 4> s = Eigen::Matrix<double, 4, 4>::Zero();
  Eigen::Matrix<double, 4, 2> by_slave;
  Echo<double> seen[2];
  const Belief<double, 6>* masters[2] = {&first, &second};
  for (int n = 0; n < 2; ++n) {
    Belief<double, 6> ahead = *masters[n];
    Master<double>().propagate(ahead, problem.dt);
    const double dx = slave.x(0) - ahead.x(0);
    const double dy = slave.x(1) - ahead.x(1);
    seen[n].master = n;
    seen[n].z << std::hypot(dx, dy) + 2.5 - 4 * n, std::atan2(dy, dx) - 0.002 + 0.003 * n;
    auvest::Sonar<double>::View<double, 2> view;
    problem.sonar.look(slave.x, ahead.x(0), ahead.x(1), seen[n].z, view);
    innovation.segment<2>(2 * n) = view.innovation;
    by_slave.block<2, 2>(2 * n, 0) = view.by_slave;
    s.block<2, 2>(2 * n, 2 * n) =
        view.by_master * position(ahead).P * view.by_master.transpose() + problem.sonar.R<double>();
  }
  s += by_slave * slave.P * by_slave.transpose();
  const double expected =
      -0.5 * (innovation.dot(s.inverse() * innovation) + std::log(s.determinant())) -
      2 * std::log(auvest::math::two_pi<double>());
  for (const bool swapped : {false, true}) {
    Owner<auvest::Slatf2<Compass<double>, Master<double>, 2>> owner(problem.motion,
                                                                    Master<double>(), 1);
    Random random(72);
    REQUIRE(owner.filter.reset(problem.start, 1, random) == Status::kOk);
    REQUIRE(owner.filter.add_master(first) == Status::kOk);
    REQUIRE(owner.filter.add_master(second) == Status::kOk);
    REQUIRE(owner.filter.predict(problem.dt, problem.reading, random) == Status::kOk);
    Echo<double> order[2] = {seen[swapped ? 1 : 0], seen[swapped ? 0 : 1]};
    REQUIRE(owner.filter.update(order, 2, problem.sonar, random) == Status::kOk);
    CHECK(std::fabs(owner.filter.log_likelihood() - expected) < 0.005);
  }
}

// ---- Bookkeeping
// ---------------------------------------------------------------------------------

TEST_CASE_TEMPLATE("SLATF: refused calls leave all bits", Filter,
                   auvest::Slatf1<Compass<float>, Master<float>, 2>,
                   auvest::Slatf2<Compass<float>, Master<float>, 2>) {
  const float nan = std::nanf("");
  const int particles = 20;
  Owner<Filter> owner((Compass<float>()), Master<float>(), particles);
  Filter& filter = owner.filter;
  Random random(81);
  const auvest::Sonar<float> sonar;
  Echo<float> seen[2];
  seen[0].master = 0;
  seen[1].master = 1;
  seen[0].z << 200, -2;
  seen[1].z << 210, -2;
  const Vector<float, 2> u(5, 0.1f);
  CHECK(filter.predict(1, u, random) == Status::kNotInitialised);
  CHECK(filter.update(seen, 1, sonar, random) == Status::kNotInitialised);
  CHECK(filter.add_master(master_belief<float>(100, 200, 0, 0, 1)) == Status::kNotInitialised);
  Belief<float, 2> start;
  start.x << 1, 2;
  start.P << 1, 0.5f, 0.5f, 1;
  CHECK(filter.reset(start, 0, random) == Status::kBadParameter);
  CHECK(filter.reset(start, particles + 13, random) == Status::kBadParameter);
  start.x(0) = nan;
  CHECK(filter.reset(start, particles, random) == Status::kNotFinite);
  start.x(0) = 1;
  start.P(1, 1) = -1;
  CHECK(filter.reset(start, particles, random) == Status::kNotPositiveDefinite);
  start.P(1, 1) = 1;
  REQUIRE(filter.reset(start, particles, random) == Status::kOk);
  CHECK(filter.update(seen, 1, sonar, random) == Status::kBadParameter);  // no master yet
  REQUIRE(filter.add_master(master_belief<float>(100, 200, 0, 0, 1)) == Status::kOk);
  REQUIRE(filter.add_master(master_belief<float>(110, 200, 0, 0, 1)) == Status::kOk);
  CHECK(filter.add_master(master_belief<float>(110, 200, 0, 0, 1)) == Status::kBadParameter);
  REQUIRE(filter.predict(1, u, random) == Status::kOk);
  REQUIRE(filter.update(seen, 2, sonar, random) == Status::kOk);

  const std::vector<float> before = owner.storage;
  const Vector<float, 2> changes[2] = {Vector<float, 2>(0, 0), Vector<float, 2>(0, nan)};
  CHECK(filter.predict(nan, u, random) == Status::kNotFinite);
  CHECK(filter.predict(-1, u, random) == Status::kTimeBackwards);
  CHECK(filter.predict(1, Vector<float, 2>(5, nan), random) == Status::kNotFinite);
  CHECK(filter.predict(1, u, random, changes) == Status::kNotFinite);
  CHECK(filter.update(seen, -1, sonar, random) == Status::kBadParameter);
  CHECK(filter.update(seen, 0, sonar, random) == Status::kOk);  // nothing seen: nothing changes
  auto bad_sonar = sonar.params;
  bad_sonar.sigma_range_m = 0;
  CHECK(filter.update(seen, 1, auvest::Sonar<float>(bad_sonar), random) == Status::kBadParameter);
  for (float auvest::Sonar<float>::Params::*sigma :
       {&auvest::Sonar<float>::Params::sigma_range_m,
        &auvest::Sonar<float>::Params::sigma_bearing_rad}) {
    auto blunt = sonar.params;  // one of them alone is too large
    blunt.*sigma = 1.1e15f;
    CHECK(filter.update(seen, 1, auvest::Sonar<float>(blunt), random) == Status::kOverflow);
  }
  auto wrong = seen[0];
  wrong.z(1) = nan;
  CHECK(filter.update(&wrong, 1, sonar, random) == Status::kNotFinite);
  wrong.z << INFINITY, 0;
  CHECK(filter.update(&wrong, 1, sonar, random) == Status::kNotFinite);
  wrong.z << 1e10f, 0;
  CHECK(filter.update(&wrong, 1, sonar, random) == Status::kOverflow);
  wrong = seen[0];
  wrong.master = 2;
  CHECK(filter.update(&wrong, 1, sonar, random) == Status::kBadParameter);
  const Echo<float> twice[2] = {seen[0], seen[0]};
  CHECK(filter.update(twice, 2, sonar, random) == Status::kBadParameter);
  CHECK(owner.storage == before);
}

TEST_CASE("SLATF: parameters out of their range are refused, those at its ends are not") {
  using Params = auvest::SlatfParams<float>;
  const auto status = [](float Params::*member, float value) {
    Params params;
    params.gate = 16;
    params.*member = value;
    Owner<auvest::Slatf1<Compass<float>, Master<float>, 1>> owner((Compass<float>()),
                                                                  Master<float>(), 5, params);
    Random random(1);
    Belief<float, 2> start;
    start.x.setZero();
    start.P.setZero();
    return owner.filter.reset(start, random);
  };
  for (const float bad : {-0.1f, std::nanf(""), INFINITY}) {
    CHECK(status(&Params::resample_below, bad) == Status::kBadParameter);
    CHECK(status(&Params::gate, bad) == Status::kBadParameter);
    CHECK(status(&Params::birth_velocity_m_s, bad) == Status::kBadParameter);
    CHECK(status(&Params::birth_acceleration_m_s2, bad) == Status::kBadParameter);
  }
  for (const float end : {0.0f, 1.0f}) CHECK(status(&Params::resample_below, end) == Status::kOk);
  CHECK(status(&Params::resample_below, 1.001f) == Status::kBadParameter);
  CHECK(status(&Params::gate, 0) == Status::kOk);
  CHECK(status(&Params::birth_velocity_m_s, 0) == Status::kOk);
  CHECK(status(&Params::birth_acceleration_m_s2, 0) == Status::kBadParameter);
}

TEST_CASE("SLATF: planned velocity changes move the master as Eq. (4) says") {
  using Filter = auvest::Slatf1<Compass<double>, Master<double>, 2>;
  Owner<Filter> owner((Compass<double>()), Master<double>(), 5);
  Random random(82);
  Belief<double, 2> start;
  start.x.setZero();
  start.P.setZero();
  REQUIRE(owner.filter.reset(start, 5, random) == Status::kOk);
  for (int n = 0; n < 2; ++n) {
    REQUIRE(owner.filter.add_master(master_belief<double>(10 * n, 0, 1, 2, 1)) == Status::kOk);
  }
  const Vector<double, 2> changes[2] = {Vector<double, 2>(0.4, 0), Vector<double, 2>(0, -0.6)};
  REQUIRE(owner.filter.predict(2, Vector<double, 2>(0, 0), random, changes) == Status::kOk);
  const auto first = owner.filter.master(0).x;
  const auto second = owner.filter.master(1).x;
  CHECK(first(0) == close_to(2 + 0.4, 1e-14));
  CHECK(first(1) == close_to(4, 1e-14));
  CHECK(first(2) == close_to(1.4, 1e-14));
  CHECK(second(0) == close_to(12, 1e-14));
  CHECK(second(1) == close_to(4 - 0.6, 1e-14));
  CHECK(second(3) == close_to(1.4, 1e-14));
}

TEST_CASE("SLATF 2.0: Eq. (50) to the letter keeps Sigma after the draw, the default does not") {
  for (const bool carry : {false, true}) {
    FarApart problem;
    problem.start.P.setZero();
    auto params = paper<auvest::SlatfParams<double>>();
    params.carry_covariance = carry;
    params.resample_below = 0;
    using Filter = auvest::Slatf2<Compass<double>, Master<double>, 1>;
    Owner<Filter> owner(problem.motion, Master<double>(), 1, params);
    problem.run(owner.filter, 1, 83);
    const auto P = owner.filter.slave().P;  // of one particle: what it carries
    if (carry) {
      CHECK(P(0, 0) > 0);
      CHECK(P(0, 0) < problem.moved().P(0, 0));
    } else {
      CHECK(P.norm() == 0);
    }
  }
}

TEST_CASE("SLATF: the same seed gives the same bits, the mean of the heading crosses the cut") {
  using Filter = auvest::Slatf2<auvest::UnicycleMotion<float>, Master<float>, 1>;
  Owner<Filter> a((auvest::UnicycleMotion<float>()), Master<float>(), 100);
  Owner<Filter> b((auvest::UnicycleMotion<float>()), Master<float>(), 100);
  Owner<Filter>* owners[2] = {&a, &b};
  for (Owner<Filter>* owner : owners) {
    Random random(84);
    Belief<float, 3> start;
    start.x << 0, 0, 3.1f;
    start.P.setZero();
    start.P(2, 2) = 0.04f;
    REQUIRE(owner->filter.reset(start, 100, random) == Status::kOk);
    REQUIRE(owner->filter.add_master(master_belief<float>(100, 200, 0, 0, 1)) == Status::kOk);
    REQUIRE(owner->filter.predict(1, Vector<float, 2>(1, 0.1f), random) == Status::kOk);
    Echo<float> seen;
    seen.master = 0;
    seen.z << 224, 1.1f - 3.2f;
    auvest::Sonar<float>::Params sonar;
    sonar.bearing = auvest::Bearing::kFromHeading;
    REQUIRE(owner->filter.update(&seen, 1, auvest::Sonar<float>(sonar), random) == Status::kOk);
    const auto slave = owner->filter.slave();
    CHECK(std::fabs(auvest::math::wrap(slave.x(2) - 3.2f)) < 0.2f);
    CHECK(slave.P(2, 2) < 0.04f);  // the bearing tells of the heading
  }
  CHECK(a.storage == b.storage);
}

// ---- One pass, unknown association, births
// -------------------------------------------------------

/// Echoes of the masters as the filter believes them, with noise; in any order, known or not.
template <class Filter>
void hear(const Filter& filter, const auvest::Sonar<float>& sonar, bool known, Random& noise,
          Echo<float>* seen) {
  for (int n = 0; n < filter.masters(); ++n) {
    const auto slave = filter.slave().x;
    const auto master = filter.master(n).x;
    const float dx = slave(0) - master(0);
    const float dy = slave(1) - master(1);
    float a, b;
    noise.normal_pair(a, b);
    Echo<float>& echo = seen[filter.masters() - 1 - n];
    echo.master = known ? n : auvest::kUnknownMaster;
    echo.z(0) = std::sqrt(dx * dx + dy * dy) + sonar.params.sigma_range_m * a;
    echo.z(1) = auvest::math::atan2(dy, dx) + sonar.params.sigma_bearing_rad * b;
  }
}

/// Runs two filters side by side: `stepwise` uses step(), `known` tells whose echo it is.
template <class Filter>
void run_pair(bool stepwise, bool known, Owner<Filter>& a, Owner<Filter>& b) {
  const auvest::Sonar<float> sonar;
  Random random_a(85);
  Random random_b(85);
  Random noise(86);
  Belief<float, 2> start;
  start.x << 0, 0;
  start.P << 1, 0, 0, 1;
  for (Owner<Filter>* owner : {&a, &b}) {
    Random& random = owner == &a ? random_a : random_b;
    REQUIRE(owner->filter.reset(start, random) == Status::kOk);
    for (int n = 0; n < 3; ++n) {
      REQUIRE(owner->filter.add_master(master_belief<float>(100 - 60 * n, 150, 2, 1, 1)) ==
              Status::kOk);
    }
  }
  for (int k = 0; k < 30; ++k) {
    const Vector<float, 2> u(2, 0.1f * static_cast<float>(k));
    Echo<float> seen[3];
    REQUIRE(a.filter.predict(1, u, random_a) == Status::kOk);
    hear(a.filter, sonar, true, noise, seen);
    const int count = k % 4;
    REQUIRE(a.filter.update(seen, count, sonar, random_a) == Status::kOk);
    for (Echo<float>& echo : seen) {
      if (!known) echo.master = auvest::kUnknownMaster;
    }
    if (stepwise) {
      REQUIRE(b.filter.step(1, u, nullptr, seen, count, sonar, random_b) == Status::kOk);
      const auto positions = b.filter.positions();
      const auto slave = b.filter.slave();
      for (int d = 0; d < 2; ++d) CHECK(positions.slave(d) == slave.x(d));
      for (int n = 0; n < b.filter.masters(); ++n) {
        const auto master = b.filter.master(n);
        for (int d = 0; d < 2; ++d) CHECK(positions.masters[n](d) == master.x(d));
      }
    } else {
      REQUIRE(b.filter.predict(1, u, random_b) == Status::kOk);
      REQUIRE(b.filter.update(seen, count, sonar, random_b) == Status::kOk);
    }
  }
  CHECK(a.filter.resamplings() > 0);
}

TEST_CASE_TEMPLATE("SLATF: step() has the bits of predict() and update()", Filter,
                   auvest::Slatf1<Compass<float>, Master<float>, 3>,
                   auvest::Slatf2<Compass<float>, Master<float>, 3>) {
  Owner<Filter> a((Compass<float>()), Master<float>(), 50);
  Owner<Filter> b((Compass<float>()), Master<float>(), 50);
  run_pair(true, true, a, b);
  CHECK(a.storage == b.storage);
  CHECK(a.filter.log_likelihood() == b.filter.log_likelihood());
  Random random(1);
  Echo<float> seen[1];
  seen[0].master = 0;
  seen[0].z << std::nanf(""), 0;
  const Vector<float, 2> u(2, 0);
  CHECK(b.filter.step(1, u, nullptr, seen, 1, auvest::Sonar<float>(), random) ==
        Status::kNotFinite);
  CHECK(b.filter.step(-1, u, nullptr, seen, 0, auvest::Sonar<float>(), random) ==
        Status::kTimeBackwards);
  CHECK(a.storage == b.storage);
}

TEST_CASE_TEMPLATE("SLATF: unknown echoes of masters far apart do what known ones do, to the bit",
                   Filter, auvest::Slatf1<Compass<float>, Master<float>, 3>,
                   auvest::Slatf2<Compass<float>, Master<float>, 3>) {
  Owner<Filter> a((Compass<float>()), Master<float>(), 50);
  Owner<Filter> b((Compass<float>()), Master<float>(), 50);
  run_pair(false, false, a, b);
  CHECK(a.storage == b.storage);
}

/// The particles of a filter, to be put where a test wants them.
template <class Filter>
typename Filter::Set& particles_of(Filter& filter) {
  return const_cast<typename Filter::Set&>(filter.set());
}

TEST_CASE("SLATF 1.0: a particle whose correction overflows weighs nothing, the others as before") {
  using Filter = auvest::Slatf1<Compass<float>, Master<float>, 1>;
  auto params = paper<Filter::Params>();
  params.resample_below = 0;
  const int particles = 5;
  const auvest::Sonar<float> sonar;
  std::vector<float> weights[2];
  int lost = 0;  // the heaviest
  for (int overflows = 0; overflows < 2; ++overflows) {
    Owner<Filter> owner((Compass<float>()), Master<float>(), particles, params);
    Filter& filter = owner.filter;
    Random random(91);
    Belief<float, 2> start;
    start.x.setZero();
    start.P << 4, 0, 0, 4;
    REQUIRE(filter.reset(start, random) == Status::kOk);
    REQUIRE(filter.add_master(master_belief<float>(100, 150, 2, 1, 1)) == Status::kOk);
    if (overflows == 1) {
      // Its velocity is at the ends of the format, and the echo that moves x moves one part beyond.
      lost = static_cast<int>(std::max_element(weights[0].begin(), weights[0].end()) -
                              weights[0].begin());
      *particles_of(filter).at(lost, Filter::kMasterField + 2) = std::numeric_limits<float>::max();
      *particles_of(filter).at(lost, Filter::kMasterField + 3) =
          std::numeric_limits<float>::lowest();
      *particles_of(filter).at(lost, Filter::kMasterField + 6 + 3) = 1e36f;  // P(2, 0)
      *particles_of(filter).at(lost, Filter::kMasterField + 6 + 6) = 1e36f;  // P(3, 0)
    }
    Echo<float> seen;
    seen.master = 0;
    seen.z << 181, -2.16f;
    REQUIRE(filter.update(&seen, 1, sonar, random) == Status::kOk);
    for (int i = 0; i < particles; ++i) {
      weights[overflows].push_back(auvest::weight_of(filter.set().log_weights()[i]));
    }
    CHECK(std::isfinite(filter.log_likelihood()));
    if (overflows == 1) {  // and keeps what it believed
      CHECK(*filter.set().at(lost, Filter::kMasterField) == 100);
    }
  }
  const double share = double(weights[0][std::size_t(lost)]);
  CHECK(share < 0.9);
  for (int i = 0; i < particles; ++i) {
    const double before = double(weights[0][std::size_t(i)]);
    const double after = double(weights[1][std::size_t(i)]);
    CHECK(std::fabs(after - (i == lost ? 0 : before / (1 - share))) < 1e-5);
  }
}

TEST_CASE("SLATF: a master is born where the echo comes from, as far as the slave has turned") {
  // Heard at 100 m and 0.5 rad off the bow of a slave that stands at (3, 4) and has turned by 1
  // rad.
  using First = auvest::Slatf1<auvest::UnicycleMotion<double>, Master<double>, 1>;
  using Second = auvest::Slatf2<auvest::UnicycleMotion<double>, Master<double>, 1>;
  auto params = paper<auvest::SlatfParams<double>>();
  params.gate = 16;
  params.birth_velocity_m_s = 2;
  auvest::Sonar<double>::Params device;
  device.bearing = auvest::Bearing::kFromHeading;
  device.sigma_range_m = 0.5;
  device.sigma_bearing_rad = 0.02;
  Echo<double> seen;
  seen.master = auvest::kUnknownMaster;
  seen.z << 100, 0.5;
  Belief<double, 3> start;
  start.x << 3, 4, 1;
  start.P.setZero();
  Random random(92);
  Owner<First> first(auvest::UnicycleMotion<double>(), Master<double>(), 1, params);
  Owner<Second> second(auvest::UnicycleMotion<double>(), Master<double>(), 1, params);
  REQUIRE(first.filter.reset(start, random) == Status::kOk);
  REQUIRE(second.filter.reset(start, random) == Status::kOk);
  REQUIRE(first.filter.update(&seen, 1, auvest::Sonar<double>(device), random) == Status::kOk);
  REQUIRE(second.filter.update(&seen, 1, auvest::Sonar<double>(device), random) == Status::kOk);
  const double c = std::cos(1.5), s = std::sin(1.5);
  const double along = 0.5 * 0.5, across = 100 * 0.02 * (100 * 0.02);
  for (const Belief<double, 6>& master : {first.filter.master(0), second.filter.master(0)}) {
    CHECK(master.x(0) == close_to(3 + 100 * c, 1e-13));
    CHECK(master.x(1) == close_to(4 + 100 * s, 1e-13));
    CHECK(master.x.tail<4>().norm() == 0);
    CHECK(master.P(0, 0) == close_to(along * c * c + across * s * s, 1e-12));
    CHECK(master.P(1, 0) == close_to((along - across) * c * s, 1e-12));
    CHECK(master.P(1, 1) == close_to(along * s * s + across * c * c, 1e-12));
    for (int k = 2; k < 6; ++k) CHECK(master.P(k, k) == close_to(k < 4 ? 4 : 1e-4, 1e-12));
  }
}

TEST_CASE_TEMPLATE("SLATF: a master is born from an echo that nobody expects, once", Filter,
                   auvest::Slatf1<Compass<double>, Master<double>, 2>,
                   auvest::Slatf2<Compass<double>, Master<double>, 2>) {
  auto params = paper<typename Filter::Params>();
  params.gate = 16;
  params.birth_velocity_m_s = 2;
  Owner<Filter> owner((Compass<double>()), Master<double>(), 200, params);
  Filter& filter = owner.filter;
  Random random(88);
  Random noise(89);
  Belief<double, 2> start;
  start.x.setZero();
  start.P.setZero();
  REQUIRE(filter.reset(start, random) == Status::kOk);
  const auvest::Sonar<double> sonar;
  // A master moves at (1, -0.5) m/s, the slave stands; nothing is known of the master.
  for (int k = 1; k <= 60; ++k) {
    REQUIRE(filter.predict(1, Vector<double, 2>(0, 0), random) == Status::kOk);
    const double x = 80 + k;
    const double y = 60 - 0.5 * k;
    double a, b;
    noise.normal_pair(a, b);
    Echo<double> seen;
    seen.master = auvest::kUnknownMaster;
    seen.z << std::hypot(x, y) + a, auvest::math::wrap(std::atan2(-y, -x) + 0.06 * b);
    REQUIRE(filter.update(&seen, 1, sonar, random) == Status::kOk);
    REQUIRE(filter.masters() == 1);
  }
  // With sigma_V = 2 m/s the slave's own place drifts; the master is where it was heard from there.
  const auto slave = filter.slave();
  const auto master = filter.master(0);
  const double dx = master.x(0) - slave.x(0) - 140;
  const double dy = master.x(1) - slave.x(1) - 30;
  CHECK(std::hypot(dx, dy) < 4 * 0.06 * 143);
  CHECK(master.P(0, 0) > 0);

  // Through step() the same, to the bit.
  Owner<Filter> stepwise((Compass<double>()), Master<double>(), 200, params);
  Owner<Filter> in_two((Compass<double>()), Master<double>(), 200, params);
  Random by_step(90), by_two(90);
  REQUIRE(stepwise.filter.reset(start, by_step) == Status::kOk);
  REQUIRE(in_two.filter.reset(start, by_two) == Status::kOk);
  for (int k = 0; k < 4; ++k) {
    Echo<double> seen;
    seen.master = auvest::kUnknownMaster;
    seen.z << 100 + k, -2.4;
    const Vector<double, 2> u(1, 0.3);
    REQUIRE(stepwise.filter.step(1, u, nullptr, &seen, 1, sonar, by_step) == Status::kOk);
    REQUIRE(in_two.filter.predict(1, u, by_two) == Status::kOk);
    REQUIRE(in_two.filter.update(&seen, 1, sonar, by_two) == Status::kOk);
    CHECK(stepwise.filter.masters() == 1);
    CHECK(stepwise.filter.effective_size() == in_two.filter.effective_size());
    for (int n = 0; n < stepwise.filter.masters(); ++n) {
      CHECK(stepwise.filter.master(n).x == in_two.filter.master(n).x);
      CHECK(stepwise.filter.master(n).P == in_two.filter.master(n).P);
    }
    CHECK(stepwise.filter.slave().x == in_two.filter.slave().x);
  }

  params.gate = 0;  // births need a gate
  Owner<Filter> gateless((Compass<double>()), Master<double>(), 10, params);
  CHECK(gateless.filter.reset(start, random) == Status::kBadParameter);
}

}  // namespace
