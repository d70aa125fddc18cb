// A SLAT problem that a sum over a grid solves, and what tests of particle filters need with it.
#pragma once

#include <doctest/doctest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdint>
#include <vector>

#include "paper.hpp"

#include "auvest/math/angle.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/status.hpp"

namespace slat_test {

using auvest::Belief;
using auvest::Echo;
using auvest::Matrix;
using auvest::Status;
using auvest::Vector;
using auvest::math::Random;

template <class Scalar>
using Compass = auvest::CompassMotion<Scalar>;
template <class Scalar>
using Master = auvest::PiecewiseAcceleration<Scalar>;

/// A filter and its storage.
template <class Filter>
struct Owner {
  std::vector<typename Filter::Scalar> storage;
  Filter filter;

  Owner(const typename Filter::Motion& motion, const typename Filter::Master& master, int particles,
        const typename Filter::Params& params = paper<typename Filter::Params>())
      : storage(Filter::Set::storage_size(particles)),
        filter(motion, master, params, storage.data(), particles) {}
};

template <class Scalar>
Belief<Scalar, 6> master_belief(double x, double y, double vx, double vy, double sigma) {
  Belief<Scalar, 6> belief;
  belief.x << Scalar(x), Scalar(y), Scalar(vx), Scalar(vy), Scalar(0), Scalar(0);
  belief.P.setZero();
  for (int i = 0; i < 2; ++i) {
    belief.P(i, i) = Scalar(sigma * sigma);
    belief.P(i + 2, i + 2) = Scalar(0.05 * 0.05);
    belief.P(i + 4, i + 4) = Scalar(1e-8);
  }
  return belief;
}

inline Belief<double, 2> position(const Belief<double, 6>& master) {
  Belief<double, 2> belief;
  belief.x << master.x(0), master.x(1);
  belief.P << master.P(0, 0), master.P(1, 0), master.P(1, 0), master.P(1, 1);
  return belief;
}

/// Slave and master with Gaussian priors, a step and echoes at its end; far apart, so that the
/// sonar is close to linear over the priors and what the filters linearise costs less than the
/// Monte Carlo error.
struct FarApart {
  Compass<double> motion;
  auvest::Sonar<double> sonar;
  Belief<double, 2> start;
  Vector<double, 2> reading;
  double dt = 10;
  Belief<double, 6> master;
  std::vector<Echo<double>> echoes;

  FarApart() : motion(small_noise()), sonar(precise()), reading(5, 0.4) {
    start.x << 100, 50;
    start.P << 0.5, 0.1, 0.1, 0.3;
    master = master_belief<double>(1300, 900, 0, 0, 1);
    master.P(1, 0) = master.P(0, 1) = 0.3;
    hear(4, 0.002);  // about two standard deviations in range, one in bearing
  }

  /// One more echo, off by the given metres and radians from where it is expected.
  void hear(double range_m, double bearing_rad) {
    const auto slave = moved();
    const Vector<double, 2> d(slave.x(0) - 1300, slave.x(1) - 900);
    Echo<double> seen;
    seen.master = 0;
    seen.z << d.norm() + range_m, std::atan2(d(1), d(0)) + bearing_rad;
    echoes.push_back(seen);
  }

  static Compass<double>::Params small_noise() {
    Compass<double>::Params p;
    p.sigma_speed_m_s = 0.2;
    p.sigma_heading_rad = 0.01;
    return p;
  }
  static auvest::Sonar<double>::Params precise() {
    auvest::Sonar<double>::Params p;
    p.sigma_range_m = 1;
    p.sigma_bearing_rad = 0.0015;
    return p;
  }
  Belief<double, 2> moved() const {
    Belief<double, 2> slave = start;
    motion.propagate(motion.step(reading, dt), slave);
    return slave;
  }
  Belief<double, 6> master_ahead() const {
    Belief<double, 6> ahead = master;
    Master<double>().propagate(ahead, dt);
    return ahead;
  }

  template <class Filter>
  void run(Filter& filter, int particles, std::uint64_t seed) const {
    Random random(seed);
    REQUIRE(filter.reset(start, particles, random) == Status::kOk);
    REQUIRE(filter.add_master(master) == Status::kOk);
    // The master stands: its prior is given for the time of the measurement.
    REQUIRE(filter.predict(dt, reading, random) == Status::kOk);
    for (const Echo<double>& seen : echoes) {
      REQUIRE(filter.update(&seen, 1, sonar, random) == Status::kOk);
    }
  }
};

/// Moments of p(S, M | all echoes) over (x_S, y_S, x_M, y_M), and log p(echoes), by a sum over a
/// grid.
struct Grid {
  Vector<double, 4> mean;
  Matrix<double, 4, 4> covariance;
  double log_evidence;

