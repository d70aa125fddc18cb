// The closed loop of the AUKF paper, section 3: a base station tracks an AUV by range and bearing,
// and the filter's own interval decides when the next sample is taken.
//
// Host side: the truth is kept in double, whatever the filter's scalar.
#pragma once

#include <cmath>
#include <cstdint>

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

/// The true (and desired) track. It starts at `position` with `velocity` and moves on with constant
/// acceleration along x and y, or turns at a constant rate.
struct Track {
  enum class Kind : std::uint8_t {
    kEuler,     ///< [AUKF 4] with each sampling interval as its step: the paper's own simulation
    kStraight,  ///< constant acceleration, exact for any interval
    kTurn       ///< constant speed and turn rate
  };

  Kind kind = Kind::kEuler;
  double position[2] = {0.2, 2};          ///< [m], Table 1
  double velocity[2] = {0.1, 0.2};        ///< [m/s], norm 0.224 of Table 1
  double acceleration[2] = {0.01, 0.02};  ///< [m/s^2], norm 0.0224 of Table 1
  double turn_rate = 0;                   ///< [rad/s], kTurn only
  /// The vehicle circles around the desired track by this much, as a real one that is steered onto
  /// it; 0: the desired track is the true one, as in the paper's simulation.
  double wander_m = 0;
  double wander_period_s = 60;

  /// The desired position [m] at a time.
  void desired(double time_s, double (&reference)[2]) const {
    double s = 0;
    double c = 0;
    math::sincos(math::two_pi<double>() * (time_s / wander_period_s), s, c);
    reference[0] = position[0] + wander_m * (c - 1);
    reference[1] = position[1] + wander_m * s;
  }

  void advance(double dt) {
    if (kind == Kind::kTurn) {
      turn(dt);
      return;
    }
    for (int i = 0; i < 2; ++i) {
      position[i] += dt * velocity[i];  // [AUKF 4]
      if (kind == Kind::kStraight) position[i] += 0.5 * dt * dt * acceleration[i];
      velocity[i] += dt * acceleration[i];
    }
  }

 private:
  void turn(double dt) {
    const double angle = turn_rate * dt;
    const double s = math::sin(angle);
    const double c = math::cos(angle);
    const double along = turn_rate != 0 ? s / turn_rate : dt;
    const double across = turn_rate != 0 ? (1 - c) / turn_rate : 0;
    position[0] += along * velocity[0] - across * velocity[1];
    position[1] += along * velocity[1] + across * velocity[0];
    const double vx = c * velocity[0] - s * velocity[1];
    velocity[1] = c * velocity[1] + s * velocity[0];
    velocity[0] = vx;
  }
};

/// The paper's three noises, each scaled: standard uniform, standard normal and exp(standard
/// normal). Uniform and lognormal have a mean that is not zero.
struct SensorNoise {
  enum class Kind : std::uint8_t { kUniform, kNormal, kLognormal };

  Kind kind = Kind::kNormal;
  double range_m = 0.05;      ///< scale of the range noise
  double bearing_rad = 0.01;  ///< scale of the bearing noise
  bool centred = false;       ///< subtract the mean
  double dropout = 0;         ///< probability that a measurement is missing

  static double mean(Kind kind) {
    if (kind == Kind::kUniform) return 0.5;
    return kind == Kind::kLognormal ? math::exp(0.5) : 0.0;
  }

  static double standard_deviation(Kind kind) {
    if (kind == Kind::kUniform) return math::sqrt(1.0 / 12.0);
    return kind == Kind::kLognormal ? math::sqrt((math::exp(1.0) - 1.0) * math::exp(1.0)) : 1.0;
  }

  /// One range deviate, one bearing deviate and one dropout deviate, in this order.
  void draw(math::Random& random, double& range, double& bearing, bool& missing) const {
    double first = 0;
    double second = 0;
    if (kind == Kind::kUniform) {
      first = random.uniform<double>();
      second = random.uniform<double>();
    } else {
      random.normal_pair(first, second);
      if (kind == Kind::kLognormal) {
        first = math::exp(first);
        second = math::exp(second);
      }
    }
    const double shift = centred ? mean(kind) : 0.0;
    range = range_m * (first - shift);
    bearing = bearing_rad * (second - shift);
    missing = random.uniform<double>() < dropout;
  }
};

