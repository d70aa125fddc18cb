// Range-only cooperative localisation, the setting of the M-estimation EKF paper (Li, Du, Fan,
// Chen, Mao, Luo 2020): a slave dead-reckons and ranges to two leaders in turn.
//
// The paper gives neither tracks nor noise. The tracks are those of this project's own reference
// case; the slave alternates between two headings and the leaders move about it.
//
// Host side: the truth is kept in double, whatever the filter's scalar.
#pragma once

#include <cstdint>

#include "auvest/math/basic.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

/// Range errors: normal, and with a probability of another, larger size.
struct RangeNoise {
  double sigma_m = 1;
  double outlier_fraction = 0;
  double outlier_sigma_m = 10;

  /// One uniform and one normal deviate, in this order.
  double draw(math::Random& random) const {
    const bool outlier = random.uniform<double>() < outlier_fraction;
    return (outlier ? outlier_sigma_m : sigma_m) * random.normal<double>();
  }
};

/// The true motion of slave and leaders.
struct CooperativeFleet {
  double time_s = 0;
  double position[2] = {0, 0};  ///< of the slave [m]
  double speed = 1.5;           ///< of the slave, forward [m/s]

  /// Of the slave [rad]: there and back, 600 s each, on a weaving course.
  double heading() const {
    const bool back = static_cast<std::int64_t>(time_s / 600) % 2 != 0;
    return (back ? math::pi<double>() : 0.0) +
           0.3 * math::sin(math::two_pi<double>() * time_s / 900);
  }

  void advance(double dt) {
    const double angle = heading();
    position[0] += dt * speed * math::cos(angle);
    position[1] += dt * speed * math::sin(angle);
    time_s += dt;
  }

  /// Position of leader 0 or 1 [m].
  void leader(int which, double (&there)[2]) const {
    const double turn = math::two_pi<double>() * time_s / 1500;
    there[0] = position[0] +
               (which == 0 ? 200 * math::cos(turn) + 100 : -150 + 60 * math::sin(time_s / 400));
    there[1] = position[1] + (which == 0 ? 250 + 50 * math::sin(time_s / 300)
                                         : -220 + 80 * math::cos(time_s / 500));
  }
};

/// What a run is made of, beside the filter.
struct CooperativeScenario {
  CooperativeFleet fleet;
  RangeNoise noise;
  double dt_s = 1;                   ///< of the slave's instruments
  std::uint32_t range_every = 5;     ///< steps between ranges; the leaders take turns
  double sigma_speed = 0.1;          ///< of the forward speed [m/s/sqrt(Hz)]
  double sigma_heading = 0.0174533;  ///< [rad/sqrt(Hz)]
};

/// One step of the slave's instruments.
template <class Filter, class Report>
struct CooperativeStep {
  const CooperativeFleet& fleet;
  const Filter& filter;
  const Report* correction;  ///< of the range that was taken, or null
};

/// Runs `steps` steps of dead reckoning with the ranges among them, and hands every step to
/// `sink(step)`. `sensor` brings the noise the filter is told; its leader is set here. Stops at the
/// first status that is not kOk and returns it.
template <class Filter, class Sink>
inline Status cooperate(Filter& filter,
                        LeaderRange<typename Filter::Scalar, Filter::kStates> sensor,
                        CooperativeScenario scenario, math::Random& random, std::uint32_t steps,
                        Sink&& sink) {
  using Scalar = typename Filter::Scalar;
  CooperativeFleet& fleet = scenario.fleet;
  for (std::uint32_t k = 1; k <= steps; ++k) {
    double speed_error = 0;
    double heading_error = 0;
    random.normal_pair(speed_error, heading_error);
    const double per_sample = 1 / math::sqrt(scenario.dt_s);
    Vector<Scalar, 3> input;
    input(0) = static_cast<Scalar>(fleet.speed + per_sample * scenario.sigma_speed * speed_error);
    input(1) = Scalar(0);
    input(2) =
        static_cast<Scalar>(fleet.heading() + per_sample * scenario.sigma_heading * heading_error);
    fleet.advance(scenario.dt_s);
    const Status status = filter.predict(static_cast<Scalar>(scenario.dt_s), input);
    if (status != Status::kOk) return status;
    using Report = decltype(filter.update(Vector<Scalar, 1>(), sensor));
    if (k % scenario.range_every != 0) {
      sink(CooperativeStep<Filter, Report>{fleet, filter, nullptr});
      continue;
    }

    const int which = static_cast<int>(k / scenario.range_every % 2);
    double there[2];
    fleet.leader(which, there);
    const double dx = fleet.position[0] - there[0];
    const double dy = fleet.position[1] - there[1];
    const double range = math::sqrt(dx * dx + dy * dy) + scenario.noise.draw(random);
    sensor.params.leader_x_m = static_cast<Scalar>(there[0]);
    sensor.params.leader_y_m = static_cast<Scalar>(there[1]);
    Vector<Scalar, 1> z;
    z(0) = static_cast<Scalar>(range);
    const Report correction = filter.update(z, sensor);
    if (correction.status != Status::kOk) return correction.status;
    sink(CooperativeStep<Filter, Report>{fleet, filter, &correction});
  }
  return Status::kOk;
}

}  // namespace auvest
