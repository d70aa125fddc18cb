// Range-only cooperative localisation, the setting of the M-estimation EKF paper (Li, Du, Fan,
// Chen, Mao, Luo 2020): a slave dead-reckons and ranges to two leaders in turn.
//
// The paper gives neither tracks nor noise. The tracks are those of this project's own reference
// case; the slave alternates between two headings and the leaders move about it.
//
// Host side: the truth is kept in double, whatever the filter's scalar.
#pragma once

#include <cstdint>

#include "auvest/filters/late_updates.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

/// Range errors: normal, with outliers among them or heavy tails.
struct RangeNoise {
  enum class Kind : std::uint8_t {
    kContaminated,  ///< with a probability of another, larger size
    kMultipath,     ///< the same, but an outlier is always too long, by |N(0, outlier_sigma)|
    kStudent        ///< sigma times Student's t; no outliers of its own
  };
  Kind kind = Kind::kContaminated;
  double sigma_m = 1;
  double outlier_fraction = 0;
  double outlier_sigma_m = 10;
  std::uint32_t degrees_of_freedom = 3;  ///< of Student's t

  /// One uniform and one normal deviate, in this order; then one more normal deviate for a
  /// multipath outlier, or one for each of Student's degrees of freedom.
  double draw(math::Random& random) const {
    const bool outlier = random.uniform<double>() < outlier_fraction;
    const double deviate = random.normal<double>();
    if (kind == Kind::kContaminated) return (outlier ? outlier_sigma_m : sigma_m) * deviate;
    if (kind == Kind::kMultipath) {
      const double late = outlier ? outlier_sigma_m * math::absolute(random.normal<double>()) : 0.0;
      return sigma_m * deviate + late;
    }
    double chi_square = 0;
    for (std::uint32_t k = 0; k < degrees_of_freedom; ++k) {
      const double other = random.normal<double>();
      chi_square += other * other;
    }
    return sigma_m * deviate / math::sqrt(chi_square / static_cast<double>(degrees_of_freedom));
  }
};

/// How a range reaches the slave, and what it makes of it.
enum class RangeTiming : std::uint8_t {
  kAtOnce,    ///< with the leader's position of now: not what an acoustic modem does
  kOwnTime,   ///< with the leader's next message; taken at the time it was measured
  kAsIfFresh  ///< the same, but paired with the position in the message and the state of now
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
  RangeTiming timing = RangeTiming::kAtOnce;
  double dropout = 0;             ///< probability that a message is lost, and with it its range
  double late = 0;                ///< probability that a message arrives late
  std::uint32_t late_steps = 10;  ///< by at most so many steps, 1..kMostLateSteps
  static constexpr std::uint32_t kMostLateSteps = 20;
};

/// What became of messages with a range; each is counted once, at the step where it is decided.
/// Those that are still on their way at the end of a run are in none of the numbers.
struct MessageCounts {
  std::uint32_t taken = 0;       ///< corrected the filter
  std::uint32_t too_late = 0;    ///< older than the filter's memory
  std::uint32_t lost = 0;        ///< in the water: `dropout`
  std::uint32_t overflowed = 0;  ///< kMessagesInFlight others were on their way
};

/// One step of the slave's instruments.
template <class Filter, class Report>
struct CooperativeStep {
  const CooperativeFleet& fleet;
  const Filter& filter;
  const Report* correction;  ///< of the last range that was taken in this step, or null
  MessageCounts messages;    ///< of this step
};

/// Events that the filter remembers: two cycles of messages and the longest delay.
const int kCooperativeMemory = 64;

/// Messages that can be on their way at once.
const int kMessagesInFlight = 8;

/// A range on its way to the slave.
struct RangeMessage {
  bool pending = false;
  int leader = 0;
  std::uint32_t arrives = 0;   ///< step at which the slave has it
  std::uint32_t measured = 0;  ///< step of the exchange
  double range = 0;
  double there[2] = {0, 0};  ///< the leader then [m]
};

