// The joint Gaussian of slave and masters: whose echoes they are by the density of all together, by
// hand; draws where something is certain; the heading after an echo.
#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>
#include <utility>

#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/slat/joint_gaussian.hpp"

namespace {

using auvest::Belief;
using auvest::Echo;
using auvest::kUnknownMaster;
using auvest::Vector;
using Compass = auvest::CompassMotion<double>;
using Unicycle = auvest::UnicycleMotion<double>;
using Master = auvest::PiecewiseAcceleration<double>;

Belief<double, 6> master_at(double x, double y, double var_x, double var_y) {
  Belief<double, 6> master;
  master.x << x, y, 0, 0, 0, 0;
  master.P.setZero();
  master.P(0, 0) = var_x;
  master.P(1, 1) = var_y;
  for (int i = 2; i < 6; ++i) master.P(i, i) = 1e-4;
  return master;
}

auvest::Sonar<double> precise() {
  auvest::Sonar<double>::Params params;
  params.sigma_range_m = 1;
  params.sigma_bearing_rad = 2e-4;
  params.bearing = auvest::Bearing::kSlaveToMaster;
  return auvest::Sonar<double>(params);
}

/// A slave that may be 100 m off to the side, and three masters 10 km ahead, side by side.
struct SideBySide {
  using Model = auvest::JointGaussian<Compass, Master, 3>;
  static constexpr int kStates = Model::kStates;
  Model::Joint joint;
  Echo<double> echoes[2];
  const auvest::Sonar<double> sonar = precise();

  SideBySide() {
    Belief<double, 2> slave;
    slave.x.setZero();
    slave.P << 1, 0, 0, 1e4;
    Model::start(slave, joint);
    const double y[3] = {0, 60, 100};
    for (int n = 0; n < 3; ++n) Model::put(master_at(1e4, y[n], 1, 1), Model::first_of(n), joint);
    // They are heard as if they stood at 29 and 91 m: 62 m apart. With the slave 30 m off these are
    // the first two, 60 m apart. Each for itself would be the nearest, the first and the third.
    const double heard[2] = {29, 91};
    for (int s = 0; s < 2; ++s) {
      echoes[s].master = kUnknownMaster;
      echoes[s].z << std::hypot(1e4, heard[s]), std::atan2(heard[s], 1e4);
    }
  }

  /// -2 log of the density of both echoes, were they those of masters a and b, without constants.
  double misfit(int a, int b) const {
    const int who[2] = {a, b};
    Eigen::Matrix<double, 4, 1> innovation;
    Eigen::Matrix<double, 4, kStates> h = Eigen::Matrix<double, 4, kStates>::Zero();
    Eigen::Matrix<double, 4, 4> s = Eigen::Matrix<double, 4, 4>::Zero();
    for (int k = 0; k < 2; ++k) {
      const int at = Model::first_of(who[k]);
      auvest::Sonar<double>::View<double, 2> view;
      sonar.look(Vector<double, 2>(0, 0), joint.x(at), joint.x(at + 1), echoes[k].z, view);
      innovation.segment<2>(2 * k) = view.innovation;
      h.block<2, 2>(2 * k, 0) = view.by_slave;
      h.block<2, 2>(2 * k, at) = view.by_master;
      s.block<2, 2>(2 * k, 2 * k) = sonar.R<double>();
    }
    auvest::Matrix<double, kStates, kStates> p = joint.P;
    auvest::math::mirror_lower(p);
    s += h * p * h.transpose();
    return innovation.dot(s.inverse() * innovation) + std::log(s.determinant());
  }
};

TEST_CASE(
    "association: of all echoes together, by what the first says of the slave to the second") {
  SideBySide problem;
  using Model = SideBySide::Model;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      if (a == b || (a == 0 && b == 1)) continue;
      CAPTURE(a);
      CAPTURE(b);
      CHECK(problem.misfit(a, b) > problem.misfit(0, 1) + 10);
    }
  }
  int who[3];
  Model::identify(problem.joint, problem.echoes, 2, 3, problem.sonar, 0.0, who);
  CHECK(who[0] == 0);
  CHECK(who[1] == 1);
  // In the other order, and where one of them is known.
  std::swap(problem.echoes[0], problem.echoes[1]);
  Model::identify(problem.joint, problem.echoes, 2, 3, problem.sonar, 0.0, who);
  CHECK(who[0] == 1);
  CHECK(who[1] == 0);
  problem.echoes[1].master = 1;  // then the other, 62 m further on, is the third
  Model::identify(problem.joint, problem.echoes, 2, 3, problem.sonar, 0.0, who);
  CHECK(who[0] == 2);
  CHECK(who[1] == 1);
}

