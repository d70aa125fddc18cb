// EKF-SLAT against a dense textbook filter, against the EKF of the master, and for consistency;
// dead reckoning and the outage around the filters.
#include <doctest/doctest.h>

#include "close.hpp"
#include "paper.hpp"

#include <Eigen/LU>
#include <cmath>
#include <cstring>
#include <new>
#include <type_traits>

#include "auvest/filters/ekf.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/slat/dead_reckoning.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/outage.hpp"
#include "simulation/slat.hpp"

namespace {

using auvest::Belief;
using auvest::Echo;
using auvest::Matrix;
using auvest::SlatScenario;
using auvest::Status;
using auvest::Vector;
using auvest::math::Random;
using slat_test::OpenEkf;

template <class Scalar>
using Compass = auvest::CompassMotion<Scalar>;
template <class Scalar>
using Master = auvest::PiecewiseAcceleration<Scalar>;

template <class Scalar>
Belief<Scalar, 6> master_belief(double x, double y) {
  Belief<Scalar, 6> belief;
  belief.x << Scalar(x), Scalar(y), Scalar(2), Scalar(-1), Scalar(0.01), Scalar(0);
  belief.P.setZero();
  for (int i = 0; i < 6; ++i) belief.P(i, i) = Scalar(i < 2 ? 4 : 0.01);
  return belief;
}

TEST_CASE_TEMPLATE("EKF-SLAT: with a slave that is known it is the EKF of the master, bit for bit",
                   Scalar, float, double) {
  typename Compass<Scalar>::Params still;
  still.sigma_speed_m_s = still.sigma_heading_rad = Scalar(0);
  OpenEkf<Compass<Scalar>, Master<Scalar>, 1> slat((Compass<Scalar>(still)), Master<Scalar>());
  Random random(1);
  Belief<Scalar, 2> start;
  start.x << Scalar(10), Scalar(20);
  start.P.setZero();
  REQUIRE(slat.reset(start, random) == Status::kOk);
  const auto prior = master_belief<Scalar>(200, 100);
  REQUIRE(slat.add_master(prior) == Status::kOk);
  auvest::Ekf<Master<Scalar>> ekf{Master<Scalar>()};
  REQUIRE(ekf.reset(prior.x, prior.P) == Status::kOk);
  typename auvest::Sonar<Scalar>::Params sonar;
  sonar.bearing = auvest::Bearing::kSlaveToMaster;
  for (int k = 0; k < 100; ++k) {
    const Vector<Scalar, 2> u(Scalar(3), Scalar(0.01 * k));
    REQUIRE(slat.predict(Scalar(1), u, random) == Status::kOk);
    REQUIRE(ekf.predict(Scalar(1)) == Status::kOk);
    typename auvest::RangeBearing<Scalar, 6>::Params station;
    station.sigma_range_m = sonar.sigma_range_m;
    station.sigma_bearing_rad = sonar.sigma_bearing_rad;
    station.near_field = Scalar(0);
    station.station_x_m = slat.slave().x(0);
    station.station_y_m = slat.slave().x(1);
    Echo<Scalar> seen;
    seen.master = 0;
    seen.z << Scalar(200 + random.normal<double>()), Scalar(0.4 + 0.05 * random.normal<double>());
    REQUIRE(slat.update(&seen, 1, auvest::Sonar<Scalar>(sonar), random) == Status::kOk);
    REQUIRE(ekf.update(seen.z, auvest::RangeBearing<Scalar, 6>(station)).status == Status::kOk);
  }
  const auto master = slat.master(0);
  for (int i = 0; i < 6; ++i) {
    CHECK(master.x(i) == ekf.x()(i));
    for (int j = 0; j <= i; ++j) CHECK(master.P(i, j) == ekf.belief().P(i, j));
  }
}

/// Random predictions and sightings of two masters, beside a dense filter with S^-1 and P - K S K'.
template <class Motion>
void check_textbook(const Motion& motion, const Belief<double, Motion::kStates>& start,
                    auvest::Bearing bearing) {
  constexpr int pose = Motion::kStates;
  constexpr int n = pose + 12;
  OpenEkf<Motion, Master<double>, 2> slat(motion, Master<double>());
  Random random(2);
  REQUIRE(slat.reset(start, random) == Status::kOk);
  Eigen::Matrix<double, n, 1> x = Eigen::Matrix<double, n, 1>::Zero();
  Eigen::Matrix<double, n, n> P = Eigen::Matrix<double, n, n>::Zero();
  x.template head<pose>() = start.x;
  P.template topLeftCorner<pose, pose>() = start.P;
  for (int m = 0; m < 2; ++m) {
    const auto belief = master_belief<double>(150 - 250 * m, 200);
    REQUIRE(slat.add_master(belief) == Status::kOk);
    x.template segment<6>(pose + 6 * m) = belief.x;
    P.template block<6, 6>(pose + 6 * m, pose + 6 * m) = belief.P;
  }
  auvest::Sonar<double>::Params params;
  params.bearing = bearing;
  const auvest::Sonar<double> sonar(params);
  double log_likelihood = 0;
  for (int k = 0; k < 60; ++k) {
    const Vector<double, 2> u(2, 0.1);
    const double dt = 0.5;
    REQUIRE(slat.predict(dt, u, random) == Status::kOk);
    const auto step = motion.step(u, dt);
    Belief<double, pose> slave;
    slave.x = x.template head<pose>();
    slave.P.setZero();
    Eigen::Matrix<double, n, n> phi = Eigen::Matrix<double, n, n>::Identity();
    Eigen::Matrix<double, n, n> q = Eigen::Matrix<double, n, n>::Zero();
    phi.template topLeftCorner<pose, pose>() = motion.transition(step, slave.x);
    q.template topLeftCorner<pose, pose>() = motion.noise(step, slave.x);
    motion.propagate(step, slave);
    for (int m = 0; m < 2; ++m) {
      phi.template block<6, 6>(pose + 6 * m, pose + 6 * m) =
          Master<double>().Phi(Vector<double, 6>::Zero(), dt);
      q.template block<6, 6>(pose + 6 * m, pose + 6 * m) = Master<double>().Q(dt);
    }
    x = (phi * x).eval();
    x.template head<pose>() = slave.x;
    P = (phi * P * phi.transpose() + q).eval();

    const int seen_master = (k / 3) % 2;
    Echo<double> seen;
    seen.master = seen_master;
    const int at = pose + 6 * seen_master;
    auvest::Sonar<double>::View<double, pose> view;
    const Vector<double, pose> here = x.template head<pose>();
    sonar.look(here, x(at), x(at + 1), Vector<double, 2>(0, 0), view);
    seen.z << -view.innovation(0) + random.normal<double>(),
        auvest::math::wrap(-view.innovation(1) + 0.06 * random.normal<double>());
    sonar.look(here, x(at), x(at + 1), seen.z, view);
    Eigen::Matrix<double, 2, n> h = Eigen::Matrix<double, 2, n>::Zero();
    h.template leftCols<pose>() = view.by_slave;
    h.template middleCols<2>(at) = view.by_master;
    const Eigen::Matrix2d s = h * P * h.transpose() + sonar.R<double>();
    const Eigen::Matrix<double, n, 2> gain = P * h.transpose() * s.inverse();
    x += gain * view.innovation;
    P = (P - gain * s * gain.transpose()).eval();
    if (pose > 2) x(pose - 1) = auvest::math::wrap(x(pose - 1));
    const double nis = view.innovation.dot(s.inverse() * view.innovation);
    log_likelihood -=
        0.5 * (nis + std::log(s.determinant())) + std::log(2 * auvest::math::pi<double>());
    REQUIRE(slat.update(&seen, 1, sonar, random) == Status::kOk);
    CHECK(slat.nis() == close_to(nis, 1e-7));
  }
  for (int i = 0; i < n; ++i) {
    CHECK(std::fabs(slat.belief().x(i) - x(i)) < 1e-8);
    for (int j = 0; j <= i; ++j) CHECK(std::fabs(slat.belief().P(i, j) - P(i, j)) < 1e-8);
  }
  CHECK(slat.log_likelihood() == close_to(log_likelihood, 1e-9));
}

TEST_CASE("EKF-SLAT: two masters, against a dense filter with S^-1") {
  Belief<double, 2> start;
  start.x << 1, 2;
  start.P << 2, 0.3, 0.3, 1;
  check_textbook(Compass<double>(), start, auvest::Bearing::kMasterToSlave);
  Belief<double, 3> oriented;
  oriented.x << 1, 2, 3.0;
  oriented.P = 0.01 * Matrix<double, 3, 3>::Identity();
  check_textbook(auvest::UnicycleMotion<double>(), oriented, auvest::Bearing::kFromHeading);
}

/// Means over the runs of the slave's NEES at the end (so independent) and of the NIS, by which
/// chi-square bound they lie off 2, in standard deviations. Precise odometry, 0.3 m/s and 0.03 rad,
/// so that the motion is close to linear over a step; everything else is section 7, level 3.
struct Consistency {
  double nees;
  double nis;

