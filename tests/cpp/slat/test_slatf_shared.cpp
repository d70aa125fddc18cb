// SlatfShared against what it must equal: EKF-SLAT where nothing is drawn, Joseph's form, and the
// joint particles whose covariance it keeps once.
#include <doctest/doctest.h>

#include "brute_force.hpp"
#include "close.hpp"

#include <Eigen/LU>
#include <cmath>
#include <initializer_list>
#include <vector>

#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/slatf.hpp"
#include "auvest/slat/slatf_joint.hpp"
#include "auvest/slat/slatf_shared.hpp"
#include "simulation/slat.hpp"

namespace {

using namespace slat_test;

using Unicycle = auvest::UnicycleMotion<double>;
template <class Motion, int Masters>
using Shared = auvest::SlatfShared<Motion, Master<double>, Masters>;

/// One particle that keeps all and EKF-SLAT, over steps with none, one or two echoes.
template <class Motion>
void check_equals_ekf(auvest::Bearing bearing) {
  using Filter = Shared<Motion, 2>;
  using Ekf = auvest::EkfSlat<Motion, Master<double>, 2>;
  typename Filter::Params params;
  params.kept = 1;
  Owner<Filter> owner(Motion(), Master<double>(), 1, params);
  Ekf ekf((Motion()), Master<double>());
  Random random(21);
  typename Filter::SlaveBelief start;
  start.x.setConstant(0.5);
  start.P = 0.01 * Matrix<double, Filter::kPose, Filter::kPose>::Identity();
  REQUIRE(owner.filter.reset(start, random) == Status::kOk);
  REQUIRE(ekf.reset(start, random) == Status::kOk);
  for (int n = 0; n < 2; ++n) {
    const auto prior = master_belief<double>(100 - 200 * n, 150, 1, 0.5, 2);
    REQUIRE(owner.filter.add_master(prior) == Status::kOk);
    REQUIRE(ekf.add_master(prior) == Status::kOk);
  }
  typename auvest::Sonar<double>::Params sonar;
  sonar.bearing = bearing;
  for (int k = 0; k < 60; ++k) {
    const Vector<double, 2> u(2, 0.01 * k);
    const Vector<double, 2> changes[2] = {{0.01, 0}, {0, -0.02}};
    Echo<double> seen[2];
    for (int n = 0; n < 2; ++n) {
      typename auvest::Sonar<double>::template View<double, Filter::kPose> view;
      const auto master = ekf.master(1 - n).x;
      auvest::Sonar<double>(sonar).look(ekf.slave().x, master(0), master(1),
                                        Vector<double, 2>(0, 0), view);
      seen[n].master = 1 - n;
      seen[n].z = -view.innovation;
      // Beyond the gate from 30 on: from 35 on a master of its own.
      seen[n].z(0) += k >= 30 && n == 0 ? 500 : random.normal<double>();
      seen[n].z(1) += 0.06 * random.normal<double>();
    }
    REQUIRE(owner.filter.step(1, u, changes, seen, k % 3, auvest::Sonar<double>(sonar), random) ==
            Status::kOk);
    REQUIRE(ekf.predict(1, u, random, changes) == Status::kOk);
    REQUIRE(ekf.update(seen, k % 3, auvest::Sonar<double>(sonar), random) == Status::kOk);
    const auto slave = owner.filter.slave();
    REQUIRE((slave.x - ekf.slave().x).cwiseAbs().maxCoeff() < 1e-9);
    REQUIRE((slave.P - ekf.slave().P).cwiseAbs().maxCoeff() < 1e-9);
    for (int n = 0; n < 2; ++n) {
      REQUIRE((owner.filter.master(n).x - ekf.master(n).x).cwiseAbs().maxCoeff() < 1e-9);
      REQUIRE((owner.filter.master(n).P - ekf.master(n).P).cwiseAbs().maxCoeff() < 1e-9);
    }
  }
  CHECK(owner.filter.log_likelihood() == close_to(ekf.log_likelihood(), 1e-10));
  CHECK(ekf.safeguards().report().rebirths > 0);
  CHECK(owner.filter.safeguards().report().rebirths == ekf.safeguards().report().rebirths);
  CHECK(owner.filter.safeguards().report().refused == ekf.safeguards().report().refused);
}

TEST_CASE("SlatfShared: one particle that keeps all is EKF-SLAT") {
  check_equals_ekf<Compass<double>>(auvest::Bearing::kMasterToSlave);
  check_equals_ekf<Unicycle>(auvest::Bearing::kFromHeading);
}

/// A joint belief of slave and two masters, and H of the sonar for one of them.
struct Problem {
  using Model = auvest::JointGaussian<Compass<double>, Master<double>, 2>;
  using Full = Eigen::Matrix<double, 14, 14>;
  Model::Joint joint;
  Full P;
  Eigen::Matrix<double, 2, 14> H = Eigen::Matrix<double, 2, 14>::Zero();
  auvest::Sonar<double> sonar;

