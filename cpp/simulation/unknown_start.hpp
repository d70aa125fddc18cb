// A craft that does not know where it is, among leaders that send it ranges in turn: the cases of
// docs/algorithms/unknown_start.md.
//
// Host side: the truth is kept in double, whatever the filter's scalar.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "auvest/filters/ekf.hpp"
#include "auvest/filters/gaussian_sum.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/speed_heading.hpp"
#include "auvest/robust/rejection_streak.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

/// What the runs have in common.
struct StartScenario {
  int leaders = 3;                ///< 1..4
  double moving_fraction = 0.5;   ///< of the runs: the leaders move, at up to 2 m/s
  bool spread = true;             ///< round the craft (two: 60 to 120 deg apart), or all in 30 deg
  double late_fraction = 0;       ///< of the ranges: late by 5 to 50 m
  double outlier_fraction = 0;    ///< of the ranges: with ten times the sigma
  double sigma_start_m = 1e4;     ///< of the prior, per axis
  bool drawn_from_prior = false;  ///< the mean of the prior; else anywhere in the leaders' area
  double displaced_m = 0;         ///< of the mean of the prior, in addition
  std::uint32_t bad_step = 0;     ///< the range before which a time stamp is wrong; 0: none
  double bad_step_s = 4294967;
  double sigma_range_m = 1;
  double sigma_speed = 0.1;          ///< [m/s/sqrt(Hz)]
  double sigma_heading = 0.0174533;  ///< [rad/sqrt(Hz)]
  std::uint32_t range_every = 5;     ///< steps of 1 s
  static constexpr int kMostLeaders = 4;
};

/// One run's craft and leaders. The craft begins in the origin.
class StartWorld {
 public:
  StartWorld(const StartScenario& scenario, std::uint64_t seed, std::uint64_t run)
      : scenario_(scenario), random_(seed, run) {
    const double turn = math::two_pi<double>();
    const double distance = 50 * math::exp(uniform(0, 1) * math::log(20.0));  // 50..1000 m
    const bool moving = uniform(0, 1) < scenario.moving_fraction;
    const double first = uniform(0, turn);
    const double apart = uniform(turn / 6, turn / 3);
    for (int k = 0; k < scenario.leaders; ++k) {
      double angle = first;
      if (!scenario.spread) {
        angle += uniform(0, turn / 12);
      } else if (scenario.leaders == 2) {
        angle += k * apart;
      } else {
        angle += (k + uniform(-0.2, 0.2)) * turn / scenario.leaders;
      }
      const double away = distance * uniform(0.5, 1);
      leader_[k][0] = away * math::cos(angle);
      leader_[k][1] = away * math::sin(angle);
      const double speed = uniform(0, 2);
      const double course = uniform(0, turn);
      velocity_[k][0] = moving ? speed * math::cos(course) : 0;
      velocity_[k][1] = moving ? speed * math::sin(course) : 0;
    }
    speed_ = uniform(0.5, 2);
    heading_ = uniform(0, turn);
    leg_s_ = uniform(60, 150);
    if (scenario.drawn_from_prior) {
      random_.normal_pair(start_[0], start_[1]);
      for (double& x : start_) x *= scenario.sigma_start_m;
    } else {
      for (double& x : start_) x = uniform(-distance, distance);
    }
    const double direction = uniform(0, turn);
    start_[0] += scenario.displaced_m * math::cos(direction);
    start_[1] += scenario.displaced_m * math::sin(direction);
  }

  const double (&start() const)[2] { return start_; }  ///< mean of the prior [m]
  const double (&position() const)[2] { return position_; }
  double heading() const { return heading_; }  ///< true [rad]
  double speed() const { return speed_; }      ///< true [m/s]

  /// One second on; what the instruments measure of it: speed [m/s] and heading [rad].
  void advance(double& speed, double& heading) {
    double a, b;
    random_.normal_pair(a, b);
    speed = speed_ + scenario_.sigma_speed * a;
    heading = heading_ + scenario_.sigma_heading * b;
    position_[0] += speed_ * math::cos(heading_);
    position_[1] += speed_ * math::sin(heading_);
    for (int k = 0; k < scenario_.leaders; ++k) {
      for (int i = 0; i < 2; ++i) leader_[k][i] += velocity_[k][i];
    }
    leg_s_ -= 1;
    if (leg_s_ > 0) return;
    leg_s_ = uniform(60, 150);
    const double turn = uniform(40, 120) * math::pi<double>() / 180;
    heading_ += uniform(0, 1) < 0.5 ? turn : -turn;
  }

