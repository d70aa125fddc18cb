// Position and attitude in six degrees of freedom.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "auvest/control/pose_control.hpp"
#include "auvest/math/random.hpp"

namespace {

using auvest::Status;

template <class Scalar>
using Vector6 = auvest::Vector<Scalar, 6>;

constexpr double kPi = 3.14159265358979323846;

/// J' v by Eigen's rotations and the textbook's T.
Eigen::Matrix<double, 6, 1> to_body(const Eigen::Matrix<double, 6, 1>& eta,
                                    const Eigen::Matrix<double, 6, 1>& v) {
  const double f = eta(3), t = eta(4), y = eta(5);
  const Eigen::Matrix3d r = (Eigen::AngleAxisd(y, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(t, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(f, Eigen::Vector3d::UnitX()))
                                .toRotationMatrix();
  Eigen::Matrix3d rates;
  rates << 1, std::sin(f) * std::tan(t), std::cos(f) * std::tan(t),  //
      0, std::cos(f), -std::sin(f),                                  //
      0, std::sin(f) / std::cos(t), std::cos(f) / std::cos(t);
  Eigen::Matrix<double, 6, 1> body;
  body << r.transpose() * v.head<3>(), rates.transpose() * v.tail<3>();
  return body;
}

TEST_CASE_TEMPLATE("pose control: its law at random poses, with its integral", Scalar, float,
                   double) {
  auvest::math::Random random(3);
  auvest::PoseControl<Scalar> control;
  const double inertia[6] = {19.86, 20.62, 32.18, 0.449, 0.365, 0.592};
  Eigen::Matrix<double, 6, 1> integral = Eigen::Matrix<double, 6, 1>::Zero();
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::Matrix<double, 6, 1> eta, wanted, nu, g;
    for (int i = 0; i < 6; ++i) {
      eta(i) = random.normal<double>();
      wanted(i) = random.normal<double>();
      nu(i) = 0.3 * random.normal<double>();
      g(i) = random.normal<double>();
    }
    eta(4) = 1.3 * std::sin(eta(4));
    Vector6<Scalar> tau;
    REQUIRE(control.update(wanted.cast<Scalar>(), eta.cast<Scalar>(), nu.cast<Scalar>(),
                           g.cast<Scalar>(), false, Scalar(0.1), tau) == Status::kOk);
    Eigen::Matrix<double, 6, 1> pull, error, expected;
    for (int i = 0; i < 6; ++i) {
      const double w = i == 3 || i == 4 ? 3 : 1;
      error(i) = i < 3 ? eta(i) - wanted(i) : std::remainder(eta(i) - wanted(i), 2 * kPi);
      pull(i) = w * w * inertia[i] * (error(i) + w / 10 * integral(i));
      expected(i) = g(i) - 2 * w * inertia[i] * nu(i);
    }
    expected -= to_body(eta, pull);
    integral += 0.1 * error;
    const double bound = (sizeof(Scalar) == 4 ? 2e-5 : 1e-13) * (expected.norm() + pull.norm() * 4);
    CHECK((tau.template cast<double>() - expected).norm() < bound);
  }
}

TEST_CASE_TEMPLATE(
    "pose control: each axis alone is a double pole at w, and yaw takes the short way", Scalar,
    float, double) {
  // M x'' = tau = -w^2 M (x + w/10 int x) - 2 w M x': s^3 + 2 w s^2 + w^2 s + w^3 / 10.
  auvest::PoseControl<Scalar> control;
  Vector6<Scalar> wanted, eta, nu, g, tau;
  wanted.setZero();
  eta.setZero();
  nu.setZero();
  g.setZero();
  wanted(5) = Scalar(-3);
  double yaw = 3, rate = 0;               // 0.2832 rad to go, through pi
  double model[3] = {0, 6 - 2 * kPi, 0};  // int e, e, e'
  for (int k = 0; k < 5000; ++k) {
    eta(5) = Scalar(std::remainder(yaw, 2 * kPi));
    nu(5) = Scalar(rate);
    REQUIRE(control.update(wanted, eta, nu, g, false, Scalar(1e-3), tau) == Status::kOk);
    yaw += 1e-3 * rate;
    rate += 1e-3 * double(tau(5)) / 0.592;
    const double second = -2 * model[2] - model[1] - 0.1 * model[0];
    model[0] += 1e-3 * model[1];
    model[1] += 1e-3 * model[2];
    model[2] += 1e-3 * second;
  }
  CHECK(std::fabs(yaw - (2 * kPi - 3) - model[1]) < (sizeof(Scalar) == 4 ? 1e-5 : 1e-10));
}

TEST_CASE_TEMPLATE("pose control: a saturated demand does not wind up", Scalar, float, double) {
  // One axis, 20 kg, at most 15 N, held fast 60 s at 5 m of error; then 1 m to go.
  const auto settle = [](double held_for) {
    auvest::PoseControl<Scalar> control;
    Vector6<Scalar> wanted, eta, nu, g, tau;
    wanted.setZero();
    eta.setZero();
    nu.setZero();
    g.setZero();
    bool saturated = false;
    const auto force = [&](double x, double u) {
      eta(0) = Scalar(x);
      nu(0) = Scalar(u);
      REQUIRE(control.update(wanted, eta, nu, g, saturated, Scalar(0.1), tau) == Status::kOk);
      saturated = std::fabs(double(tau(0))) > 15;
      return std::fmax(-15, std::fmin(15, double(tau(0))));
    };
    for (int k = 0; k < held_for * 10; ++k) force(-5, 0);
    double x = -1, u = 0, last = 0;
    for (int k = 0; k < 1000; ++k) {
      const double f = force(x, u);
      for (int i = 0; i < 10; ++i) {
        x += 0.01 * u;
        u += 0.01 * f / 19.86;
      }
      if (std::fabs(x) > 0.1) last = 0.1 * k;
    }
    CHECK(std::fabs(x) < 0.01);
    return last;
  };
  CHECK(std::fabs(settle(60) - settle(0)) < 3.4);  // the rise time of the loop
}

TEST_CASE_TEMPLATE("pose control: what is refused changes nothing", Scalar, float, double) {
  auvest::PoseControl<Scalar> control;
  Vector6<Scalar> zero, bad, tau;
  zero.setZero();
  tau.setConstant(7);
  for (int i = 0; i < 6; ++i) {
    bad = zero;
    bad(i) = std::numeric_limits<Scalar>::quiet_NaN();
    CHECK(control.update(bad, zero, zero, zero, false, 1, tau) == Status::kNotFinite);
    CHECK(control.update(zero, bad, zero, zero, false, 1, tau) == Status::kNotFinite);
    CHECK(control.update(zero, zero, bad, zero, false, 1, tau) == Status::kNotFinite);
    CHECK(control.update(zero, zero, zero, bad, false, 1, tau) == Status::kNotFinite);
  }
  CHECK(control.update(zero, zero, zero, zero, false, -1, tau) == Status::kTimeBackwards);
  bad = zero;
  bad(4) = Scalar(81 * kPi / 180);  // T is singular at 90 degrees
  CHECK(control.update(zero, bad, zero, zero, false, 1, tau) == Status::kSteepPitch);
  for (int i = 0; i < 6; ++i) {
    CHECK(tau(i) == Scalar(7));
    CHECK(control.integral()(i) == Scalar(0));
  }
  bad(4) = Scalar(79 * kPi / 180);
  CHECK(control.update(zero, bad, zero, zero, false, 1, tau) == Status::kOk);
  typename auvest::PoseControl<Scalar>::Params p;
  p.inertia(2) = 0;
  auvest::PoseControl<Scalar> wrong(p);
  CHECK(wrong.check() == Status::kBadParameter);
  CHECK(wrong.update(zero, zero, zero, zero, false, 1, tau) == Status::kBadParameter);
}

}  // namespace
