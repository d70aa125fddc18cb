// SlatfJoint against what it must equal: EKF-SLAT to the bit where nothing is drawn, the posterior
// of a grid, the Kalman filter where the sonar is linear; and what a draw must leave alone.
#include <doctest/doctest.h>

#include "brute_force.hpp"
#include "close.hpp"

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/slatf_joint.hpp"

namespace {

using namespace slat_test;

template <class Scalar>
using Unicycle = auvest::UnicycleMotion<Scalar>;
template <class Scalar, int Masters>
using Joint = auvest::SlatfJoint<Compass<Scalar>, Master<Scalar>, Masters>;

// ---- Nothing drawn
// -------------------------------------------------------------------------------

/// One particle that keeps all and EKF-SLAT, over steps with none, one or two echoes.
template <class Motion>
void check_equals_ekf(auvest::Bearing bearing) {
  using Scalar = typename Motion::Scalar;
  using Filter = auvest::SlatfJoint<Motion, Master<Scalar>, 2>;
  typename Filter::Params params;
  params.kept = Scalar(1);
  params.gate = Scalar(16);
  Owner<Filter> owner(Motion(), Master<Scalar>(), 1, params);
  typename auvest::EkfSlat<Motion, Master<Scalar>, 2>::Params gated;
  gated.gate = Scalar(16);
  auvest::EkfSlat<Motion, Master<Scalar>, 2> ekf(Motion(), Master<Scalar>(), gated);
  Random random(21);
  typename Filter::SlaveBelief start;
  start.x.setConstant(Scalar(0.5));
  start.P = Matrix<Scalar, Filter::kPose, Filter::kPose>::Identity() * Scalar(0.01);
  REQUIRE(owner.filter.reset(start, random) == Status::kOk);
  REQUIRE(ekf.reset(start, random) == Status::kOk);
  for (int n = 0; n < 2; ++n) {
    const auto prior = master_belief<Scalar>(100 - 200 * n, 150, 1, 0.5, 2);
    REQUIRE(owner.filter.add_master(prior) == Status::kOk);
    REQUIRE(ekf.add_master(prior) == Status::kOk);
  }
  typename auvest::Sonar<Scalar>::Params sonar;
  sonar.bearing = bearing;
  for (int k = 0; k < 60; ++k) {
    const Vector<Scalar, 2> u(Scalar(2), Scalar(0.01 * k));
    const Vector<Scalar, 2> changes[2] = {{Scalar(0.01), Scalar(0)}, {Scalar(0), Scalar(-0.02)}};
    Echo<Scalar> seen[2];
    for (int n = 0; n < 2; ++n) {
      Vector<Scalar, Filter::kPose> pose = ekf.slave().x;
      const auto master = ekf.master(1 - n).x;
      typename auvest::Sonar<Scalar>::template View<Scalar, Filter::kPose> view;
      Vector<Scalar, 2> zero(Scalar(0), Scalar(0));
      auvest::Sonar<Scalar>(sonar).look(pose, master(0), master(1), zero, view);
      seen[n].master = 1 - n;
      seen[n].z = -view.innovation;
      seen[n].z(0) += Scalar(k == 30 ? 500 : random.normal<double>());  // once beyond the gate
      seen[n].z(1) += Scalar(0.06 * random.normal<double>());
    }
    REQUIRE(owner.filter.step(Scalar(1), u, changes, seen, k % 3, auvest::Sonar<Scalar>(sonar),
                              random) == Status::kOk);
    REQUIRE(ekf.predict(Scalar(1), u, random, changes) == Status::kOk);
    REQUIRE(ekf.update(seen, k % 3, auvest::Sonar<Scalar>(sonar), random) == Status::kOk);
    const auto joint = owner.filter.particle(0);
    for (int i = 0; i < Filter::Model::kStates; ++i) {
      REQUIRE(joint.x(i) == ekf.belief().x(i));
      for (int j = 0; j <= i; ++j) REQUIRE(joint.P(i, j) == ekf.belief().P(i, j));
    }
    REQUIRE(owner.filter.slave().P == ekf.slave().P);
    REQUIRE(owner.filter.master(1).x == ekf.master(1).x);
    REQUIRE(owner.filter.master(1).P == ekf.master(1).P);
  }
  CHECK(static_cast<double>(owner.filter.log_likelihood()) ==
        close_to(static_cast<double>(ekf.log_likelihood()), sizeof(Scalar) == 4 ? 1e-5 : 1e-12));
}

TEST_CASE("SlatfJoint: one particle that keeps all is EKF-SLAT, bit for bit") {
  check_equals_ekf<Compass<float>>(auvest::Bearing::kMasterToSlave);
  check_equals_ekf<Compass<double>>(auvest::Bearing::kSlaveToMaster);
  check_equals_ekf<Unicycle<float>>(auvest::Bearing::kFromHeading);
  check_equals_ekf<Unicycle<double>>(auvest::Bearing::kFromHeading);
}

// ---- The draw
// ------------------------------------------------------------------------------------

/// Both triangles of P.
template <int N>
Eigen::Matrix<double, N, N> full(Matrix<double, N, N> P) {
  auvest::math::mirror_lower(P);
  return P;
}

/// A draw has the mean and the covariance of the deviates e as input; four points with the moments
/// of N(0, I) therefore give the moments of the mixture exactly, without sampling.
template <class Motion>
void check_draw(auvest::Bearing bearing, double kept) {
  using Model = auvest::JointGaussian<Motion, Master<double>, 2>;
  constexpr int n = Model::kStates;
  Random random(31);
  typename Model::Joint before;
  Eigen::Matrix<double, n, n> root;
  for (int i = 0; i < n; ++i) {
    before.x(i) = random.normal<double>();
    for (int j = 0; j < n; ++j) root(i, j) = 0.3 * random.normal<double>();
  }
  before.x(Model::first_of(1)) += 40;
  before.P = root * root.transpose();
  auvest::Sonar<double>::Params params;
  params.bearing = bearing;
  const auvest::Sonar<double> sonar(params);

  Eigen::Matrix<double, n, n> within = Eigen::Matrix<double, n, n>::Zero();
  Eigen::Matrix<double, n, n> between = Eigen::Matrix<double, n, n>::Zero();
  Eigen::Matrix<double, n, 1> mean = Eigen::Matrix<double, n, 1>::Zero();
  for (int k = 0; k < 4; ++k) {
    double e[2] = {0, 0};
    e[k / 2] = (k % 2 == 0 ? 1 : -1) * std::sqrt(2.0);
    auto after = before;
    Model::draw(1, sonar, kept, e, after);
    const Eigen::Matrix<double, n, 1> shift = after.x - before.x;
    mean += shift / 4;
    between += shift * shift.transpose() / 4;
    within = full(after.P);  // the same for all e
  }
  const double scale = before.P.norm();
  CHECK(mean.norm() < 1e-12 * scale);
  CHECK((within + between - before.P).norm() < 1e-12 * scale);
  // The shares, of range and bearing.
  typename auvest::Sonar<double>::template View<double, Model::kPose> view;
  const Vector<double, Model::kPose> pose = before.x.template head<Model::kPose>();
  const int at = Model::first_of(1);
  sonar.look(pose, before.x(at), before.x(at + 1), Vector<double, 2>(0, 0), view);
  Eigen::Matrix<double, 2, n> h = Eigen::Matrix<double, 2, n>::Zero();
  h.template leftCols<Model::kPose>() = view.by_slave;
  h.template middleCols<2>(at) = view.by_master;
  const Eigen::Matrix2d s = h * before.P * h.transpose();
  CHECK((h * within * h.transpose() - kept * s).norm() < 1e-12 * s.norm());
  CHECK((h * between * h.transpose() - (1 - kept) * s).norm() < 1e-12 * s.norm());
  // What the sonar sees decides what is drawn: between has its rank.
  Eigen::FullPivLU<Eigen::Matrix<double, n, n>> lu(between);
  lu.setThreshold(1e-9);
  CHECK(lu.rank() == 2);
}

TEST_CASE("SlatfJoint: a draw keeps the mixture's moments and the stated share") {
  for (const double kept : {0.0, 0.3, 0.9}) {
    check_draw<Compass<double>>(auvest::Bearing::kMasterToSlave, kept);
    check_draw<Unicycle<double>>(auvest::Bearing::kFromHeading, kept);
  }
}

TEST_CASE("SlatfJoint: a drift of all together is not drawn, nor is what is certain") {
  using Model = auvest::JointGaussian<Compass<float>, Master<float>, 1>;
  Model::Joint joint;
  Belief<float, 2> pose;
  pose.x << 10, 20;
  pose.P << 400, 0, 0, 400;
  Model::start(pose, joint);
  auto master = master_belief<float>(100, 300, 1, 0, 1);
  master.P(0, 0) = master.P(1, 1) = 400;
  Model::put(master, Model::first_of(0), joint);
  joint.P(2, 0) = joint.P(3, 1) = 400;  // master - slave is known
  const auto before = joint;
  const float e[2] = {1, -1};
  Model::draw(0, auvest::Sonar<float>(), 0.0f, e, joint);
  for (int i = 0; i < Model::kStates; ++i) {
    CHECK(std::fabs(joint.x(i) - before.x(i)) < 0.02f);  // 20 m * sqrt(8 epsilon)
    CHECK(joint.P(i, i) == close_to(static_cast<double>(before.P(i, i)), 1e-5));
  }
}

// ---- Posteriors
// ----------------------------------------------------------------------------------

TEST_CASE("SlatfJoint: 1e5 particles are the posterior of a grid, whatever they keep" *
          doctest::test_suite("statistics")) {
  for (const double kept : {0.0, 0.5}) {
    FarApart problem;
    auto params = paper<Joint<double, 1>::Params>();
    params.kept = kept;
    check_against_grid<Joint<double, 1>>(problem, params);
    problem.hear(1, -0.001);
    check_against_grid<Joint<double, 1>>(problem, params);
  }
}

TEST_CASE("SlatfJoint: where the sonar is linear the mixture is the Kalman filter, step by step" *
          doctest::test_suite("statistics")) {
  // Masters 2 km away: the sonar is linear to 1e-3 of what it corrects. Draws, weights and
  // resampling over 12 pings of two masters must leave the moments of one Gaussian.
  using Filter = Joint<double, 2>;
  Compass<double>::Params motion;
  motion.sigma_speed_m_s = 0.5;
  motion.sigma_heading_rad = 0.1;
  auvest::Sonar<double>::Params sonar_params;
  sonar_params.sigma_range_m = 2;
  sonar_params.sigma_bearing_rad = 0.001;
  const auvest::Sonar<double> sonar(sonar_params);
  for (const double kept : {0.0, 0.5}) {
    auto params = paper<Filter::Params>();
    params.kept = kept;
    params.resample_below = 0.9;
    const int particles = 10000;
    Owner<Filter> owner((Compass<double>(motion)), Master<double>(), particles, params);
    auvest::EkfSlat<Compass<double>, Master<double>, 2> ekf((Compass<double>(motion)),
                                                            Master<double>());
    Random random(41);
    Random noise(42);
    Belief<double, 2> start;
    start.x << 0, 0;
    start.P << 4, 1, 1, 4;
    REQUIRE(owner.filter.reset(start, random) == Status::kOk);
    REQUIRE(ekf.reset(start, random) == Status::kOk);
    for (int n = 0; n < 2; ++n) {
      const auto prior = master_belief<double>(1500 - 3200 * n, 1400, 1, 0.5, 3);
      REQUIRE(owner.filter.add_master(prior) == Status::kOk);
      REQUIRE(ekf.add_master(prior) == Status::kOk);
    }
    for (int k = 0; k < 12; ++k) {
      const Vector<double, 2> u(3, 0.2 * k);
      REQUIRE(owner.filter.predict(2, u, random) == Status::kOk);
      REQUIRE(ekf.predict(2, u, random) == Status::kOk);
      Echo<double> seen[2];
      for (int n = 0; n < 2; ++n) {
        const Vector<double, 2> d = ekf.slave().x - ekf.master(n).x.head<2>();
        seen[n].master = n;
        seen[n].z << d.norm() + 3 * noise.normal<double>(),
            std::atan2(d(1), d(0)) + 0.002 * noise.normal<double>();
      }
      const int count = 1 + k % 2;
      REQUIRE(owner.filter.update(seen, count, sonar, random) == Status::kOk);
      REQUIRE(ekf.update(seen, count, sonar, random) == Status::kOk);
    }
    CHECK(owner.filter.resamplings() >= 3);
    // Resampling and reweighting cost independence: 4 standard errors of a quarter of the
    // particles.
    const double error = 4 / std::sqrt(0.25 * particles);
    for (int n = 0; n < 2; ++n) {
      const auto mixture = owner.filter.master(n);
      const auto gaussian = ekf.master(n);
      for (int i = 0; i < 6; ++i) {
        CHECK(std::fabs(mixture.x(i) - gaussian.x(i)) < error * std::sqrt(gaussian.P(i, i)));
        CHECK(mixture.P(i, i) == close_to(gaussian.P(i, i), 1.5 * error));
      }
    }
    const auto mixture = owner.filter.slave();
    const auto gaussian = ekf.slave();
    for (int i = 0; i < 2; ++i) {
      CHECK(std::fabs(mixture.x(i) - gaussian.x(i)) < error * std::sqrt(gaussian.P(i, i)));
      CHECK(mixture.P(i, i) == close_to(gaussian.P(i, i), 1.5 * error));
    }
    CHECK(std::fabs(owner.filter.log_likelihood() - ekf.log_likelihood()) < 20 * error);
  }
}

// ---- Bookkeeping
// ---------------------------------------------------------------------------------

/// A filter with two masters in float, and echoes of both.
struct Started {
  Owner<Joint<float, 2>> owner;
  Random random;
  Echo<float> seen[2];
  Vector<float, 2> u;

