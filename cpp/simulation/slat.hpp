// The scenario of the SLATF paper, section 7: communication fails for 400 s, the slave dead-reckons
// with poor sensors and pings its master. Defaults: configuration R1 of docs/algorithms/slatf.md,
// which fixes what the paper leaves open.
//
// Host side: the truth is kept in double, whatever the filter's scalar.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "auvest/math/angle.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

/// A vehicle at constant speed that goes straight and, from a time on, turns at a constant rate.
struct SlatVehicle {
  double position[2] = {0, 0};  ///< [m]
  double heading = 0;           ///< from the x axis towards the y axis [rad]
  double speed = 5.1444;        ///< 10 kn [m/s]
  double turn_start_s = 1e9;
  double turn_rate = 0;  ///< [rad/s]

  double velocity(int axis) const {
    return speed * (axis == 0 ? math::cos(heading) : math::sin(heading));
  }

  void advance(double time_s, double dt) {
    const double straight = turn_start_s - time_s;
    if (straight < dt && turn_rate != 0) {
      const double first = straight > 0 ? straight : 0;
      go(first);
      turn(dt - first);
    } else {
      go(dt);
    }
  }

 private:
  void go(double dt) {
    for (int axis = 0; axis < 2; ++axis) position[axis] += dt * velocity(axis);
  }
  void turn(double dt) {
    const double next = heading + turn_rate * dt;
    const double radius = speed / turn_rate;
    position[0] += radius * (math::sin(next) - math::sin(heading));
    position[1] += radius * (math::cos(heading) - math::cos(next));
    heading = next;
  }
};

struct SlatScenario {
  static constexpr int kMasters = 4;

  double duration_s = 400;    ///< section 7
  double odometry_s = 1;      ///< period of the slave's readings; R1
  int odometry_per_ping = 2;  ///< sonar period 2 s, section 7
  SlatVehicle slave;
  SlatVehicle masters[kMasters];
  int count = 1;
  double sigma_speed_m_s = 2;      ///< of the slave's readings, section 7
  double sigma_heading_rad = 0.3;  ///< section 7
  double sigma_range_m = 1;        ///< section 7, level 3
  double sigma_bearing_rad = 0.06;
  double dropout = 0;           ///< probability that an echo is lost
  double outlier = 0;           ///< probability that an echo is wrong ...
  double outlier_sigmas = 100;  ///< ... by this many standard deviations in range and bearing
  double doubled = 0;           ///< probability that an echo has twice the range: a multipath ...
  int doubled_in_a_row = 1;     ///< ... and so many that follow it
  double silent_from_s = 1e9;   ///< no echo from here ...
  double silent_to_s = 1e9;     ///< ... to here
  bool identified = true;       ///< the filter is told whose echo it hears
  bool plan_known = true;       ///< the filter knows the masters' velocity changes, u of [SLATF 4]
  double prior_position_m = 1;  ///< standard deviations of what was shared of the masters; R1
  double prior_velocity_m_s = 0.05;
  double prior_acceleration_m_s2 = 1e-4;

  SlatScenario() {
    slave.heading = math::pi<double>() / 6;
    for (int n = 0; n < kMasters; ++n) {
      SlatVehicle& master = masters[n];
      master.position[1] = 300.0 * (n % 2 == 0 ? 1 + n / 2 : -1 - n / 2);
      master.heading = math::pi<double>() / 12;
      master.turn_start_s = 240;
      master.turn_rate = math::pi<double>() / 120;
    }
  }
};

/// One ping of the scenario, after the filter has taken it in.
template <class Filter>
struct SlatStep {
  double time_s;
  const SlatVehicle& slave;
  const SlatVehicle* masters;
  int heard;  ///< echoes taken in
  const Filter& filter;
};

