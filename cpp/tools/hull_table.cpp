// What a hull that is driven by its commands is worth as the process of a filter, beside dead
// reckoning by log and compass (docs/algorithms/guidance.md). The filters listen to the same
// missions of the lawnmower; none of them steers.
//
//     hull_table [runs] [seed]     prints errors of the position over the runs
//
// The wrong hulls have all drag and the damping in yaw larger, and the slope of the rudder smaller,
// by that share.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "auvest/models/heading_speed.hpp"
#include "auvest/models/planar_hull.hpp"
#include "simulation/mission.hpp"

namespace {

using namespace auvest;
using Dead = Ekf<SpeedHeadingCurrent<double>>;
using Driven = Ekf<PlanarHull<double>>;

const double kCompassSigma = 0.0262;  // noise of 0.5 deg, and a bias of 1 deg that repeats itself
const double kNoLog = 1000;

/// Errors of the position, and how consistent the filter is.
struct Tally {
  double squares = 0;
  double nees = 0;
  int count = 0;

  template <class Filter>
  void add(const Filter& filter, const double* truth) {
    const double ex = filter.x()(0) - truth[0];
    const double ey = filter.x()(1) - truth[1];
    const double a = filter.P()(0, 0), b = filter.P()(1, 0), c = filter.P()(1, 1);
    squares += ex * ex + ey * ey;
    nees += (ex * ex * c - 2 * ex * ey * b + ey * ey * a) / (a * c - b * b);
    ++count;
  }
  void print(const char* name) const {
    std::printf("%-34s %.3f m  NEES %.2f\n", name, std::sqrt(squares / count), nees / count);
  }
};

/// What the actuators do: they follow their commands; the mean over a step drives the hull.
struct Actuators {
  double rudder = 0, propeller = 15;

  Vector<double, 2> follow(const double* command, double dt) {
    return Vector<double, 2>(mean(rudder, command[0], dt / 0.1), mean(propeller, command[2], dt));
  }

 private:
  static double mean(double& now, double wanted, double time_constants) {
    const double left = std::exp(-time_constants);
    const double before = now - wanted;
    now = wanted + before * left;
    return wanted + before * (1 - left) / time_constants;
  }
};

Torpedo<double>::Params hull_off_by(double share) {
  auto hull = remus100<double>();
  hull.lift_drag.drag *= 1 + share;
  hull.cross_flow.drag *= 1 + share;
  hull.linear_damping.yaw_kg_m2_s *= 1 + share;
  hull.rudder.lift_slope *= 1 - share;
  return hull;
}

const char* const kNames[] = {"dead reckoning, log and compass", "dead reckoning, wanted speed",
                              "hull, fixes alone", "hull, compass", "hull, compass and log"};
const double kShares[] = {0, 0.1, 0.2};

/// The five filters in one run.
class Listeners {
 public:
  Listeners(double share, Tally* tallies)
      : tallies_(tallies),
        dead_{Dead(SpeedHeadingCurrent<double>()), Dead(SpeedHeadingCurrent<double>())},
        driven_{driven(share), driven(share), driven(share)} {}

  void start(const double* guess) {
    Vector<double, 4> x;
    x << guess[0], guess[1], 0, 0;
    Matrix<double, 4, 4> p = Matrix<double, 4, 4>::Zero();
    for (int i = 0; i < 4; ++i) p(i, i) = i < 2 ? 1 : 0.09;
    for (Dead& filter : dead_) filter.reset(x, p);
    Vector<double, 8> y;
    y << guess[0], guess[1], 0, 1.5, 0, 0, 0, 0;
    const double sigma[] = {1, 1, 0.05, 0.1, 0.05, 0.02, 0.3, 0.3};
    Matrix<double, 8, 8> q = Matrix<double, 8, 8>::Zero();
    for (int i = 0; i < 8; ++i) q(i, i) = sigma[i] * sigma[i];
    for (Driven& filter : driven_) filter.reset(y, q);
  }

  void step(const MissionStep& step, const double* command, const UsblDevice& usbl) {
    const double dt = 0.1;
    const MissionReadings& told = step.readings;
    heading_.predict(told.yaw_rate_rad_s, dt);
    if (heading_.initialised()) {
      heading_.update(told.compass_rad);
    } else {
      heading_.restart(told.compass_rad);
    }
    Vector<double, 3> motion;
    motion << told.log_m_s[0], told.log_m_s[1], heading_.heading_rad();
    dead_[0].predict(dt, motion);
    motion << 1.5, 0, heading_.heading_rad();
    dead_[1].predict(dt, motion);
    const Vector<double, 2> acting = actuators_.follow(command, dt);
    for (Driven& filter : driven_) filter.predict(dt, acting);
    for (int i = 1; i < 3; ++i) {
      HeadingSpeed<double, 8>::Params p;
      p.sigma_heading_rad = kCompassSigma;
      if (i == 1) p.sigma_forward_m_s = p.sigma_starboard_m_s = kNoLog;
      Vector<double, 3> z;
      z << told.compass_rad, told.log_m_s[0], told.log_m_s[1];
      driven_[i].update(z, HeadingSpeed<double, 8>(p));
    }
    if (step.fixed) {
      const Vector<double, 2> z(told.fix[0], told.fix[1]);
      for (Dead& filter : dead_) filter.update(z, mission_detail::sonar_as<double, 4>(usbl));
      for (Driven& filter : driven_) filter.update(z, mission_detail::sonar_as<double, 8>(usbl));
    }
    for (int i = 0; i < 2; ++i) tallies_[i].add(dead_[i], step.truth.pose);
    for (int i = 0; i < 3; ++i) tallies_[2 + i].add(driven_[i], step.truth.pose);
  }

 private:
  static Driven driven(double share) {
    return Driven(PlanarHull<double>(PlanarHull<double>::Params(), hull_off_by(share)));
  }

  Tally* tallies_;
  Dead dead_[2];
  Driven driven_[3];
  HeadingFilter<double> heading_;
  Actuators actuators_;
};

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 20;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 1);
  std::printf("%d runs, seed %llu\n", runs, static_cast<unsigned long long>(seed));
  for (const double share : kShares) {
    Tally tallies[5];
    for (int run = 0; run < runs; ++run) {
      const MissionScenario scenario =
          mission_source(MissionSource::kRobustModelAided, MissionTrack::kLawnmower);
      Listeners listeners(share, tallies);
      bool first = true;
      double command[3];
      fly_mission<double>(scenario, seed, static_cast<std::uint32_t>(run),
                          [&](const MissionStep& step) {
                            if (first) {
                              listeners.start(step.estimate_m);
                            } else {
                              listeners.step(step, command, scenario.usbl);
                            }
                            first = false;
                            for (int i = 0; i < 3; ++i) command[i] = step.command[i];
                          });
    }
    std::printf("hull known to %.0f %%\n", 100 * share);
    for (int i = 0; i < 5; ++i) {
      if (share == 0 || i >= 2) tallies[i].print(kNames[i]);
    }
  }
}