  /// The range to leader `which`, and where that stands.
  double range(int which, double (&there)[2]) {
    for (int i = 0; i < 2; ++i) there[i] = leader_[which][i];
    const double dx = position_[0] - there[0];
    const double dy = position_[1] - there[1];
    double error = scenario_.sigma_range_m * random_.normal<double>();
    if (uniform(0, 1) < scenario_.outlier_fraction) error *= 10;
    if (uniform(0, 1) < scenario_.late_fraction) error += uniform(5, 50);
    return math::sqrt(dx * dx + dy * dy) + error;
  }

 private:
  double uniform(double low, double high) { return low + (high - low) * random_.uniform<double>(); }

  StartScenario scenario_;
  math::Random random_;
  double leader_[StartScenario::kMostLeaders][2];
  double velocity_[StartScenario::kMostLeaders][2];
  double start_[2];
  double position_[2] = {0, 0};
  double speed_, heading_, leg_s_;
};

/// Runs a filter with the process SpeedHeading over `ranges` ranges from a start it does not know,
/// and hands it to `sink(range, filter, world, correction)` after each. A refusal ends the run and
/// is returned.
template <class Filter, class Sink>
inline Status run_unknown_start(Filter& filter, const StartScenario& scenario, std::uint64_t seed,
                                std::uint64_t run, std::uint32_t ranges, Sink&& sink) {
  using Scalar = typename Filter::Scalar;
  using Sensor = LeaderRange<Scalar, Filter::kStates>;
  StartWorld world(scenario, seed, run);
  typename Filter::State x;
  typename Filter::Covariance P;
  math::set_zero(x);
  math::set_zero(P);
  for (int i = 0; i < 2; ++i) {
    x(i) = static_cast<Scalar>(world.start()[i]);
    P(i, i) = static_cast<Scalar>(scenario.sigma_start_m * scenario.sigma_start_m);
  }
  Status status = filter.reset(x, P);
  Sensor sensor;
  sensor.params.sigma_range_m = static_cast<Scalar>(scenario.sigma_range_m);
  sensor.params.lift_smallest();  // noise is not cut off at a leader
  for (std::uint32_t k = 1; k <= ranges && status == Status::kOk; ++k) {
    typename Filter::Process::Input input;
    math::set_zero(input);
    for (std::uint32_t step = 0; step < scenario.range_every && status == Status::kOk; ++step) {
      double speed, heading;
      world.advance(speed, heading);
      input(0) = static_cast<Scalar>(speed);
      input(2) = static_cast<Scalar>(heading);
      status = filter.predict(Scalar(1), input);
    }
    if (status != Status::kOk) return status;
    // In steps that no filter refuses for their length.
    double bad_s = k == scenario.bad_step ? scenario.bad_step_s : 0;
    while (bad_s > 0 && status == Status::kOk) {
      status = filter.predict(static_cast<Scalar>(bad_s < 3600 ? bad_s : 3600), input);
      bad_s -= 3600;
    }
    if (status != Status::kOk) return status;
    double there[2];
    Vector<Scalar, 1> z;
    z(0) = static_cast<Scalar>(world.range(static_cast<int>(k) % scenario.leaders, there));
    sensor.params.leader_x_m = static_cast<Scalar>(there[0]);
    sensor.params.leader_y_m = static_cast<Scalar>(there[1]);
    const auto correction = filter.update(z, sensor);
    status = correction.status;
    if (status == Status::kOk) sink(k, filter, world, correction);
  }
  return status;
}

/// The error's squared distance in the belief's own covariance, chi-square with 2 degrees of
/// freedom, and the square root of the trace [m].
struct StartError {
  double distance2, sigma_m;

  template <class Filter>
  StartError(const Filter& filter, const StartWorld& world) {
    const auto P = filter.P();
    const double xx = static_cast<double>(P(0, 0));
    const double yx = static_cast<double>(P(1, 0));
    const double yy = static_cast<double>(P(1, 1));
    const double x = static_cast<double>(filter.x()(0)) - world.position()[0];
    const double y = static_cast<double>(filter.x()(1)) - world.position()[1];
    distance2 = (yy * x * x - 2 * yx * x * y + xx * y * y) / (xx * yy - yx * yx);
    sigma_m = math::sqrt(xx + yy);
  }

  bool right() const { return distance2 < 11.6183 && sigma_m < 5; }  ///< inside 99.7 %
  bool wrong() const { return distance2 > 28.7 && sigma_m < 5; }     ///< beyond 5 sigma
  bool back() const { return distance2 < 18.4207 && sigma_m < 5; }   ///< inside 99.99 %
};