/// Runs the scenario and hands every ping to `sink(step)`. `world` makes truth and measurements,
/// `random` is the filter's: two filters with the same world meet the same noise. Stops at the
/// first status that is not kOk and returns it.
template <class Filter, class Sink>
inline Status run_slat(Filter& filter, Sonar<typename Filter::Scalar> sonar,
                       const SlatScenario& scenario, math::Random& world, math::Random& random,
                       Sink&& sink) {
  using Scalar = typename Filter::Scalar;
  sonar.params.lift_smallest();  // the noise may take the range below 0
  SlatVehicle slave = scenario.slave;
  SlatVehicle masters[SlatScenario::kMasters];

  typename Filter::SlaveBelief start;
  math::set_zero(start.x);
  math::set_zero(start.P);
  for (int axis = 0; axis < 2; ++axis) start.x(axis) = static_cast<Scalar>(slave.position[axis]);
  Status status = filter.reset(start, random);
  for (int n = 0; n < scenario.count && status == Status::kOk; ++n) {
    masters[n] = scenario.masters[n];
    typename Filter::MasterBelief prior;
    math::set_zero(prior.x);
    math::set_zero(prior.P);
    const double sigmas[3] = {scenario.prior_position_m, scenario.prior_velocity_m_s,
                              scenario.prior_acceleration_m_s2};
    double e[4];
    world.normal_pair(e[0], e[1]);
    world.normal_pair(e[2], e[3]);
    for (int axis = 0; axis < 2; ++axis) {
      prior.x(axis) = static_cast<Scalar>(masters[n].position[axis] + sigmas[0] * e[axis]);
      prior.x(2 + axis) = static_cast<Scalar>(masters[n].velocity(axis) + sigmas[1] * e[2 + axis]);
      for (int k = 0; k < 3; ++k) {
        prior.P(2 * k + axis, 2 * k + axis) = static_cast<Scalar>(sigmas[k] * sigmas[k]);
      }
    }
    status = filter.add_master(prior);
  }
  if (status != Status::kOk) return status;

  int doubled[SlatScenario::kMasters] = {0, 0, 0, 0};  // echoes that are still to be
  const int steps = static_cast<int>(scenario.duration_s / scenario.odometry_s + 0.5);
  for (int k = 1; k <= steps; ++k) {
    const double dt = scenario.odometry_s;
    const double before_s = dt * (k - 1);
    // Measured = true + noise, of what the vehicle does during the step.
    double e[2];
    world.normal_pair(e[0], e[1]);
    typename Filter::Control reading;
    reading(0) = static_cast<Scalar>(slave.speed + scenario.sigma_speed_m_s * e[0]);
    reading(1) = static_cast<Scalar>(slave.heading + scenario.sigma_heading_rad * e[1]);
    slave.advance(before_s, dt);
    typename Filter::VelocityChange changes[SlatScenario::kMasters];
    for (int n = 0; n < scenario.count; ++n) {
      const double before[2] = {masters[n].velocity(0), masters[n].velocity(1)};
      masters[n].advance(before_s, dt);
      for (int axis = 0; axis < 2; ++axis) {
        changes[n](axis) = static_cast<Scalar>(masters[n].velocity(axis) - before[axis]);
      }
    }
    status = filter.predict(static_cast<Scalar>(dt), reading, random,
                            scenario.plan_known ? changes : nullptr);
    if (status != Status::kOk) return status;
    if (k % scenario.odometry_per_ping != 0) continue;

    const double time = dt * k;
    Echo<Scalar> heard[SlatScenario::kMasters];
    int count = 0;
    for (int n = 0; n < scenario.count; ++n) {
      double noise[2];
      world.normal_pair(noise[0], noise[1]);
      const bool lost = world.uniform<double>() < scenario.dropout;
      const bool wrong = world.uniform<double>() < scenario.outlier;
      if (scenario.doubled > 0 && doubled[n] == 0 && world.uniform<double>() < scenario.doubled) {
        doubled[n] = scenario.doubled_in_a_row;
      }
      const double times = doubled[n] > 0 ? 2 : 1;
      if (doubled[n] > 0) --doubled[n];
      if (lost || (time > scenario.silent_from_s && time <= scenario.silent_to_s)) continue;
      const double scale = wrong ? scenario.outlier_sigmas : 1;
      const double dx = slave.position[0] - masters[n].position[0];
      const double dy = slave.position[1] - masters[n].position[1];
      heard[count].master = scenario.identified ? n : kUnknownMaster;
      // [SLATF 5]
      heard[count].z(0) = static_cast<Scalar>(times * math::sqrt(dx * dx + dy * dy) +
                                              scale * scenario.sigma_range_m * noise[0]);
      heard[count].z(1) = static_cast<Scalar>(
          math::wrap(math::atan2(dy, dx) + scale * scenario.sigma_bearing_rad * noise[1]));
      ++count;
    }
    status = filter.update(heard, count, sonar, random);
    if (status != Status::kOk) return status;
    sink(SlatStep<Filter>{time, slave, masters, count, filter});
  }
  return Status::kOk;
}

/// Stands in for a filter and writes down all that it is told: the log of a run.
struct SlatScribe {
  using Scalar = double;
  using SlaveBelief = Belief<double, 2>;
  using MasterBelief = Belief<double, 6>;
  using Control = Vector<double, 2>;
  using VelocityChange = Vector<double, 2>;

  struct Step {
    double dt;
    Control reading;
    VelocityChange changes[SlatScenario::kMasters];  ///< zero where the plan is not known
  };
  struct Heard {
    std::size_t step;  ///< at whose end, counted from 1
    Echo<double> echo;
  };

  std::vector<MasterBelief> priors;
  std::vector<Step> steps;
  std::vector<Heard> heard;

  Status reset(const SlaveBelief&, math::Random&) { return Status::kOk; }

  Status add_master(const MasterBelief& prior) {
    priors.push_back(prior);
    return Status::kOk;
  }

  Status predict(double dt, const Control& reading, math::Random&, const VelocityChange* changes) {
    Step step;
    step.dt = dt;
    step.reading = reading;
    for (int n = 0; n < SlatScenario::kMasters; ++n) {
      math::set_zero(step.changes[n]);
      if (changes != nullptr && n < static_cast<int>(priors.size())) step.changes[n] = changes[n];
    }
    steps.push_back(step);
    return Status::kOk;
  }

  Status update(const Echo<double>* echoes, int count, const Sonar<double>&, math::Random&) {
    for (int k = 0; k < count; ++k) heard.push_back(Heard{steps.size(), echoes[k]});
    return Status::kOk;
  }
};

}  // namespace auvest