  explicit Grid(const FarApart& problem) {
    const Belief<double, 2> slave = problem.moved();
    const Belief<double, 2> master = position(problem.master_ahead());
    const int n_slave = 49;
    const int n_master = 31;
    Matrix<double, 2, 2> ls, lm;
    Matrix<double, 1, 2> no_others;
    auvest::math::factor_leading<auvest::math::DropLostPivots>(slave.P, ls, no_others);
    auvest::math::factor_leading(master.P, lm, no_others);
    const double pi = auvest::math::pi<double>();
    const auto& p = problem.sonar.params;
    // Whitened coordinates from -5 to 5.
    const double hs = 10.0 / (n_slave - 1);
    const double hm = 10.0 / (n_master - 1);
    double total = 0;
    Vector<double, 4> sum = Vector<double, 4>::Zero();
    Matrix<double, 4, 4> square = Matrix<double, 4, 4>::Zero();
    Vector<double, 4> e;  // deviations from the prior means
    for (int i = 0; i < n_slave; ++i) {
      for (int j = 0; j < n_slave; ++j) {
        const double a = -5 + hs * i;
        const double b = -5 + hs * j;
        e(0) = ls(0, 0) * a;
        e(1) = ls(1, 0) * a + ls(1, 1) * b;
        for (int k = 0; k < n_master; ++k) {
          for (int l = 0; l < n_master; ++l) {
            const double c = -5 + hm * k;
            const double d = -5 + hm * l;
            const double prior = 0.5 * (a * a + b * b + c * c + d * d);
            if (prior > 14) continue;
            e(2) = lm(0, 0) * c;
            e(3) = lm(1, 0) * c + lm(1, 1) * d;
            const double dx = slave.x(0) + e(0) - master.x(0) - e(2);
            const double dy = slave.x(1) + e(1) - master.x(1) - e(3);
            const double range = std::sqrt(dx * dx + dy * dy);
            const double bearing = std::atan2(dy, dx);
            double misfit = 0;
            for (const Echo<double>& seen : problem.echoes) {
              const double r = (seen.z(0) - range) / p.sigma_range_m;
              const double t = auvest::math::wrap(seen.z(1) - bearing) / p.sigma_bearing_rad;
              misfit += r * r + t * t;
            }
            const double w = std::exp(-prior - 0.5 * misfit);
            total += w;
            sum += w * e;
            square += w * e * e.transpose();
          }
        }
      }
    }
    const Vector<double, 4> shift = sum / total;
    covariance = square / total - shift * shift.transpose();
    mean << slave.x(0), slave.x(1), master.x(0), master.x(1);
    mean += shift;
    const double cell = hs * hs * hm * hm / (4 * pi * pi);
    log_evidence =
        std::log(total * cell) - static_cast<double>(problem.echoes.size()) *
                                     std::log(2 * pi * p.sigma_range_m * p.sigma_bearing_rad);
  }
};

/// The moments of 1e5 particles and their likelihood, against the grid's.
template <class Filter>
void check_against_grid(const FarApart& problem, typename Filter::Params params) {
  const Grid grid(problem);
  const int particles = 100000;
  params = paper(params);
  params.resample_below = 0;
  Owner<Filter> owner(problem.motion, Master<double>(), particles, params);
  problem.run(owner.filter, particles, 61);
  const auto slave = owner.filter.slave();
  const auto master = position(owner.filter.master(0));
  const double error = 4.5 / std::sqrt(owner.filter.effective_size());
  // The echoes moved what is compared: by many of the errors allowed.
  CHECK(std::fabs(grid.mean(0) - problem.moved().x(0)) > 20 * error);
  for (int i = 0; i < 2; ++i) {
    CHECK(std::fabs(slave.x(i) - grid.mean(i)) < error * std::sqrt(grid.covariance(i, i)));
    CHECK(std::fabs(master.x(i) - grid.mean(i + 2)) <
          error * std::sqrt(grid.covariance(i + 2, i + 2)));
    for (int j = 0; j <= i; ++j) {
      const double s = std::sqrt(grid.covariance(i, i) * grid.covariance(j, j));
      const double m = std::sqrt(grid.covariance(i + 2, i + 2) * grid.covariance(j + 2, j + 2));
      CHECK(std::fabs(slave.P(i, j) - grid.covariance(i, j)) < 1.5 * error * s);
      CHECK(std::fabs(master.P(i, j) - grid.covariance(i + 2, j + 2)) < 1.5 * error * m);
    }
  }
  CHECK(std::fabs(owner.filter.log_likelihood() - grid.log_evidence) < 2 * error);
}

}  // namespace slat_test