  /// The filter believes in Q and R times the given factors.
  Consistency(double q_factor, double r_factor) {
    SlatScenario scenario;
    scenario.sigma_speed_m_s = 0.3;
    scenario.sigma_heading_rad = 0.03;
    Compass<double>::Params motion;
    motion.sigma_speed_m_s = scenario.sigma_speed_m_s * std::sqrt(q_factor);
    motion.sigma_heading_rad = scenario.sigma_heading_rad * std::sqrt(q_factor);
    auvest::Sonar<double>::Params sonar;
    sonar.sigma_range_m = scenario.sigma_range_m * std::sqrt(r_factor);
    sonar.sigma_bearing_rad = scenario.sigma_bearing_rad * std::sqrt(r_factor);
    using Filter = OpenEkf<Compass<double>, Master<double>, 1>;
    const int runs = 60;
    double nees_sum = 0, nis_sum = 0;
    int updates = 0;
    for (int run = 0; run < runs; ++run) {
      Filter filter((Compass<double>(motion)), Master<double>());
      Random world(91, static_cast<std::uint64_t>(run));
      Random random(0);
      Vector<double, 2> error;
      const Status status = auvest::run_slat(filter, auvest::Sonar<double>(sonar), scenario, world,
                                             random, [&](const auvest::SlatStep<Filter>& step) {
                                               for (int i = 0; i < 2; ++i)
                                                 error(i) =
                                                     filter.slave().x(i) - step.slave.position[i];
                                               nis_sum += filter.nis();
                                               ++updates;
                                             });
      REQUIRE(status == Status::kOk);
      const Eigen::Matrix2d P = filter.slave().P;
      nees_sum += error.dot(P.inverse() * error);
    }
    // Chi-square with 2 degrees of freedom has the variance 4; its sum is nearly normal.
    nees = (nees_sum / runs - 2) / std::sqrt(4.0 / runs);
    nis = (nis_sum / updates - 2) / std::sqrt(4.0 / updates);
    MESSAGE("Q x ", q_factor, ", R x ", r_factor, ": NEES ", nees_sum / runs, ", NIS ",
            nis_sum / updates);
  }
};

TEST_CASE("EKF-SLAT: NEES and NIS lie inside their chi-square bounds where the models hold") {
  const Consistency matched(1, 1);
  CHECK(std::fabs(matched.nees) < 3.3);  // 99.9 %
  CHECK(std::fabs(matched.nis) < 3.3);
}

TEST_CASE("EKF-SLAT: NEES or NIS lie outside their bounds where Q or R is wrong by 4") {
  const double bound = 3.3;
  CHECK(Consistency(0.25, 1).nees > bound);  // Q tells how far the slave drifts
  CHECK(Consistency(4, 1).nees < -bound);
  CHECK(Consistency(1, 0.25).nis > bound);  // R, what an echo may differ by
  CHECK(Consistency(1, 4).nis < -bound);
}

TEST_CASE("EKF-SLAT: a result that would not be finite is refused, with all echoes of the ping") {
  OpenEkf<Compass<float>, Master<float>, 2> slat((Compass<float>()), Master<float>());
  Random random(4);
  Belief<float, 2> start;
  start.x.setZero();
  start.P = Matrix<float, 2, 2>::Identity();
  REQUIRE(slat.reset(start, random) == Status::kOk);
  REQUIRE(slat.add_master(master_belief<float>(200, 100)) == Status::kOk);
  REQUIRE(slat.add_master(master_belief<float>(400, 0)) == Status::kOk);
  const int second = decltype(slat)::Model::first_of(1);
  const_cast<Belief<float, 14>&>(slat.belief()).x(second) = 1e25f;  // its range overflows
  Echo<float> seen[2];
  seen[0].master = 0;
  seen[0].z << 225, -2.7f;
  seen[1].master = 1;
  seen[1].z << 300, 0;
  const auto before = slat.belief();
  CHECK(slat.update(seen, 2, auvest::Sonar<float>(), random) == Status::kOverflow);
  CHECK(slat.belief().x == before.x);
  CHECK(slat.belief().P == before.P);
  CHECK(slat.nis() == 0);
  CHECK(slat.log_likelihood() == 0);
  REQUIRE(slat.update(seen, 1, auvest::Sonar<float>(), random) == Status::kOk);
  CHECK(slat.belief().P(2, 2) < before.P(2, 2));
}

TEST_CASE("EKF-SLAT: a gate that is negative or not finite is refused, and so is a bad model") {
  using Filter = OpenEkf<Compass<double>, Master<double>, 1>;
  Random random(5);
  Belief<double, 2> start;
  start.x.setZero();
  start.P.setIdentity();
  Filter::Params params;
  for (const double gate : {-0.1, std::nan(""), HUGE_VAL}) {
    params.gate = gate;
    Filter filter((Compass<double>()), Master<double>(), params);
    CHECK(filter.reset(start, random) == Status::kBadParameter);
  }
  for (const double gate : {0.0, 16.0}) {
    params.gate = gate;
    Filter filter((Compass<double>()), Master<double>(), params);
    CHECK(filter.reset(start, random) == Status::kOk);
  }
  Compass<double>::Params motion;
  motion.sigma_heading_rad = std::nan("");
  Filter filter((Compass<double>(motion)), Master<double>());
  CHECK(filter.reset(start, random) == Status::kBadParameter);
  auvest::DeadReckoning<Compass<double>> reckoning((Compass<double>(motion)));
  CHECK(reckoning.reset(start, random) == Status::kBadParameter);
}

TEST_CASE("dead reckoning: the paper's bias in section 7 and its compensation") {
  for (const bool compensate : {false, true}) {
    Compass<double>::Params motion;
    motion.compensate_bias = compensate;
    using Filter = auvest::DeadReckoning<Compass<double>>;
    double along = 0;
    const int runs = 200;
    for (int run = 0; run < runs; ++run) {
      Filter filter((Compass<double>(motion)));
      Random world(92, static_cast<std::uint64_t>(run));
      Random random(0);
      double last = 0;
      REQUIRE(auvest::run_slat(filter, auvest::Sonar<double>(), SlatScenario(), world, random,
                               [&](const auvest::SlatStep<Filter>& step) {
                                 const auto x = filter.slave().x;
                                 const double c = std::cos(step.slave.heading);
                                 const double s = std::sin(step.slave.heading);
                                 last = c * (x(0) - step.slave.position[0]) +
                                        s * (x(1) - step.slave.position[1]);
                               }) == Status::kOk);
      along += last / runs;
    }
    // 400 s at 5.1444 m/s, 4.4 % short; the spread is 2 m/s * sqrt(400) = 40 m per run.
    const double expected = compensate ? 0 : 5.1444 * 400 * (std::exp(-0.045) - 1);
    CHECK(std::fabs(along - expected) < 4 * 42 / std::sqrt(1.0 * runs));
  }
}

TEST_CASE("outage: starts from the last shared state, hands over when communication returns") {
  using Filter = OpenEkf<Compass<double>, Master<double>, 1>;
  auvest::Outage<Filter, 1> outage(Filter((Compass<double>()), Master<double>()));
  Random random(3);
  const Vector<double, 2> u(5, 0.2);
  const auvest::Sonar<double> sonar;
  Echo<double> seen;
  seen.master = 0;
  seen.z << 220, -2;
  CHECK(outage.predict(1, u, random) == Status::kNotInitialised);
  CHECK(outage.update(&seen, 1, sonar, random) == Status::kNotInitialised);

  Belief<double, 2> slave;
  slave.x << 7, 8;
  slave.P << 0.5, 0, 0, 0.5;
  auto master = master_belief<double>(100, 200);
  CHECK(outage.share(slave, &master, 2) == Status::kBadParameter);
  REQUIRE(outage.share(slave, &master, 1) == Status::kOk);
  CHECK(outage.mode() == auvest::Communication::kUp);
  CHECK(outage.slave().x == slave.x);
  // While communication works, an echo changes nothing.
  CHECK(outage.update(&seen, 1, sonar, random) == Status::kOk);
  CHECK(outage.slave().x == slave.x);
  CHECK(outage.master(0).x == master.x);

  // The outage: what the filter alone would do from the shared state.
  Filter alone((Compass<double>()), Master<double>());
  REQUIRE(alone.reset(slave, random) == Status::kOk);
  REQUIRE(alone.add_master(master) == Status::kOk);
  for (int k = 0; k < 5; ++k) {
    REQUIRE(outage.predict(1, u, random) == Status::kOk);
    REQUIRE(outage.update(&seen, 1, sonar, random) == Status::kOk);
    REQUIRE(alone.predict(1, u, random) == Status::kOk);
    REQUIRE(alone.update(&seen, 1, sonar, random) == Status::kOk);
  }
  CHECK(outage.mode() == auvest::Communication::kDown);
  CHECK(outage.slave().x == alone.slave().x);
  CHECK(outage.master(0).x == alone.master(0).x);

  // It returns, and fails again: the second outage knows nothing of the first.
  slave.x << 50, 60;
  REQUIRE(outage.share(slave, &master, 1) == Status::kOk);
  CHECK(outage.slave().x == slave.x);
  REQUIRE(outage.predict(1, u, random) == Status::kOk);
  REQUIRE(alone.reset(slave, random) == Status::kOk);
  REQUIRE(alone.predict(1, u, random) == Status::kOk);
  CHECK(outage.slave().x == alone.slave().x);
  master.P.setZero();
  CHECK(outage.share(slave, &master, 1) == Status::kNotPositiveDefinite);
  slave.x(0) = std::nan("");
  CHECK(outage.share(slave, &master, 0) == Status::kNotFinite);
  CHECK(outage.mode() == auvest::Communication::kDown);
}

TEST_CASE("outage: the filter has the masters that were shared last, no more") {
  using Filter = OpenEkf<Compass<double>, Master<double>, 2>;
  auvest::Outage<Filter, 2> outage(Filter((Compass<double>()), Master<double>()));
  Random random(6);
  Belief<double, 2> slave;
  slave.x << 7, 8;
  slave.P.setIdentity();
  const Belief<double, 6> masters[2] = {master_belief<double>(100, 200),
                                        master_belief<double>(-100, 50)};
  const Vector<double, 2> u(5, 0.2);
  for (const int count : {2, 1, 0, 2}) {
    REQUIRE(outage.share(slave, masters, count) == Status::kOk);
    REQUIRE(outage.predict(1, u, random) == Status::kOk);
    CHECK(outage.filter().masters() == count);
  }
}

TEST_CASE("EKF-SLAT: the NIS of several echoes at one time is their sum, each after those before") {
  using Filter = OpenEkf<Compass<double>, Master<double>, 2>;
  Filter together((Compass<double>()), Master<double>());
  Random random(3);
  Belief<double, 2> slave;
  slave.x << 7, 8;
  slave.P.setIdentity();
  REQUIRE(together.reset(slave, random) == Status::kOk);
  REQUIRE(together.add_master(master_belief<double>(100, 200)) == Status::kOk);
  REQUIRE(together.add_master(master_belief<double>(-100, 50)) == Status::kOk);
  const auvest::Sonar<double> sonar;
  Echo<double> echoes[2];
  for (int s = 0; s < 2; ++s) {
    echoes[s].master = s;
    echoes[s].z << 200 - 80 * s, -2.0 + 1.5 * s;
  }
  Filter apart = together;
  double nis = 0;
  for (const Echo<double>& echo : echoes) {
    REQUIRE(apart.update(&echo, 1, sonar, random) == Status::kOk);
    CHECK(apart.nis() > 0.1);
    nis += apart.nis();
  }
  REQUIRE(together.update(echoes, 2, sonar, random) == Status::kOk);
  CHECK(together.nis() == close_to(nis, 1e-14));
  CHECK(together.log_likelihood() == close_to(apart.log_likelihood(), 1e-14));
}

TEST_CASE("SLAT filters: what is refused changes nothing; a reset begins anew") {
  using Filter = OpenEkf<Compass<double>, Master<double>, 2>;
  Filter filter((Compass<double>()), Master<double>());
  Random random(4);
  const auvest::Sonar<double> sonar;
  const Vector<double, 2> u(5, 0.2);
  Echo<double> seen;
  seen.master = 0;
  seen.z << 210, -2.0;
  CHECK(filter.predict(1, u, random) == Status::kNotInitialised);
  CHECK(filter.update(&seen, 1, sonar, random) == Status::kNotInitialised);
  CHECK(filter.add_master(master_belief<double>(100, 200)) == Status::kNotInitialised);

  Belief<double, 2> slave;
  slave.x << 7, 8;
  slave.P.setIdentity();
  const auto begin = [&] {
    REQUIRE(filter.reset(slave, random) == Status::kOk);
    for (int m = 0; m < 2; ++m) {
      REQUIRE(filter.add_master(master_belief<double>(100 - 200 * m, 200)) == Status::kOk);
    }
  };
  begin();
  REQUIRE(filter.predict(1, u, random) == Status::kOk);
  REQUIRE(filter.update(&seen, 1, sonar, random) == Status::kOk);
  const auto before = filter.belief();
  const double log_likelihood = filter.log_likelihood();
  const auto refused = [&](Status status, Status wanted) {
    CHECK(status == wanted);
    CHECK(filter.belief().x == before.x);
    CHECK(filter.belief().P == before.P);
    CHECK(filter.masters() == 2);
    CHECK(filter.log_likelihood() == log_likelihood);
  };
  const double nan = std::nan("");
  refused(filter.predict(nan, u, random), Status::kNotFinite);
  refused(filter.predict(-0.5, u, random), Status::kTimeBackwards);
  refused(filter.predict(1, Vector<double, 2>(5, nan), random), Status::kNotFinite);
  Vector<double, 2> plan[2] = {{0, 0}, {0, nan}};
  refused(filter.predict(1, u, random, plan), Status::kNotFinite);
  refused(filter.add_master(master_belief<double>(0, 0)), Status::kBadParameter);  // the third
  for (int i = 0; i < 2; ++i) {
    Belief<double, 2> bad = slave;
    bad.x(i) = nan;
    refused(filter.reset(bad, random), Status::kNotFinite);
    bad = slave;
    bad.P(1, i) = nan;
    refused(filter.reset(bad, random), Status::kNotFinite);
    bad = slave;
    bad.P(i, i) = -1e-3;
    refused(filter.reset(bad, random), Status::kNotPositiveDefinite);
  }
  Echo<double> wrong = seen;
  wrong.z(1) = nan;
  refused(filter.update(&wrong, 1, sonar, random), Status::kNotFinite);

  REQUIRE(filter.reset(slave, random) == Status::kOk);
  CHECK(filter.masters() == 0);
  CHECK(filter.log_likelihood() == 0);
  auto master = master_belief<double>(100, 200);
  master.P(1, 0) = 5;  // a correlation above 1
  CHECK(filter.add_master(master) == Status::kNotPositiveDefinite);
  master.P(1, 0) = nan;
  CHECK(filter.add_master(master) == Status::kNotFinite);
  CHECK(filter.masters() == 0);
  begin();
  REQUIRE(filter.predict(1, u, random) == Status::kOk);
  REQUIRE(filter.update(&seen, 1, sonar, random) == Status::kOk);
  CHECK(filter.belief().x == before.x);
  CHECK(filter.log_likelihood() == log_likelihood);
}

TEST_CASE("dead reckoning: before a start nothing is known; reads the lower triangle of P") {
  using Filter = auvest::DeadReckoning<Compass<double>>;
  // In memory that holds something else.
  std::aligned_storage<sizeof(Filter), alignof(Filter)>::type memory;
  std::memset(&memory, 0xA5, sizeof memory);
  Filter& filter = *new (&memory) Filter((Compass<double>()));
  CHECK(filter.slave().x == Vector<double, 2>::Zero());
  CHECK(filter.slave().P == auvest::Matrix<double, 2, 2>::Zero());
  Random none(5);
  CHECK(filter.predict(1, Vector<double, 2>(5, 0.2), none) == Status::kNotInitialised);
  CHECK(filter.update(nullptr, 0, auvest::Sonar<double>(), none) == Status::kNotInitialised);
  Random random(5);
  Belief<double, 2> pose;
  pose.x << 7, 8;
  pose.P << 2, std::nan(""), 0.5, 1;
  REQUIRE(filter.reset(pose, random) == Status::kOk);
  CHECK(filter.slave().P(0, 1) == 0.5);
  CHECK(filter.slave().P(1, 0) == 0.5);
}

TEST_CASE("SLAT: the extent of a belief is by positions, speeds and accelerations, of all bodies") {
  // x, y of the slave, and of one master x, y, vx, vy, ax, ay; an angle of the slave counts as its
  // position does.
  using Filter = OpenEkf<Compass<double>, Master<double>, 1>;
  for (int i = 0; i < 8; ++i) {
    Belief<double, 8> belief;
    belief.x.setZero();
    belief.P.setZero();
    const int kind = i < 2 ? 0 : (i - 2) / 2;
    for (const bool variance : {false, true}) {
      belief.x(i) = variance ? 0 : -5;
      belief.P(i, i) = variance ? 25 : 0;
      const auto extent = Filter::extent_of(belief);
      for (int k = 0; k < 3; ++k) CHECK(extent.square[k] == (k == kind ? 25 : 0));
    }
  }
}

TEST_CASE("outage: a shared state that is refused leaves the one before") {
  using Filter = OpenEkf<Compass<double>, Master<double>, 2>;
  auvest::Outage<Filter, 2> outage(Filter((Compass<double>()), Master<double>()));
  Random random(6);
  Belief<double, 2> slave;
  slave.x << 7, 8;
  slave.P.setIdentity();
  Belief<double, 6> masters[2] = {master_belief<double>(100, 200), master_belief<double>(-100, 50)};
  const Vector<double, 2> u(5, 0.2);
  REQUIRE(outage.share(slave, masters, 1) == Status::kOk);
  slave.x << 70, 80;
  CHECK(outage.share(slave, masters, -1) == Status::kBadParameter);
  CHECK(outage.share(slave, masters, 3) == Status::kBadParameter);
  masters[1].x(5) = std::nan("");
  CHECK(outage.share(slave, masters, 2) == Status::kNotFinite);
  masters[1] = master_belief<double>(-100, 50);
  masters[1].P(4, 2) = HUGE_VAL;
  CHECK(outage.share(slave, masters, 2) == Status::kNotFinite);
  CHECK(outage.slave().x == Vector<double, 2>(7, 8));
  REQUIRE(outage.predict(1, u, random) == Status::kOk);
  CHECK(outage.filter().masters() == 1);
  CHECK(outage.shared_masters() == 1);
  // It goes on from there, and is not started again.
  const auto position = outage.slave().x;
  REQUIRE(outage.predict(1, u, random) == Status::kOk);
  CHECK((outage.slave().x - position).norm() > 1);

  // All that was shared is there at once, each master as itself, and starts the next outage.
  masters[1] = master_belief<double>(-100, 50);
  REQUIRE(outage.share(slave, masters, 2) == Status::kOk);
  CHECK(outage.shared_masters() == 2);
  CHECK(outage.slave().x == Vector<double, 2>(70, 80));
  for (int n = 0; n < 2; ++n) CHECK(outage.master(n).x == masters[n].x);
  REQUIRE(outage.predict(0, u, random) == Status::kOk);
  CHECK(outage.filter().masters() == 2);
  for (int n = 0; n < 2; ++n) CHECK(outage.master(n).x == masters[n].x);
}

TEST_CASE("EKF-SLAT: of several masters each has its own planned change and one echo in a ping") {
  using Filter = OpenEkf<Compass<double>, Master<double>, 3>;
  Random random(7);
  Belief<double, 2> slave;
  slave.x << 7, 8;
  slave.P.setIdentity();
  const Vector<double, 2> u(5, 0.2);
  const Vector<double, 2> changes[3] = {Vector<double, 2>(0.5, -1), Vector<double, 2>(3, -4),
                                        Vector<double, 2>(0, 0)};
  const double dt = 2;
  Filter with((Compass<double>()), Master<double>()), without = with;
  for (Filter* filter : {&with, &without}) {
    REQUIRE(filter->reset(slave, random) == Status::kOk);
    REQUIRE(filter->add_master(master_belief<double>(100, 200)) == Status::kOk);
    REQUIRE(filter->add_master(master_belief<double>(-100, 50)) == Status::kOk);
    REQUIRE(filter->add_master(master_belief<double>(0, -90)) == Status::kOk);
    REQUIRE(filter->predict(dt, u, random, filter == &with ? changes : nullptr) == Status::kOk);
  }
  for (int n = 0; n < 2; ++n) {
    CAPTURE(n);
    const Vector<double, 6> moved = with.master(n).x - without.master(n).x;
    for (int axis = 0; axis < 2; ++axis) {
      CHECK(moved(axis) == close_to(0.5 * dt * changes[n](axis), 1e-12));
      CHECK(moved(2 + axis) == close_to(changes[n](axis), 1e-12));
      CHECK(moved(4 + axis) == 0);
    }
    CHECK(with.master(n).P == without.master(n).P);
  }
  CHECK(with.slave().x == without.slave().x);

  // Two echoes of one master in a ping are refused, next to each other or not.
  Echo<double> ping[3];
  for (int s = 0; s < 3; ++s) {
    ping[s].master = s % 2;
    ping[s].z << 220, -2;
  }
  const auvest::Sonar<double> sonar;
  CHECK(with.update(ping, 3, sonar, random) == Status::kBadParameter);
  CHECK(with.update(ping + 1, 2, sonar, random) == Status::kOk);
}

}  // namespace