/// Runs `steps` steps of dead reckoning with the ranges among them, and hands every step to
/// `sink(step)`. `sensor` brings the noise the filter is told; its leader is set here. Stops at the
/// first status that is not kOk and returns it; a range that is too old is no such failure, nor is
/// a message lost or one too many: they are counted.
///
/// A leader's message carries its position now and the range of its previous exchange: a range is
/// complete one cycle of its leader after it was measured.
template <class Filter, class Sink>
inline Status cooperate(Filter& filter,
                        LeaderRange<typename Filter::Scalar, Filter::kStates> sensor,
                        CooperativeScenario scenario, math::Random& random, std::uint32_t steps,
                        Sink&& sink) {
  using Scalar = typename Filter::Scalar;
  using Sensor = LeaderRange<Scalar, Filter::kStates>;
  using Late = LateUpdates<Filter, Sensor, kCooperativeMemory>;
  using Report = typename Late::Report;
  CooperativeFleet& fleet = scenario.fleet;
  const std::uint32_t cycle = 2 * scenario.range_every;
  RangeMessage messages[kMessagesInFlight];
  Late late(filter);
  sensor.params.lift_smallest();  // the noise may take the range below 0
  for (std::uint32_t k = 1; k <= steps; ++k) {
    double speed_error = 0;
    double heading_error = 0;
    random.normal_pair(speed_error, heading_error);
    const double per_sample = 1 / math::sqrt(scenario.dt_s);
    typename Filter::Process::Input input;
    math::set_zero(input);
    input(0) = static_cast<Scalar>(fleet.speed + per_sample * scenario.sigma_speed * speed_error);
    input(1) = Scalar(0);
    input(2) =
        static_cast<Scalar>(fleet.heading() + per_sample * scenario.sigma_heading * heading_error);
    fleet.advance(scenario.dt_s);
    const Status status = late.predict(static_cast<Scalar>(scenario.dt_s), input);
    if (status != Status::kOk) return status;

    MessageCounts counts;
    if (k % scenario.range_every == 0) {
      RangeMessage message;
      message.leader = static_cast<int>(k / scenario.range_every % 2);
      message.measured = k;
      fleet.leader(message.leader, message.there);
      const double dx = fleet.position[0] - message.there[0];
      const double dy = fleet.position[1] - message.there[1];
      message.range = math::sqrt(dx * dx + dy * dy) + scenario.noise.draw(random);
      message.arrives = scenario.timing == RangeTiming::kAtOnce ? k : k + cycle;
      const bool lost = scenario.dropout > 0 && random.uniform<double>() < scenario.dropout;
      if (scenario.late > 0 && random.uniform<double>() < scenario.late) {
        message.arrives +=
            1 + static_cast<std::uint32_t>(random.uniform<double>() * scenario.late_steps);
      }
      message.pending = true;
      bool homeless = !lost;
      for (RangeMessage& slot : messages) {
        if (!homeless || slot.pending) continue;
        slot = message;
        homeless = false;
      }
      counts.lost = lost ? 1 : 0;
      counts.overflowed = homeless ? 1 : 0;
    }

    Report correction(Status::kOk);
    for (RangeMessage& message : messages) {
      if (!message.pending || message.arrives != k) continue;
      message.pending = false;
      Scalar age = static_cast<Scalar>((k - message.measured) * scenario.dt_s);
      if (scenario.timing == RangeTiming::kAsIfFresh) {
        age = Scalar(0);
        fleet.leader(message.leader, message.there);
      }
      sensor.params.leader_x_m = static_cast<Scalar>(message.there[0]);
      sensor.params.leader_y_m = static_cast<Scalar>(message.there[1]);
      Vector<Scalar, 1> z;
      z(0) = static_cast<Scalar>(message.range);
      const Report report = late.update(z, sensor, age);
      if (report.status == Status::kTimeBackwards) {
        ++counts.too_late;
        continue;
      }
      if (report.status != Status::kOk) return report.status;
      correction = report;
      ++counts.taken;
    }
    filter = late.filter();
    sink(CooperativeStep<Filter, Report>{fleet, filter, counts.taken > 0 ? &correction : nullptr,
                                         counts});
  }
  return Status::kOk;
}

}  // namespace auvest