  explicit Problem(int n) {
    Random random(31);
    Full root;
    for (int i = 0; i < 14; ++i) {
      joint.x(i) = random.normal<double>();
      for (int j = 0; j < 14; ++j) root(i, j) = 0.3 * random.normal<double>();
    }
    joint.x(Model::first_of(n)) += 40;
    joint.P = P = root * root.transpose();
    auvest::Sonar<double>::View<double, 2> view;
    sonar.look(Vector<double, 2>(joint.x(0), joint.x(1)), joint.x(Model::first_of(n)),
               joint.x(Model::first_of(n) + 1), Vector<double, 2>(0, 0), view);
    H.leftCols<2>() = view.by_slave;
    H.block<2, 2>(0, Model::first_of(n)) = view.by_master;
  }

  static Full full(Model::Joint one) {
    auvest::math::mirror_lower(one.P);
    return one.P;
  }
};

TEST_CASE(
    "SlatfShared: an echo that a share accepts narrows the covariance as Joseph's form does") {
  for (const int n : {0, 1}) {
    for (const double g : {1.0, 0.9, 0.5, 0.01}) {
      Problem problem(n);
      Eigen::Matrix2d R = Eigen::Matrix2d::Zero();
      R(0, 0) = std::pow(problem.sonar.params.sigma_range_m, 2);
      R(1, 1) = std::pow(problem.sonar.params.sigma_bearing_rad, 2);
      const Eigen::Matrix2d S = problem.H * problem.P * problem.H.transpose() + R;
      const Eigen::Matrix<double, 14, 2> K = g * problem.P * problem.H.transpose() * S.inverse();
      const Problem::Full I = Problem::Full::Identity() - K * problem.H;
      const Problem::Full expected = I * problem.P * I.transpose() + K * R * K.transpose();
      auto after = problem.joint;
      Problem::Model::narrow(n, problem.sonar, g, after);
      CAPTURE(g);
      CHECK((Problem::full(after) - expected).cwiseAbs().maxCoeff() < 1e-12);
      CHECK(after.x == problem.joint.x);
    }
  }
}

/// The mean over particles stays, and what P loses in a draw is what their means spread.
TEST_CASE("SlatfShared: a draw changes neither mean nor covariance of the set") {
  using Filter = Shared<Compass<double>, 1>;
  typename Filter::Params params;
  params.kept = 0.3;
  params.resample_below = 0;
  const int particles = 40000;
  Owner<Filter> drawn(Compass<double>(), Master<double>(), particles, params);
  params.kept = 1;
  Owner<Filter> whole(Compass<double>(), Master<double>(), particles, params);
  for (Owner<Filter>* owner : {&drawn, &whole}) {
    Random random(5);
    Filter& filter = owner->filter;
    typename Filter::SlaveBelief start;
    start.x.setZero();
    start.P << 4, 1, 1, 2;
    REQUIRE(filter.reset(start, random) == Status::kOk);
    REQUIRE(filter.add_master(master_belief<double>(0, 300, 1, 0, 3)) == Status::kOk);
    Echo<double> seen;
    seen.master = 0;
    seen.z << 302, -1.5;
    REQUIRE(filter.update(&seen, 1, auvest::Sonar<double>(), random) == Status::kOk);
  }
  CHECK(drawn.filter.covariance()(0, 0) < 0.99 * whole.filter.covariance()(0, 0));
  const auto a = drawn.filter.slave(), b = whole.filter.slave();
  const auto m = drawn.filter.master(0), n = whole.filter.master(0);
  const double error = 5 / std::sqrt(double(particles));
  for (int i = 0; i < 2; ++i) {
    CHECK(std::fabs(a.x(i) - b.x(i)) < error * std::sqrt(b.P(i, i)));
    CHECK(a.P(i, i) == close_to(b.P(i, i), 1.5 * error));
    CHECK(m.P(i, i) == close_to(n.P(i, i), 1.5 * error));
  }
}

constexpr int kRuns = 12;

/// One run of the paper's scenario: adds its shares to the mean RMSE and NEES of the slave.
template <class Filter>
void fly(Filter& filter, int number, double& rmse, double& nees) {
  Random world(1, static_cast<std::uint64_t>(2 * number));
  Random random(1, static_cast<std::uint64_t>(2 * number + 1));
  double square = 0;
  const auto sink = [&](const auvest::SlatStep<Filter>& step) {
    const auto slave = step.filter.slave();
    const Eigen::Vector2d e(slave.x(0) - step.slave.position[0],
                            slave.x(1) - step.slave.position[1]);
    const Eigen::Matrix2d P = slave.P;
    square += e.squaredNorm() / 200;
    nees += e.dot(P.inverse() * e) / (200 * kRuns);
  };
  REQUIRE(auvest::run_slat(filter, auvest::Sonar<double>(), auvest::SlatScenario(), world, random,
                           sink) == Status::kOk);
  rmse += std::sqrt(square) / kRuns;
}

TEST_CASE("SlatfShared: as good as EKF-SLAT in the paper's scenario, and as sure of it") {
  using Filter = Shared<Compass<double>, 1>;
  double rmse[2] = {0, 0};
  double nees[2] = {0, 0};
  for (int run = 0; run < kRuns; ++run) {
    Owner<Filter> owner(Compass<double>(), Master<double>(), 100, typename Filter::Params());
    auvest::EkfSlat<Compass<double>, Master<double>, 1> ekf((Compass<double>()), Master<double>());
    fly(owner.filter, run, rmse[0], nees[0]);
    fly(ekf, run, rmse[1], nees[1]);
  }
  CHECK(rmse[0] < 1.05 * rmse[1]);
  CHECK(nees[0] == close_to(nees[1], 0.1));
}

TEST_CASE("SlatfShared: an echo of nobody knows whom is refused, and so are bad parameters") {
  using Filter = Shared<Compass<double>, 1>;
  Owner<Filter> owner(Compass<double>(), Master<double>(), 10);
  Random random(1);
  typename Filter::SlaveBelief start;
  start.x.setZero();
  start.P.setZero();
  REQUIRE(owner.filter.reset(start, random) == Status::kOk);
  REQUIRE(owner.filter.add_master(master_belief<double>(0, 300, 1, 0, 3)) == Status::kOk);
  Echo<double> seen;
  seen.master = auvest::kUnknownMaster;
  seen.z << 302, -1.5;
  const auto before = owner.filter.master(0);
  CHECK(owner.filter.update(&seen, 1, auvest::Sonar<double>(), random) == Status::kBadParameter);
  CHECK(owner.filter.step(1, {1, 0}, nullptr, &seen, 1, auvest::Sonar<double>(), random) ==
        Status::kBadParameter);
  CHECK(owner.filter.master(0).x == before.x);
  for (const double bad : {-0.1, 1.1, std::nan("")}) {
    typename Filter::Params params;
    params.kept = bad;
    Owner<Filter> wrong(Compass<double>(), Master<double>(), 10, params);
    CHECK(wrong.filter.reset(start, random) == Status::kBadParameter);
  }
}

/// From a storage alone, a filter is that of all its parts.
template <class Filter>
void check_from_storage(Filter& short_form, Filter& whole) {
  for (Filter* filter : {&whole, &short_form}) {
    Random random(1);
    typename Filter::SlaveBelief start;
    start.x.setZero();
    start.P = Matrix<double, 2, 2>::Identity();
    REQUIRE(filter->reset(start, random) == Status::kOk);
    REQUIRE(filter->add_master(master_belief<double>(0, 300, 1, 0, 3)) == Status::kOk);
    REQUIRE(filter->predict(1, {1.5, 0.2}, random) == Status::kOk);
    Echo<double> seen;
    seen.master = 0;
    seen.z << 302, -1.5;
    REQUIRE(filter->update(&seen, 1, auvest::Sonar<double>(), random) == Status::kOk);
    CHECK(filter->slave().x == whole.slave().x);
    CHECK(filter->master(0).P == whole.master(0).P);
  }
  CHECK(whole.slave().x.norm() > 1);
}

template <class Filter>
void check_particles_from_storage() {
  static typename Filter::template Storage<16> first, second;
  Filter short_form(first);
  Filter whole(Compass<double>(), Master<double>(), typename Filter::Params(), second);
  check_from_storage(short_form, whole);
}

TEST_CASE("filters with echoes: from a storage alone, and from nothing") {
  using Motion = Compass<double>;
  check_particles_from_storage<auvest::Slatf1<Motion, Master<double>, 1>>();
  check_particles_from_storage<auvest::SlatfJoint<Motion, Master<double>, 1>>();
  check_particles_from_storage<Shared<Motion, 1>>();
  auvest::EkfSlat<Motion, Master<double>, 1> short_form, whole((Motion()), Master<double>());
  check_from_storage(short_form, whole);
}

}  // namespace