TEST_CASE("draw: where the range or the bearing is certain the other is still drawn") {
  using Model = auvest::JointGaussian<Compass, Master, 1>;
  const double kept = 0.36;
  for (int certain = 0; certain < 2; ++certain) {
    CAPTURE(certain);
    // A slave that is known; a master on the x axis that is uncertain across (the bearing) or along
    // (the range) by 2 m.
    Belief<double, 2> slave;
    slave.x << 3, 4;
    slave.P.setZero();
    Model::Joint joint;
    Model::start(slave, joint);
    Model::put(master_at(103, 4, certain == 0 ? 0 : 4, certain == 0 ? 4 : 0), Model::first_of(0),
               joint);
    const Model::Joint before = joint;
    const double e[2] = {1, 1};
    Model::draw(0, precise(), kept, e, joint);
    // A draw moves by sqrt(1 - kept) sigma e and keeps the share `kept` of the variance.
    const int drawn = 2 + (1 - certain);
    CHECK(joint.x(drawn) - before.x(drawn) == close_to(0.8 * 2, 1e-12));
    CHECK(joint.P(drawn, drawn) == close_to(kept * 4, 1e-12));
    const int other = 2 + certain;
    CHECK(joint.x(other) == before.x(other));
    CHECK(joint.P(other, other) == 0);
    CHECK(joint.x(0) == 3);
    CHECK(joint.x(1) == 4);
    CHECK(auvest::math::all_finite(joint));
  }
}

TEST_CASE("echo: a heading that it moves across the cut comes back on the other side") {
  using Model = auvest::JointGaussian<Unicycle, Master, 1>;
  const double pi = auvest::math::pi<double>();
  auvest::Sonar<double>::Params params;
  params.bearing = auvest::Bearing::kFromHeading;
  params.sigma_bearing_rad = 1e-3;
  const auvest::Sonar<double> sonar(params);
  for (const double sign : {1.0, -1.0}) {
    Belief<double, 3> slave;
    slave.x << 0, 0, sign * (pi - 0.01);
    slave.P.setZero();
    slave.P(2, 2) = 0.04;
    Model::Joint joint;
    Model::start(slave, joint);
    Model::put(master_at(-100, 0, 1e-6, 1e-6), Model::first_of(0), joint);
    // Dead ahead at a heading of pi; heard as if the slave had turned on to pi + 0.04.
    auvest::Score<double> score;
    REQUIRE(Model::correct(Vector<double, 2>(100, sign * -0.04), 0, sonar, 0.0, joint, score));
    const double gain = 0.04 / (0.04 + 1e-6 + 1e-10);
    CHECK(joint.x(2) == close_to(sign * (-pi - 0.01 + 0.05 * gain), 1e-9));
    CHECK(joint.P(2, 2) == close_to(0.04 * (1 - gain), 1e-6));
  }
}

}  // namespace

TEST_CASE(
    "echo: a slave that is known only across a line leaves a covariance in single precision") {
  using Model =
      auvest::JointGaussian<auvest::CompassMotion<float>, auvest::PiecewiseAcceleration<float>, 1>;
  const double scale[6] = {1, 1, 0.1, 0.1, 0.03, 0.03};
  for (unsigned seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    // 770 m along the line, 0.3 m across, which the master's states know of.
    const double way = 3 * normal(random);
    Eigen::Matrix<double, 8, 8> root = Eigen::Matrix<double, 8, 8>::Zero();
    root.col(0) << 770 * std::cos(way), 770 * std::sin(way), 0, 0, 0, 0, 0, 0;
    root.col(1) << -0.3 * std::sin(way), 0.3 * std::cos(way), 0, 0, 0, 0, 0, 0;
    for (int i = 0; i < 6; ++i) {
      root(2 + i, 1) = 0.3 * scale[i] * normal(random);
      for (int k = 0; k < i; ++k) root(2 + i, 2 + k) = scale[i] * normal(random);
      root(2 + i, 2 + i) = scale[i];
    }
    const Eigen::Matrix<double, 8, 8> p = root * root.transpose();
    Model::Joint joint;
    joint.x << 0, 0, 60, 30, 0, 0, 0, 0;
    joint.P = p.cast<float>();
    for (int k = 0; k < 10; ++k) {
      Vector<float, 2> z(float(67 + 30 * normal(random)), float(normal(random)));
      auvest::Score<float> score;
      REQUIRE(Model::correct(z, 0, auvest::Sonar<float>(), 13.8f, joint, score));
      Eigen::Matrix<double, 8, 8> after = joint.P.cast<double>();
      for (int i = 0; i < 8; ++i) REQUIRE(after(i, i) > 0);
      const Eigen::Matrix<double, 8, 1> sigma = after.diagonal().array().sqrt();
      after = (after.array() / (sigma * sigma.transpose()).array()).matrix();
      after.diagonal().array() += 16 * 1.2e-7;  // eight states, each rounded
      CHECK(Eigen::LLT<Eigen::Matrix<double, 8, 8>>(after).info() == Eigen::Success);
    }
  }
}