  explicit Started(const Joint<float, 2>::Params& params = paper<Joint<float, 2>::Params>())
      : owner(Compass<float>(), Master<float>(), 50, params), random(51), u(5, 0.1f) {
    Belief<float, 2> start;
    start.x << 1, 2;
    start.P << 1, 0.5f, 0.5f, 1;
    REQUIRE(owner.filter.reset(start, random) == Status::kOk);
    REQUIRE(owner.filter.add_master(master_belief<float>(100, 200, 0, 0, 1)) == Status::kOk);
    REQUIRE(owner.filter.add_master(master_belief<float>(-150, 160, 0, 0, 1)) == Status::kOk);
    seen[0].master = 0;
    seen[0].z << 221, -2.04f;
    seen[1].master = 1;
    seen[1].z << 222, -0.82f;
  }
};

TEST_CASE("SlatfJoint: refused calls leave all bits") {
  const float nan = std::nanf("");
  Started started;
  auto& filter = started.owner.filter;
  Random& random = started.random;
  auto& seen = started.seen;
  const auvest::Sonar<float> sonar;
  REQUIRE(filter.predict(1, started.u, random) == Status::kOk);
  REQUIRE(filter.update(seen, 2, sonar, random) == Status::kOk);
  const std::vector<float> before = started.owner.storage;
  Belief<float, 2> start;
  start.x << 1, 2;
  start.P << 1, 0, 0, 1;
  CHECK(filter.reset(start, 0, random) == Status::kBadParameter);
  CHECK(filter.reset(start, 51, random) == Status::kBadParameter);
  start.x(1) = nan;
  CHECK(filter.reset(start, random) == Status::kNotFinite);
  start.x(1) = 0;
  start.P(1, 1) = -1;
  CHECK(filter.reset(start, random) == Status::kNotPositiveDefinite);
  CHECK(filter.add_master(master_belief<float>(0, 9, 0, 0, 1)) == Status::kBadParameter);
  const Vector<float, 2> changes[2] = {Vector<float, 2>(0, 0), Vector<float, 2>(0, nan)};
  CHECK(filter.predict(nan, started.u, random) == Status::kNotFinite);
  CHECK(filter.predict(-1, started.u, random) == Status::kTimeBackwards);
  CHECK(filter.predict(1, started.u, random, changes) == Status::kNotFinite);
  CHECK(filter.step(-1, started.u, nullptr, seen, 1, sonar, random) == Status::kTimeBackwards);
  CHECK(filter.update(seen, 3, sonar, random) == Status::kBadParameter);
  CHECK(filter.update(seen, 0, sonar, random) == Status::kOk);  // nothing heard: nothing changes
  seen[1].master = 0;
  CHECK(filter.update(seen, 2, sonar, random) == Status::kBadParameter);
  seen[1].master = 1;
  seen[1].z(0) = INFINITY;
  CHECK(filter.step(1, started.u, nullptr, seen, 2, sonar, random) == Status::kNotFinite);
  CHECK(started.owner.storage == before);

  Owner<Joint<float, 2>> fresh((Compass<float>()), Master<float>(), 5);
  CHECK(fresh.filter.predict(1, started.u, random) == Status::kNotInitialised);
  CHECK(fresh.filter.update(seen, 1, sonar, random) == Status::kNotInitialised);
  CHECK(fresh.filter.add_master(master_belief<float>(0, 9, 0, 0, 1)) == Status::kNotInitialised);
  start.P(1, 1) = 1;
  for (const float share : {-0.1f, 1.1f, nan}) {
    Joint<float, 2>::Params params;
    params.kept = share;
    Owner<Joint<float, 2>> wrong((Compass<float>()), Master<float>(), 5, params);
    CHECK(wrong.filter.reset(start, random) == Status::kBadParameter);
    params = Joint<float, 2>::Params();
    params.resample_below = share;
    Owner<Joint<float, 2>> other((Compass<float>()), Master<float>(), 5, params);
    CHECK(other.filter.reset(start, random) == Status::kBadParameter);
  }
  for (const float gate : {-0.1f, INFINITY, nan}) {
    Joint<float, 2>::Params params;
    params.gate = gate;
    Owner<Joint<float, 2>> wrong((Compass<float>()), Master<float>(), 5, params);
    CHECK(wrong.filter.reset(start, random) == Status::kBadParameter);
  }
}

TEST_CASE("SlatfJoint: step() has the bits of predict() and update()") {
  Started a;
  Started b;
  const auvest::Sonar<float> sonar;
  for (int k = 0; k < 30; ++k) {
    const int count = k % 3;
    REQUIRE(a.owner.filter.predict(1, a.u, a.random) == Status::kOk);
    REQUIRE(a.owner.filter.update(a.seen, count, sonar, a.random) == Status::kOk);
    REQUIRE(b.owner.filter.step(1, b.u, nullptr, b.seen, count, sonar, b.random) == Status::kOk);
  }
  CHECK(a.owner.filter.resamplings() > 0);
  CHECK(a.owner.storage == b.owner.storage);
  CHECK(a.owner.filter.log_likelihood() == b.owner.filter.log_likelihood());
}

TEST_CASE("SlatfJoint: unknown echoes of masters far apart do what known ones do, to the bit") {
  Started known;
  Started unknown;
  const auvest::Sonar<float> sonar;
  for (Echo<float>& echo : unknown.seen) echo.master = auvest::kUnknownMaster;
  for (int k = 0; k < 10; ++k) {
    for (Started* each : {&known, &unknown}) {
      REQUIRE(each->owner.filter.predict(0.1f, each->u, each->random) == Status::kOk);
      REQUIRE(each->owner.filter.update(each->seen, 2, sonar, each->random) == Status::kOk);
    }
  }
  CHECK(known.owner.storage == unknown.owner.storage);
}

TEST_CASE("SlatfJoint: an echo beyond every gate moves no state") {
  Joint<float, 2>::Params params;
  params.gate = 16;
  params.resample_below = 0;
  Started started(params);
  auto& filter = started.owner.filter;
  const auvest::Sonar<float> sonar;
  REQUIRE(filter.update(started.seen, 2, sonar, started.random) == Status::kOk);
  std::vector<Joint<float, 2>::Joint> before;
  for (int i = 0; i < filter.particles(); ++i) before.push_back(filter.particle(i));
  started.seen[0].z(0) = 900;
  REQUIRE(filter.update(started.seen, 1, sonar, started.random) == Status::kOk);
  for (int i = 0; i < filter.particles(); ++i) {
    const auto after = filter.particle(i);
    const auto& old = before[static_cast<std::size_t>(i)];
    CHECK(after.x == old.x);
    for (int k = 0; k < Joint<float, 2>::Model::kStates; ++k) {  // formed anew from its root
      CHECK(after.P(k, k) == close_to(static_cast<double>(old.P(k, k)), 1e-6));
    }
  }
}

}  // namespace
