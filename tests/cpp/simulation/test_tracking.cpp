#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <vector>

#include "auvest/filters/aukf.hpp"
#include "auvest/intervals/fixed_interval.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "simulation/tracking.hpp"

namespace {

using auvest::Matrix;
using auvest::SensorNoise;
using auvest::Status;
using auvest::Track;
using auvest::Vector;
using Process = auvest::EulerAcceleration<double>;

TEST_CASE("track: Euler is Eq. (4), straight and turn do not depend on the step") {
  Track euler;
  euler.advance(0.5);
  CHECK(euler.position[0] == close_to(0.2 + 0.05, 1e-12));
  CHECK(euler.velocity[1] == close_to(0.2 + 0.01, 1e-12));
  for (const auto kind : {Track::Kind::kStraight, Track::Kind::kTurn}) {
    Track once;
    once.kind = kind;
    once.turn_rate = 0.3;
    Track often = once;
    once.advance(2);
    for (int k = 0; k < 200; ++k) often.advance(0.01);
    for (int i = 0; i < 2; ++i) {
      CHECK(often.position[i] == close_to(once.position[i], 1e-12));
      CHECK(often.velocity[i] == close_to(once.velocity[i], 1e-12));
    }
  }
  // A full circle ends where it began; its diameter is 2 v / rate.
  Track circle;
  circle.kind = Track::Kind::kTurn;
  circle.turn_rate = 0.5;
  const double half_turn = auvest::math::pi<double>() / 0.5;
  circle.advance(half_turn);
  CHECK(std::hypot(circle.position[0] - 0.2, circle.position[1] - 2) ==
        close_to(2 * std::hypot(0.1, 0.2) / 0.5, 1e-12));
  circle.advance(half_turn);
  CHECK(circle.position[0] == close_to(0.2, 1e-12));
}

TEST_CASE("noise: mean and standard deviation of the three kinds") {
  for (const auto kind :
       {SensorNoise::Kind::kUniform, SensorNoise::Kind::kNormal, SensorNoise::Kind::kLognormal}) {
    SensorNoise noise;
    noise.kind = kind;
    noise.range_m = 2;
    noise.bearing_rad = 0.5;
    auvest::math::Random random(4);
    const int n = 200000;
    double sum[2] = {0, 0}, square[2] = {0, 0};
    for (int k = 0; k < n; ++k) {
      double v[2];
      bool missing = false;
      noise.draw(random, v[0], v[1], missing);
      CHECK_FALSE(missing);
      for (int i = 0; i < 2; ++i) {
        sum[i] += v[i];
        square[i] += v[i] * v[i];
      }
    }
    for (int i = 0; i < 2; ++i) {
      const double scale = i == 0 ? 2 : 0.5;
      const double mean = sum[i] / n;
      const double sigma = std::sqrt(square[i] / n - mean * mean);
      const double expected = scale * SensorNoise::standard_deviation(kind);
      // Four standard errors of the mean; 5 % for the lognormal's heavy-tailed variance, 1 % else.
      CHECK(std::fabs(mean - scale * SensorNoise::mean(kind)) < 4 * expected / std::sqrt(1.0 * n));
      CHECK(sigma == close_to(expected, kind == SensorNoise::Kind::kLognormal ? 0.05 : 0.01));
    }
  }
}

struct Loop {
  using Filter = auvest::Aukf<Process, auvest::FixedInterval<double>>;
  auvest::TrackingProbe probe;
  SensorNoise noise;
  double start_error_m = 0;
  std::vector<double> z, x, nis;
  Status status = Status::kOk;

  void run(std::uint64_t seed, std::uint32_t steps, double duration_s) {
    Filter filter{auvest::Ukf<Process>(Process())};
    Vector<double, 6> x0;
    x0 << 0.2 + start_error_m, 2, 0.1, 0.2, 0.01, 0.02;
    REQUIRE(filter.reset(x0, 0.01 * Matrix<double, 6, 6>::Identity()) == Status::kOk);
    const auvest::RangeBearing<double, 6> sonar;
    auvest::TrackingWorld world(Track(), noise, auvest::math::Random(seed, 3), 0, 0);
    Loop& self = *this;
    status = auvest::track(filter, sonar, world, steps, duration_s, probe,
                           [&self](const auvest::TrackingStep<Filter, 2>& step) {
                             self.z.push_back(step.world.z[0]);
                             self.x.push_back(step.filter.x()(0));
                             self.nis.push_back(step.correction.nis);
                           });
  }
};

TEST_CASE("loop: same seed, same run; another seed, another") {
  Loop a, b, c;
  a.run(1, 60, 1e9);
  b.run(1, 60, 1e9);
  c.run(2, 60, 1e9);
  REQUIRE(a.x.size() == 60);
  CHECK(a.x == b.x);
  CHECK(a.x != c.x);
}

TEST_CASE("loop: the duration ends it, probes stand at even times, dropouts are predictions") {
  Loop timed;
  timed.start_error_m = 0.01;
  timed.probe.period_s = 0.125;
  timed.probe.budget_m = 1e-12;
  timed.run(1, 1000, 10.2);
  CHECK(timed.x.size() == 20);     // 0.5 s each
  CHECK(timed.probe.count == 79);  // 1/8, 2/8, ... 79/8 s; at 10 s the loop has ended
  CHECK(timed.probe.above == timed.probe.count);

  Loop silent;
  silent.noise.dropout = 1;
  silent.run(1, 10, 1e9);
  REQUIRE(silent.x.size() == 10);
  for (std::size_t k = 0; k < silent.x.size(); ++k) {
    CHECK(std::isnan(silent.z[k]));
    CHECK(std::isnan(silent.nis[k]));
  }
  // Truth and prediction are both Eq. (4) from the same start: no error at all without updates.
  Track truth;
  for (int k = 0; k < 10; ++k) truth.advance(0.5);
  CHECK(silent.x.back() == close_to(truth.position[0], 1e-14));
}

TEST_CASE("loop: a failure is returned, the steps before it are kept") {
  Loop broken;
  broken.noise.range_m = 1e308;  // overflows the innovation sooner or later
  broken.run(1, 60, 1e9);
  CHECK(broken.status != Status::kOk);
  CHECK(broken.x.size() < 60);
}

}  // namespace
