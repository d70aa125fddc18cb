// Dead reckoning: Jacobians against differences, covariances against their definition, and the bias
// of a noisy heading.
#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/LU>
#include <cmath>

#include "auvest/math/random.hpp"
#include "auvest/models/slave_motion.hpp"

namespace {

using auvest::Belief;
using auvest::Matrix;
using auvest::Vector;
using auvest::math::Random;
using Compass = auvest::CompassMotion<double>;
using Unicycle = auvest::UnicycleMotion<double>;

/// f1(x, u): the mean's motion.
template <class Motion>
typename Motion::State moved(const Motion& motion, const typename Motion::State& x,
                             const typename Motion::Control& u, double dt) {
  Belief<double, Motion::kStates> belief;
  belief.x = x;
  belief.P.setZero();
  motion.propagate(motion.step(u, dt), belief);
  return belief.x;
}

template <class Motion>
void check_motion(const Motion& motion, const Vector<double, 2>& sigma) {
  constexpr int n = Motion::kStates;
  Random random(31);
  const double dt = 0.7;
  const double h = 1e-6;
  for (int trial = 0; trial < 20; ++trial) {
    typename Motion::State x;
    typename Motion::Control u;
    for (int i = 0; i < n; ++i) x(i) = random.normal<double>();
    for (int i = 0; i < 2; ++i) u(i) = random.normal<double>();
    const auto step = motion.step(u, dt);

    const auto phi = motion.transition(step, x);
    for (int j = 0; j < n; ++j) {
      auto up = x;
      auto down = x;
      up(j) += h;
      down(j) -= h;
      const auto slope = ((moved(motion, up, u, dt) - moved(motion, down, u, dt)) / (2 * h)).eval();
      for (int i = 0; i < n; ++i) CHECK(std::fabs(phi(i, j) - slope(i)) < 1e-8);
    }
    Matrix<double, n, n> gqg = Matrix<double, n, n>::Zero();
    for (int j = 0; j < 2; ++j) {
      auto up = u;
      auto down = u;
      up(j) += h;
      down(j) -= h;
      const Vector<double, n> column =
          sigma(j) * (moved(motion, x, up, dt) - moved(motion, x, down, dt)) / (2 * h);
      gqg += column * column.transpose();
    }
    const auto q = motion.noise(step, x);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) CHECK(std::fabs(q(i, j) - gqg(i, j)) < 1e-8);
    }

    Matrix<double, n, n> a;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) a(i, j) = random.normal<double>();
    }
    Belief<double, n> belief;
    belief.x = x;
    belief.P = a * a.transpose();
    const Matrix<double, n, n> expected = phi * belief.P * phi.transpose() + q;
    motion.propagate(step, belief);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) CHECK(belief.P(i, j) == doctest::Approx(expected(i, j)));
    }
  }
}

TEST_CASE("slave motion: Phi and G Q G' are those of f1") {
  Compass::Params compass;
  check_motion(Compass(compass), Vector<double, 2>(2, 0.3));
  compass.compensate_bias = false;
  check_motion(Compass(compass), Vector<double, 2>(2, 0.3));
  Unicycle::Params unicycle;
  check_motion(Unicycle(unicycle),
               Vector<double, 2>(unicycle.sigma_speed_m_s, unicycle.sigma_yaw_rate_rad_s));
}

template <class Motion>
void check_samples(const Motion& motion, const typename Motion::State& x0,
                   const typename Motion::Control& u, double nonlinear) {
  constexpr int n = Motion::kStates;
  Random random(32);
  const auto step = motion.step(u, 0.5);
  const auto mean = moved(motion, x0, u, 0.5);
  const auto covariance = motion.noise(step, x0);
  const int trials = 100000;
  Vector<double, n> sum = Vector<double, n>::Zero();
  Matrix<double, n, n> square = Matrix<double, n, n>::Zero();
  for (int t = 0; t < trials; ++t) {
    typename Motion::State x = x0;
    double a, b;
    random.normal_pair(a, b);
    motion.sample(step, a, b, x);
    const Vector<double, n> e = x - mean;
    sum += e;
    square += e * e.transpose();
  }
  for (int i = 0; i < n; ++i) {
    const double sigma = std::sqrt(covariance(i, i));
    CHECK(std::fabs(sum(i) / trials) < 4 * sigma / std::sqrt(1.0 * trials) + nonlinear);
    for (int j = 0; j <= i; ++j) {
      const double size = sigma * std::sqrt(covariance(j, j));
      CHECK(std::fabs(square(i, j) / trials - covariance(i, j)) < 0.02 * size + nonlinear);
    }
  }
}

