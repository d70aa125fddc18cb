// The closed loop: what it gives without noise to the digit, and with noise within its statistics.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "simulation/mission.hpp"

namespace {

using auvest::fly_mission;
using auvest::mission_source;
using auvest::MissionEstimate;
using auvest::MissionGuidance;
using auvest::MissionResult;
using auvest::MissionScenario;
using auvest::MissionSource;
using auvest::MissionStep;
using auvest::MissionTrack;
using auvest::Status;

constexpr double kDegree = 3.14159265358979323846 / 180;

/// Settled cross-track of the truth in the loop with the current towards 0, 90, 180 and 270
/// degrees, from two independent programs with hulls of their own.
struct NoiseFree {
  MissionTrack track;
  MissionSource source;
  double rms_m[4];
};
const NoiseFree kNoiseFree[] = {
    {MissionTrack::kLawnmower, MissionSource::kTruth, {0.21276, 0.03461, 0.28760, 0.08400}},
    {MissionTrack::kLawnmower, MissionSource::kTruthCrab, {0.02433, 0.03916, 0.03366, 0.03461}},
    {MissionTrack::kCircle, MissionSource::kTruth, {0.66629, 0.61628, 0.62046, 0.65019}},
    {MissionTrack::kCircle, MissionSource::kTruthCrab, {0.28200, 0.23366, 0.21574, 0.28037}},
};

template <class Scalar>
void check_noise_free(double tolerance) {
  for (const NoiseFree& expected : kNoiseFree) {
    for (int k = 0; k < 4; ++k) {
      MissionScenario s = mission_source(expected.source, expected.track);
      s.current_rad = 90 * k * kDegree;
      const MissionResult result = fly_mission<Scalar>(s, 1, 0);
      REQUIRE(result.status == Status::kOk);
      CHECK(result.finished);
      CAPTURE(k);
      CHECK(std::fabs(result.settled_rms_m - expected.rms_m[k]) < tolerance);
    }
  }
}

TEST_CASE("mission without noise: sixteen cross-track values") { check_noise_free<double>(1e-5); }

TEST_CASE("mission without noise: in float a leg may switch a step earlier or later") {
  // One step is 0.1 s; it moves a value by up to 0.0025 m (legs switch within millimetres of the
  // sampling grid), everything else by rounding.
  check_noise_free<float>(2.5e-3);
}

TEST_CASE("mission: arcs that the hull can fly take the corners out of the error") {
  MissionScenario corners = mission_source(MissionSource::kTruthCrab, MissionTrack::kLawnmower);
  corners.current_rad = 1;
  MissionScenario arcs = corners;
  arcs.arc_m = 19;  // the hull turns on 14.3 m
  arcs.settled_leg_m = 0;
  const MissionResult sharp = fly_mission<double>(corners, 1, 0);
  const MissionResult smooth = fly_mission<double>(arcs, 1, 0);
  REQUIRE(smooth.status == Status::kOk);
  CHECK(smooth.finished);
  CHECK(sharp.all_rms_m > 2.5);
  // What is left is the second in which the hull takes on the curvature.
  CHECK(smooth.all_rms_m < 0.4 * sharp.all_rms_m);
}

TEST_CASE(
    "mission: a course steered as a heading rests beside the line, the other laws come to it") {
  // A current across the lanes: e = Delta tan(crab), and for the vector field, whose slope at the
  // line is the same, tan(crab) / k, with sin(crab) = 0.3 / 1.5.
  MissionScenario s = mission_source(MissionSource::kTruth, MissionTrack::kLawnmower);
  s.current_rad = 90 * kDegree;
  const double beside = 10 * std::tan(std::asin(0.2));
  for (const auto law : {MissionGuidance::kLineOfSight, MissionGuidance::kVectorField}) {
    s.guidance = law;
    const MissionResult r = fly_mission<double>(s, 1, 0);
    REQUIRE(r.status == Status::kOk);
    CHECK(r.finished);
    CHECK(r.settled_rms_m == close_to(beside, 0.05));
  }
  s.guidance = MissionGuidance::kIntegral;
  const MissionResult r = fly_mission<double>(s, 1, 0);
  REQUIRE(r.status == Status::kOk);
  CHECK(r.settled_rms_m < 0.5 * beside);
}

TEST_CASE("mission: fewer degrees of freedom fly the same plan") {
  // The planar hull lacks the roll that lowers the sway inertia by 4 %: close, not equal.
  MissionScenario s = mission_source(MissionSource::kTruthCrab, MissionTrack::kCircle);
  s.current_rad = 1;
  const double six = fly_mission<double>(s, 1, 0).settled_rms_m;
  for (const MissionResult& r : {fly_mission<double, auvest::FiveDof>(s, 1, 0),
                                 fly_mission<double, auvest::FourDof>(s, 1, 0),
                                 fly_mission<double, auvest::ThreeDof>(s, 1, 0)}) {
    REQUIRE(r.status == Status::kOk);
    CHECK(r.settled_rms_m != six);
    CHECK(std::fabs(r.settled_rms_m - six) < 0.02 * six);
  }
}

struct Spread {
  double mean = 0;
  double error = 0;  ///< standard error
  double position = 0;
  double interval = 0;
};

Spread fly_runs(const MissionScenario& scenario, int runs) {
  Spread spread;
  double squares = 0;
  for (int run = 0; run < runs; ++run) {
    const MissionResult r = fly_mission<double>(scenario, 11, static_cast<std::uint32_t>(run));
    REQUIRE(r.status == Status::kOk);
    REQUIRE(r.finished);
    spread.mean += r.settled_rms_m / runs;
    squares += r.settled_rms_m * r.settled_rms_m / runs;
    spread.position += r.position_rms_m / runs;
    spread.interval += r.interval_s / runs;
  }
  spread.error = std::sqrt((squares - spread.mean * spread.mean) / (runs - 1));
  return spread;
}

TEST_CASE("mission with noise: each estimate within its statistics, over some runs" *
          doctest::test_suite("statistics")) {
  // Mean and standard error of 50 runs of an independent prototype; here of 12 with other seeds.
  struct Case {
    MissionSource source;
    MissionTrack track;
    double interval_s, mean, error, position;
  };
  const auto lawnmower = MissionTrack::kLawnmower;
  const auto circle = MissionTrack::kCircle;
  const Case cases[] = {
      {MissionSource::kTruth, lawnmower, 0.5, 0.174, 0.018, 0},
      {MissionSource::kFixes, lawnmower, 0.5, 0.677, 0.026, 2.32},
      {MissionSource::kUkf, lawnmower, 0.5, 0.580, 0.015, 1.20},
      {MissionSource::kAukfLaw, lawnmower, 0.506, 0.599, 0.016, 1.21},
      {MissionSource::kAukfBudget, circle, 0.506, 0.873, 0.014, 1.01},
      {MissionSource::kModelAided, circle, 0.5, 0.735, 0.011, 0.46},
      {MissionSource::kModelAidedCrab, lawnmower, 0.5, 0.265, 0.010, 0.42},
      {MissionSource::kUkfDefaultPsd, lawnmower, 0.5, 1.384, 0.053, 2.27},
      {MissionSource::kUkfOutliers, lawnmower, 0.5, 1.191, 0.056, 4.18},
      {MissionSource::kModelAidedOutliers, lawnmower, 0.5, 0.684, 0.031, 2.82},
  };
  for (const Case& c : cases) {
    CAPTURE(auvest::name_of(c.source));
    const Spread found = fly_runs(mission_source(c.source, c.track), 12);
    const double both = std::sqrt(found.error * found.error + c.error * c.error);
    CHECK(std::fabs(found.mean - c.mean) < 3.5 * both);
    CHECK(std::fabs(found.position - c.position) < 0.12 * c.position + 1e-12);
    if (c.source != MissionSource::kTruth) {
      CHECK(std::fabs(found.interval - c.interval_s) < 0.02);
    }
  }
}

TEST_CASE("mission: the robust update keeps late outliers out of the loop") {
  const auto lawnmower = MissionTrack::kLawnmower;
  const double clean =
      fly_runs(mission_source(MissionSource::kRobustModelAided, lawnmower), 12).mean;
  const double dirty =
      fly_runs(mission_source(MissionSource::kRobustModelAidedOutliers, lawnmower), 12).mean;
  const double plain =
      fly_runs(mission_source(MissionSource::kModelAidedOutliers, lawnmower), 12).mean;
  CHECK(clean < 0.36);
  CHECK(dirty < 1.2 * clean);
  CHECK(plain > 1.5 * dirty);
}

/// How often the mean over 50 runs of a number per fix is within the 95 % bounds of chi-square.
double share_within(const std::vector<double>& sums, double low, double high) {
  int inside = 0;
  for (const double sum : sums) inside += sum / 50 >= low && sum / 50 <= high ? 1 : 0;
  return inside / static_cast<double>(sums.size());
}

TEST_CASE("mission: the model-aided filter knows how far off it is, where its model holds" *
          doctest::test_suite("statistics")) {
  // A compass without bias, a current that walks as the filter thinks, and the noise of the log in
  // q: 0.05 m/s at 10 Hz are 2.5e-4 m^2/s, the heading's noise adds 2e-5.
  MissionScenario s = mission_source(MissionSource::kModelAidedCrab, MissionTrack::kCircle);
  s.compass.bias_rad = 0;
  s.current_walk = s.model.current;
  s.model.position = 2.7e-4;
  const std::size_t fixes = 600;
  double share[3] = {0, 0, 0};
  for (const std::uint64_t seed :
       {3u, 4u, 5u, 6u}) {  // errors last for minutes: one set is one draw
    std::vector<double> position(fixes), all(fixes), innovation(fixes);
    for (std::uint32_t run = 0; run < 50; ++run) {
      std::size_t k = 0;
      const auto r = fly_mission<double>(s, seed, run, [&](const MissionStep& step) {
        if (!step.fixed || k >= fixes) return;
        position[k] += step.nees_position;
        all[k] += step.nees;
        innovation[k] += step.nis;
        ++k;
      });
      REQUIRE(r.status == Status::kOk);
      REQUIRE(k == fixes);
    }
    // Chi-square of 100 and 200 degrees of freedom at 2.5 and 97.5 %, over 50.
    share[0] += share_within(position, 1.4844, 2.5912) / 4;
    share[1] += share_within(innovation, 1.4844, 2.5912) / 4;
    share[2] += share_within(all, 3.2546, 4.8212) / 4;
  }
  for (const double inside : share) CHECK(inside > 0.9);
}

TEST_CASE("mission: the default noise covers a compass that is off by a degree") {
  MissionScenario s = mission_source(MissionSource::kModelAidedCrab, MissionTrack::kLawnmower);
  s.model.position = auvest::SpeedHeadingCurrent<double>::Params().position;
  double position = 0;
  double all = 0;
  int steps = 0;
  for (std::uint32_t run = 0; run < 50; ++run) {
    const auto r = fly_mission<double>(s, 3, run, [&](const MissionStep& step) {
      position += step.nees_position;
      all += step.nees;
      ++steps;
    });
    REQUIRE(r.status == Status::kOk);
  }
  // Means of 2 and 4 are due. The bias is in no state and single runs leave the bounds; on the
  // whole neither the position is claimed too well nor the current.
  CHECK(position / steps > 1.2);
  CHECK(position / steps < 2);
  CHECK(all / steps > 3);
  CHECK(all / steps < 4.5);
}

TEST_CASE("mission: late fixes are taken at their own time") {
  // An answer that takes its time: valid at t + r/c, known at t + 2 r/c. Half a second more on top.
  MissionScenario s = mission_source(MissionSource::kModelAidedCrab, MissionTrack::kLawnmower, 1.0);
  const double at_once = fly_runs(s, 6).position;
  s.usbl.sound_m_s = 1500;
  s.usbl_timing.latency_s = 0.5;
  CHECK(fly_runs(s, 6).position < 1.15 * at_once);
  // A UKF of constant acceleration has more to predict. But taken as fresh, a fix that is 1.5 s old
  // would alone put it 1.5 m/s times 1.5 s behind.
  s = mission_source(MissionSource::kUkf, MissionTrack::kLawnmower, 0.5);
  s.usbl.sound_m_s = 1500;
  s.usbl_timing.latency_s = 1.5;
  CHECK(fly_runs(s, 6).position < 1.5 * 1.5);
}

TEST_CASE("mission: the interval policy decides when to ask") {
  MissionScenario s = mission_source(MissionSource::kAukfLaw, MissionTrack::kCircle);
  double shortest = 9;
  double longest = 0;
  fly_mission<double>(s, 1, 0, [&](const MissionStep& step) {
    shortest = std::fmin(shortest, step.interval_s);
    longest = std::fmax(longest, step.interval_s);
  });
  CHECK(shortest < 0.3);
  CHECK(longest > 0.7);
  // A wider budget asks less often.
  s = mission_source(MissionSource::kAukfBudget, MissionTrack::kCircle);
  const double tight = fly_mission<double>(s, 1, 0).interval_s;
  s.interval.budget.params.position_sigma_m *= 1.3;
  CHECK(fly_mission<double>(s, 1, 0).interval_s > 1.3 * tight);
}

TEST_CASE("mission: lost fixes are asked for again") {
  MissionScenario s = mission_source(MissionSource::kModelAidedCrab, MissionTrack::kCircle);
  s.usbl_timing.dropout = 0.5;
  const MissionResult r = fly_mission<double>(s, 1, 0);
  REQUIRE(r.status == Status::kOk);
  CHECK(std::fabs(r.interval_s - 1.0) < 0.1);  // half of those asked every 0.5 s
  s.usbl_timing.dropout = 1;                   // and without any it dead-reckons to the end
  const MissionResult blind = fly_mission<double>(s, 1, 0);
  REQUIRE(blind.status == Status::kOk);
  CHECK(blind.fixes == 0);
  CHECK(blind.finished);
}

TEST_CASE("mission: a run is a function of seed and number") {
  const MissionScenario s = mission_source(MissionSource::kAukfLaw, MissionTrack::kCircle);
  const auto trace = [&](std::uint64_t seed, std::uint32_t run) {
    std::vector<double> numbers;
    fly_mission<float>(s, seed, run, [&](const MissionStep& step) {
      numbers.push_back(step.cross_m);
      numbers.push_back(step.command[0]);
    });
    return numbers;
  };
  const auto once = trace(4, 2);
  CHECK(once.size() == 2 * 3400);
  CHECK(once == trace(4, 2));
  CHECK(once != trace(4, 3));
  CHECK(once != trace(5, 2));
}

TEST_CASE("mission: all sources share current, noise and start of a run") {
  std::vector<double> currents;
  for (const auto source :
       {MissionSource::kTruth, MissionSource::kUkf, MissionSource::kModelAided}) {
    bool first = true;
    fly_mission<double>(mission_source(source, MissionTrack::kCircle), 9, 5,
                        [&](const MissionStep& step) {
                          if (first) currents.push_back(step.current_m_s[0]);
                          first = false;
                        });
  }
  REQUIRE(currents.size() == 3);
  CHECK(currents[0] == currents[1]);
  CHECK(currents[0] == currents[2]);
}

TEST_CASE("mission: scenarios that cannot be flown are refused") {
  MissionScenario s = mission_source(MissionSource::kUkf, MissionTrack::kLawnmower);
  s.guidance = MissionGuidance::kCrab;  // of a current that this filter does not know
  CHECK(fly_mission<double>(s, 1, 0).status == Status::kBadParameter);
  s = mission_source(MissionSource::kTruth, MissionTrack::kLawnmower);
  s.arc_m = 25;  // no room on legs of 40 m
  CHECK(fly_mission<double>(s, 1, 0).status == Status::kBadParameter);
  s = mission_source(MissionSource::kModelAided, MissionTrack::kCircle);
  s.model.position = -1;
  CHECK(fly_mission<double>(s, 1, 0).status == Status::kBadParameter);
  s = mission_source(MissionSource::kTruth, MissionTrack::kCircle);
  s.period_s = 0;
  CHECK(fly_mission<double>(s, 1, 0).status == Status::kBadParameter);
  s.period_s = 0.1;
  s.lookahead_m = 0;
  CHECK(fly_mission<double>(s, 1, 0).status == Status::kBadParameter);
  // A track that it cannot finish is not finished, and no failure.
  s = mission_source(MissionSource::kTruth, MissionTrack::kLawnmower);
  s.most_s = 30;
  const MissionResult r = fly_mission<double>(s, 1, 0);
  CHECK(r.status == Status::kOk);
  CHECK(!r.finished);
}

}  // namespace
