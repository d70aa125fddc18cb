// The closed-loop table: what the filter in the loop is worth to a torpedo that has to stay on its
// track, beside the values that an independent prototype gave (docs/algorithms/guidance.md).
//
//     mission_table [runs] [seed]     prints means and standard errors over the runs
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "simulation/mission.hpp"

namespace {

using auvest::MissionSource;
using auvest::MissionTrack;

struct Mean {
  double sum = 0;
  double squares = 0;
  int runs = 0;

  void add(double value) {
    sum += value;
    squares += value * value;
    ++runs;
  }
  double value() const { return sum / runs; }
  double error() const {
    return runs > 1 ? std::sqrt((squares / runs - value() * value()) / (runs - 1)) : 0.0;
  }
};

/// A row of the table; what the prototype gave is NaN where it gave nothing.
struct Row {
  MissionSource source;
  double interval_s;
  double settled[2][2];  ///< lawnmower and circle: mean, standard error
  double all[2];         ///< lawnmower
  double position[2];    ///< lawnmower and circle
};

const double kNone = std::nan("");

const Row kRows[] = {
    {MissionSource::kTruth, 0.5, {{0.174, 0.018}, {0.637, 0.003}}, {3.24, 0.05}, {0, 0}},
    {MissionSource::kTruthCrab, 0.5, {{0.034, 0.001}, {0.250, 0.004}}, {3.16, 0.05}, {0, 0}},
    {MissionSource::kFixes, 0.5, {{0.677, 0.026}, {0.894, 0.014}}, {3.71, 0.05}, {2.32, 2.14}},
    {MissionSource::kUkf, 0.5, {{0.580, 0.015}, {0.853, 0.014}}, {3.38, 0.06}, {1.20, 1.01}},
    {MissionSource::kAukfLaw, 0.5, {{0.599, 0.016}, {0.855, 0.015}}, {3.43, 0.06}, {1.21, 1.01}},
    {MissionSource::kAukfBudget, 0.5, {{0.634, 0.015}, {0.873, 0.014}}, {3.42, 0.06}, {1.18, 1.01}},
    {MissionSource::kModelAided, 0.5, {{0.336, 0.013}, {0.735, 0.011}}, {3.26, 0.05}, {0.42, 0.46}},
    {MissionSource::kModelAidedCrab,
     0.5,
     {{0.265, 0.010}, {0.410, 0.015}},
     {3.18, 0.05},
     {0.42, 0.46}},
    {MissionSource::kUkf, 2.0, {{1.350, 0.036}, {1.638, 0.048}}, {3.79, 0.07}, {2.26, 1.92}},
    {MissionSource::kModelAidedCrab,
     2.0,
     {{0.469, 0.018}, {0.579, 0.021}},
     {3.21, 0.05},
     {0.66, 0.76}},
    {MissionSource::kUkfDefaultPsd,
     0.5,
     {{1.384, 0.053}, {0.947, 0.018}},
     {3.64, 0.06},
     {2.27, 1.19}},
    {MissionSource::kUkfOutliers,
     0.5,
     {{1.191, 0.056}, {kNone, kNone}},
     {5.08, 0.21},
     {4.18, kNone}},
    {MissionSource::kModelAidedOutliers,
     0.5,
     {{0.684, 0.031}, {kNone, kNone}},
     {4.12, 0.15},
     {2.82, kNone}},
    {MissionSource::kRobustModelAided,
     0.5,
     {{kNone, kNone}, {kNone, kNone}},
     {kNone, kNone},
     {kNone, kNone}},
    {MissionSource::kRobustModelAidedOutliers,
     0.5,
     {{kNone, kNone}, {kNone, kNone}},
     {kNone, kNone},
     {kNone, kNone}},
};

/// mean +- error, and behind it the prototype's; where that has an error too, their distance in
/// standard errors.
void print(const Mean& mean, double value, double error) {
  std::printf(" %6.3f +- %.3f", mean.value(), mean.error());
  const double both = std::sqrt(mean.error() * mean.error() + error * error);
  if (std::isnan(value)) {
    std::printf("%14s", "");
  } else if (error > 0 && both > 0) {
    std::printf(" (%.3f, %4.1f)", value, (mean.value() - value) / both);
  } else {
    std::printf(" (%.3f)%6s", value, "");
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 50;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  std::printf(
      "%d runs, seed %llu; in brackets the prototype, and how many standard errors lie between\n",
      runs, static_cast<unsigned long long>(seed));
  for (int circle = 0; circle < 2; ++circle) {
    std::printf("%-32s settled [m]%17s all [m]%21s position [m]%9s interval [s], rudder [deg/s]\n",
                circle != 0 ? "circle" : "lawnmower", "", "", "");
    for (const Row& row : kRows) {
      const auto track = circle != 0 ? MissionTrack::kCircle : MissionTrack::kLawnmower;
      const auto scenario = auvest::mission_source(row.source, track, row.interval_s);
      Mean settled, all, position, interval, travel;
      int failed = 0;
      for (int run = 0; run < runs; ++run) {
        const auto result =
            auvest::fly_mission<double>(scenario, seed, static_cast<std::uint32_t>(run));
        if (result.status != auvest::Status::kOk || !result.finished) {
          ++failed;
          continue;
        }
        settled.add(result.settled_rms_m);
        all.add(result.all_rms_m);
        position.add(result.position_rms_m);
        interval.add(result.interval_s);
        travel.add(result.rudder_travel_rad_s * 57.29577951308232);
      }
      std::printf("%-28s %3.1f", auvest::name_of(row.source), row.interval_s);
      print(settled, row.settled[circle][0], row.settled[circle][1]);
      print(all, circle != 0 ? kNone : row.all[0], row.all[1]);
      print(position, row.position[circle], 0);
      std::printf("  %5.3f  %5.1f", interval.value(), travel.value());
      std::printf(failed > 0 ? "  %d failed\n" : "\n", failed);
      std::fflush(stdout);
    }
  }
  return 0;
}