TEST_CASE("slave motion: samples have the mean and the covariance that propagate gives") {
  Compass::Params compass;
  compass.sigma_heading_rad = 0.01;
  check_samples(Compass(compass), Vector<double, 2>(3, 4), Vector<double, 2>(5, 0.7), 1e-3);
  const Vector<double, 3> pose(3, 4, 0.7);
  check_samples(Unicycle(Unicycle::Params()), pose, Vector<double, 2>(5, 0.1), 0);
}

TEST_CASE("compass motion: a noisy heading shortens displacements, compensation restores them") {
  // Truth: 1 s at 5 m/s along the x axis; readings with the paper's noise, many times.
  for (const bool compensate : {false, true}) {
    Compass::Params params;
    params.compensate_bias = compensate;
    const Compass motion(params);
    Random random(33);
    const int trials = 200000;
    double by_mean = 0, by_sample = 0;
    for (int t = 0; t < trials; ++t) {
      double a, b, c, d;
      random.normal_pair(a, b);
      random.normal_pair(c, d);
      const Vector<double, 2> reading(5 + 2 * a, 0.3 * b);
      const auto step = motion.step(reading, 1);
      Vector<double, 2> sampled = Vector<double, 2>::Zero();
      motion.sample(step, c, d, sampled);
      by_sample += sampled(0) / trials;
      by_mean += moved(motion, Vector<double, 2>::Zero(), reading, 1)(0) / trials;
    }
    const double loss = std::exp(-0.045);  // exp(-sphi^2 / 2)
    CHECK(by_mean == close_to(compensate ? 5 : 5 * loss, 0.004));
    CHECK(by_sample == close_to(compensate ? 5 : 5 * loss * loss, 0.006));
  }
}

TEST_CASE("unicycle motion: one step's noise has rank 2, the heading stays wrapped") {
  const Unicycle motion;
  const auto q =
      motion.noise(motion.step(Vector<double, 2>(1, 0.2), 1), Vector<double, 3>(0, 0, 1));
  CHECK(std::fabs(Eigen::Matrix3d(q).determinant()) < 1e-18);
  const auto x = moved(motion, Vector<double, 3>(0, 0, 3.1), Vector<double, 2>(0, 0.2), 1);
  CHECK(x(2) == close_to(3.3 - auvest::math::two_pi<double>(), 1e-12));
}

TEST_CASE("unicycle motion: the headings of samples stay wrapped through many turns") {
  const Unicycle motion;
  const double pi = auvest::math::pi<double>();
  Random random(34);
  const auto step = motion.step(Vector<double, 2>(1, 0.4), 0.5);
  for (int particle = 0; particle < 5; ++particle) {
    Vector<double, 3> pose(0, 0, 0.5 * particle);
    double turned = pose(2);  // the same without wrapping
    for (int k = 0; k < 1000; ++k) {
      double a, b;
      random.normal_pair(a, b);
      motion.sample(step, a, b, pose);
      turned += 0.5 * (0.4 + motion.params.sigma_yaw_rate_rad_s * b);
      CHECK(pose(2) > -pi);
      CHECK(pose(2) <= pi);
      CHECK(std::fabs(auvest::math::wrap(pose(2) - turned)) < 1e-11);
    }
    CHECK(turned > 30 * 2 * pi);
  }
}

TEST_CASE("slave motion: bad parameters") {
  using auvest::Status;
  const auto compass = [](double speed, double heading) {
    Compass::Params params;
    params.sigma_speed_m_s = speed;
    params.sigma_heading_rad = heading;
    return Compass(params).check();
  };
  CHECK(Compass().check() == Status::kOk);
  CHECK(compass(0, 0) == Status::kOk);
  CHECK(compass(1, 3) == Status::kOk);
  CHECK(compass(1, 3.001) == Status::kBadParameter);
  const auto unicycle = [](double speed, double yaw_rate) {
    Unicycle::Params params;
    params.sigma_speed_m_s = speed;
    params.sigma_yaw_rate_rad_s = yaw_rate;
    return Unicycle(params).check();
  };
  CHECK(Unicycle().check() == Status::kOk);
  CHECK(unicycle(0, 0) == Status::kOk);
  for (const double bad : {-1.0, std::nan(""), HUGE_VAL}) {
    CHECK(compass(bad, 0.3) == Status::kBadParameter);
    CHECK(compass(1, bad) == Status::kBadParameter);
    CHECK(unicycle(bad, 0.01) == Status::kBadParameter);
    CHECK(unicycle(1, bad) == Status::kBadParameter);
  }
}

}  // namespace