/// Shares of the runs after 10, 30 and 100 ranges.
struct StartShares {
  double right[3] = {0, 0, 0};
  double wrong[3] = {0, 0, 0};
  double wrong_settled[3] = {0, 0, 0};
  double settled[3] = {0, 0, 0};
  int refused = 0;  ///< runs that ended early: none should
};

/// `runs` runs, each with a copy of `filter`.
template <class Filter>
StartShares start_shares(const Filter& filter, const StartScenario& scenario, int runs,
                         std::uint64_t seed) {
  StartShares shares;
  for (int run = 0; run < runs; ++run) {
    Filter own = filter;
    const auto look = [&shares](std::uint32_t range, const Filter& now, const StartWorld& world,
                                const RobustCorrection<typename Filter::Scalar, 1>&) {
      const int at = range == 10 ? 0 : range == 30 ? 1 : range == 100 ? 2 : -1;
      if (at < 0) return;
      const StartError error(now, world);
      const bool settled = now.convergence() == Convergence::kSettled;
      shares.right[at] += error.right() ? 1 : 0;
      shares.wrong[at] += error.wrong() ? 1 : 0;
      shares.wrong_settled[at] += error.wrong() && settled ? 1 : 0;
      shares.settled[at] += settled ? 1 : 0;
    };
    const auto number = static_cast<std::uint64_t>(run);
    if (run_unknown_start(own, scenario, seed, number, 100, look) != Status::kOk) ++shares.refused;
  }
  for (int at = 0; at < 3; ++at) {
    shares.right[at] /= runs;
    shares.wrong[at] /= runs;
    shares.wrong_settled[at] /= runs;
    shares.settled[at] /= runs;
  }
  return shares;
}

/// How many ranges it took to come back, to stay for five; 101 stands for never.
struct StartReturn {
  int median, most;  ///< half and 90 % of the runs were back
  double never;      ///< share of the runs
  int refused = 0;
};

/// As above; counted from `scenario.bad_step` where that is not 0.
template <class Filter>
StartReturn start_return(const Filter& filter, const StartScenario& scenario, int runs,
                         std::uint64_t seed) {
  std::vector<int> after(static_cast<std::size_t>(runs));
  StartReturn result;
  for (int run = 0; run < runs; ++run) {
    Filter own = filter;
    const int event = static_cast<int>(scenario.bad_step);
    const int from = event == 0 ? 1 : event;
    int streak = 0;
    int back = 101;
    const auto look = [&](std::uint32_t range, const Filter& now, const StartWorld& world,
                          const RobustCorrection<typename Filter::Scalar, 1>&) {
      const int since = static_cast<int>(range) - from + 1;
      if (since < 1) return;
      streak = StartError(now, world).back() ? streak + 1 : 0;
      if (streak == 5 && since - 4 < back) back = since - 4;
    };
    const auto ranges = static_cast<std::uint32_t>(from + 103);
    const auto number = static_cast<std::uint64_t>(run);
    if (run_unknown_start(own, scenario, seed, number, ranges, look) != Status::kOk) {
      ++result.refused;
    }
    after[static_cast<std::size_t>(run)] = back;
  }
  std::sort(after.begin(), after.end());
  result.median = after[static_cast<std::size_t>(runs / 2)];
  result.most = after[static_cast<std::size_t>(runs - 1 - runs / 10)];
  result.never =
      static_cast<double>(std::count(after.begin(), after.end(), 101)) / static_cast<double>(runs);
  return result;
}

/// A robust EKF or UKF of the craft's position that may not know where it begins.
template <class Scalar, template <class> class Filter, template <class> class Kernel, int K>
GaussianSum<
    Robust<Filter<SpeedHeading<Scalar>>, RobustUpdate<Kernel<Scalar>, RejectionStreak<Scalar>>>, K>
start_filter(int components = K) {
  using Process = SpeedHeading<Scalar>;
  using Inside = Robust<Filter<Process>, RobustUpdate<Kernel<Scalar>, RejectionStreak<Scalar>>>;
  typename GaussianSum<Inside, K>::Params params;
  params.components = static_cast<std::uint8_t>(components);
  return GaussianSum<Inside, K>(Inside(Filter<Process>(Process())), params);
}

/// A share less three standard errors of its difference from one that `runs` runs give: a share of
/// 0 or 1 is not known exactly either.
inline double start_bound(double share, int of_runs, int runs) {
  const double p = (share * of_runs + 2) / (of_runs + 4);
  return share - 3 * math::sqrt(p * (1 - p) * (1.0 / of_runs + 1.0 / runs));
}

}  // namespace auvest