/// What a run of the loop measures, sample by sample, whatever filter hears it.
struct TrackingWorld {
  Track truth;
  SensorNoise noise;
  math::Random random;
  double station[2];  ///< [m]
  double time_s;
  double z[2];  ///< range [m] and bearing [rad]; NaN if missing

  TrackingWorld(const Track& truth_then, const SensorNoise& noise_there, const math::Random& stream,
                double station_x_m, double station_y_m)
      : truth(truth_then),
        noise(noise_there),
        random(stream),
        station{station_x_m, station_y_m},
        time_s(0),
        z{0, 0} {}

  /// Whether the vehicle was measured this much later.
  bool sample(double dt) {
    time_s += dt;
    truth.advance(dt);
    double range_noise = 0;
    double bearing_noise = 0;
    bool missing = false;
    noise.draw(random, range_noise, bearing_noise, missing);
    const double dx = truth.position[0] - station[0];
    const double dy = truth.position[1] - station[1];
    // [AUKF 6]
    z[0] = missing ? std::nan("") : math::sqrt(dx * dx + dy * dy) + range_noise;
    z[1] = missing ? std::nan("") : math::wrap(math::atan2(dy, dx) + bearing_noise);
    return !missing;
  }
};

/// One sampling instant of the loop.
template <class Filter, int M>
struct TrackingStep {
  double interval_s;  ///< T(k-1): the interval that led here
  const TrackingWorld& world;
  const Filter& filter;                                      ///< after update and feedback
  const Correction<typename Filter::Scalar, M>& correction;  ///< its NIS is NaN if z is missing
};

/// The error between samples, taken at even times: what the interval costs.
struct TrackingProbe {
  double period_s = 0;  ///< distance of the probes; 0: no probes
  double budget_m = 0;  ///< error to compare with
  std::uint32_t count = 0;
  std::uint32_t above = 0;  ///< probes with a position error above the budget
  double square_sum = 0;    ///< sum of squared position errors [m^2]
};

/// Runs the loop for at most `steps` samples and `duration_s` seconds and hands every step to
/// `sink(step)`. Stops at the first status that is not kOk and returns it.
template <class Filter, class Model, class Sink>
inline Status track(Filter& filter, Model model, TrackingWorld& world, std::uint32_t steps,
                    double duration_s, TrackingProbe& probe, Sink&& sink) {
  using Scalar = typename Filter::Scalar;
  using Position = typename Filter::Position;
  model.params.lift_smallest();  // the noise may take the range below 0
  for (std::uint32_t k = 0; k < steps; ++k) {
    const Scalar interval = filter.interval();
    const double dt = static_cast<double>(interval);
    if (world.time_s + dt > duration_s) break;

    while (probe.period_s > 0 && (probe.count + 1) * probe.period_s < world.time_s + dt) {
      const double since_sample = (probe.count + 1) * probe.period_s - world.time_s;
      Filter between = filter;
      Track there = world.truth;
      there.advance(since_sample);
      const Status status = between.predict(static_cast<Scalar>(since_sample));
      if (status != Status::kOk) return status;
      const double ex = static_cast<double>(between.x()(0)) - there.position[0];
      const double ey = static_cast<double>(between.x()(1)) - there.position[1];
      const double square = ex * ex + ey * ey;
      probe.square_sum += square;
      probe.above += square > probe.budget_m * probe.budget_m ? 1u : 0u;
      ++probe.count;
    }

    const bool measured = world.sample(dt);
    Status status = filter.predict(interval);
    if (status != Status::kOk) return status;
    Correction<Scalar, Model::kSize> correction(Status::kOk);
    correction.nis = Scalar(std::nan(""));
    if (measured) {
      Vector<Scalar, 2> measurement;
      measurement(0) = static_cast<Scalar>(world.z[0]);
      measurement(1) = static_cast<Scalar>(world.z[1]);
      correction = filter.update(measurement, model);
      if (correction.status != Status::kOk) return correction.status;
    }
    double desired[2];
    world.truth.desired(world.time_s, desired);
    Position reference;
    reference(0) = static_cast<Scalar>(desired[0]);
    reference(1) = static_cast<Scalar>(desired[1]);
    status = filter.feedback(reference);
    if (status != Status::kOk) return status;
    sink(TrackingStep<Filter, Model::kSize>{dt, world, filter, correction});
  }
  return Status::kOk;
}

}  // namespace auvest
