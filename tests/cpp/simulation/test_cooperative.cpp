// The cooperative scenario: accuracy beside the reference table, and consistency.
#include <doctest/doctest.h>

#include "close.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "auvest/auvest.hpp"
#include "simulation/cooperative.hpp"

namespace {

using auvest::CooperativeScenario;
using auvest::Matrix;
using auvest::Status;
using auvest::Vector;
using auvest::math::Random;

using Process = auvest::SpeedHeading<double>;
using Range = auvest::LeaderRange<double, 2>;
using Ekf = auvest::Ekf<Process>;
using RobustEkf = auvest::RobustEkf<Process>;
using Streak = auvest::RejectionStreak<double>;
template <class Kernel>
using With = auvest::RobustEkf<Process, Kernel>;

/// Sums over runs, every step of dead reckoning counted for the error and NEES, every range for
/// NIS.
struct Sums {
  double square = 0, nees = 0, nis = 0;
  long steps = 0, ranges = 0;

  double rmse() const { return std::sqrt(square / double(steps)); }
  double mean_nis() const { return nis / double(ranges); }

  template <class Step>
  void operator()(const Step& step) {
    const double ex = step.filter.x()(0) - step.fleet.position[0];
    const double ey = step.filter.x()(1) - step.fleet.position[1];
    square += ex * ex + ey * ey;
    ++steps;
    if (step.correction == nullptr) return;
    nis += step.correction->nis;
    ++ranges;
  }
};

struct Nees {
  double last = 0;

  template <class Step>
  void operator()(const Step& step) {
    const double ex = step.filter.x()(0) - step.fleet.position[0];
    const double ey = step.filter.x()(1) - step.fleet.position[1];
    const Matrix<double, 2, 2> p = step.filter.P();
    last = (ex * ex * p(1, 1) - 2 * ex * ey * p(1, 0) + ey * ey * p(0, 0)) /
           (p(0, 0) * p(1, 1) - p(1, 0) * p(1, 0));
  }
};

template <class Filter, class Sink>
void run(Filter filter, const CooperativeScenario& scenario, const Range& range, std::uint64_t seed,
         std::uint32_t steps, Sink& sink) {
  const Matrix<double, 2, 2> P0 = Matrix<double, 2, 2>::Identity();
  REQUIRE(filter.reset(Vector<double, 2>(0, 0), P0) == Status::kOk);
  Random random(seed);
  REQUIRE(auvest::cooperate(filter, range, scenario, random, steps, sink) == Status::kOk);
}

template <class Filter>
double rmse(double fraction, double outlier_sigma_m) {
  CooperativeScenario scenario;
  scenario.noise.outlier_fraction = fraction;
  scenario.noise.outlier_sigma_m = outlier_sigma_m;
  Sums sums;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    run(Filter(Ekf(Process())), scenario, Range(), seed, 8280, sums);  // 2.3 h
  }
  return sums.rmse();
}

TEST_CASE("cooperative: RMSE over contamination, within 10 % of the reference" *
          doctest::test_suite("statistics")) {
  // Reference: a prototype of the same case, other random numbers, 20 runs.
  struct Row {
    double fraction, outlier_sigma_m, ekf, igg, huber;
  };
  for (const Row& row : {Row{0, 10, 0.95, 0.97, 0.96}, Row{0.05, 10, 1.63, 0.99, 1.00},
                         Row{0.1, 10, 2.19, 1.00, 1.05}, Row{0.2, 10, 2.97, 1.03, 1.14},
                         Row{0.1, 30, 6.04, 0.99, 1.06}}) {
    CAPTURE(row.fraction);
    CAPTURE(row.outlier_sigma_m);
    const double ekf = rmse<Ekf>(row.fraction, row.outlier_sigma_m);
    const double igg = rmse<RobustEkf>(row.fraction, row.outlier_sigma_m);
    const double huber = rmse<With<auvest::Huber<double>>>(row.fraction, row.outlier_sigma_m);
    CHECK(ekf == close_to(row.ekf, 0.1));
    CHECK(igg == close_to(row.igg, 0.1));
    CHECK(huber == close_to(row.huber, 0.1));
    if (row.fraction == 0) {
      CHECK(igg < 1.03 * ekf);  // at most 3 % lost on clean data
    } else {
      CHECK(igg < 0.7 * ekf);  // at least 30 % gained
    }
  }
}

// ---- Consistency
// ---------------------------------------------------------------------------------

struct Consistency {
  double nees = 0;  ///< mean over runs, at the last step: 2 expected
  double nis = 0;   ///< mean over runs and ranges: 1 expected
};

const int kRuns = 200;
const std::uint32_t kSteps = 1500;

/// Noise of the true process and range, beside what the filter is told, multiplied in variance.
template <class Filter>
Consistency consistency(double q_factor, double r_factor) {
  Process::Params process;
  process.sigma_forward *= std::sqrt(q_factor);
  process.sigma_heading *= std::sqrt(q_factor);
  Range::Params range;
  range.sigma_range_m *= std::sqrt(r_factor);
  Consistency mean;
  Sums sums;
  for (int k = 0; k < kRuns; ++k) {
    const auto seed = static_cast<std::uint64_t>(k + 1);
    Nees nees;
    run(Filter(typename auvest::Ekf<Process>(Process(process))), CooperativeScenario(),
        Range(range), seed, kSteps, nees);
    mean.nees += nees.last / kRuns;
    run(Filter(typename auvest::Ekf<Process>(Process(process))), CooperativeScenario(),
        Range(range), seed, kSteps, sums);
  }
  mean.nis = sums.mean_nis();
  return mean;
}

// 95 % bounds of chi-square means. NEES: 400 degrees of freedom over 200 runs, 346.5 .. 457.3.
// NIS: 60000 degrees of freedom, innovations being white: 1 +- 1.96 sqrt(2 / 60000).
bool nees_within(const Consistency& c) { return c.nees > 1.732 && c.nees < 2.287; }
bool nis_within(const Consistency& c) { return std::fabs(c.nis - 1) < 0.0113; }

template <class Filter>
void check_consistency() {
  const Consistency matched = consistency<Filter>(1, 1);
  CAPTURE(matched.nees);
  CAPTURE(matched.nis);
  CHECK(nees_within(matched));
  CHECK(nis_within(matched));
  // The test of the test: a factor of 4 in Q or R, either way, is seen by both.
  const double factors[4][2] = {{4, 1}, {0.25, 1}, {1, 4}, {1, 0.25}};
  for (const auto& factor : factors) {
    const Consistency wrong = consistency<Filter>(factor[0], factor[1]);
    CAPTURE(factor[0]);
    CAPTURE(factor[1]);
    CAPTURE(wrong.nees);
    CAPTURE(wrong.nis);
    CHECK_FALSE(nees_within(wrong));
    CHECK_FALSE(nis_within(wrong));
  }
}

TEST_CASE("cooperative: NEES and NIS lie in their bounds, and outside with a wrong Q or R" *
          doctest::test_suite("statistics")) {
  check_consistency<Ekf>();
  check_consistency<RobustEkf>();
}

TEST_CASE("cooperative: same seed, same run") {
  CooperativeScenario scenario;
  scenario.noise.outlier_fraction = 0.1;
  Sums a, b, c;
  run(RobustEkf(Ekf(Process())), scenario, Range(), 1, 500, a);
  run(RobustEkf(Ekf(Process())), scenario, Range(), 1, 500, b);
  run(RobustEkf(Ekf(Process())), scenario, Range(), 2, 500, c);
  CHECK(a.steps == 500);
  CHECK(a.ranges == 100);
  CHECK(a.square == b.square);
  CHECK(a.square != c.square);
}

// ---- Messages
// ---------------------------------------------------------------------------------

/// Sums over a run; a correction is reported at the steps that took a range, and is of one.
struct Messages {
  auvest::MessageCounts sum;

  template <class Step>
  void operator()(const Step& step) {
    sum.taken += step.messages.taken;
    sum.too_late += step.messages.too_late;
    sum.lost += step.messages.lost;
    sum.overflowed += step.messages.overflowed;
    REQUIRE((step.correction != nullptr) == (step.messages.taken > 0));
    if (step.correction != nullptr) {
      REQUIRE(step.correction->status == Status::kOk);
      REQUIRE(step.correction->weight(0) > 0);  // the kernel is the unit kernel
    }
  }
};

/// The same draws, and nothing but messages that come and go: lost ones, those beyond eight, those
/// that arrive, and those on their way at the end.
struct Journeys {
  std::uint32_t lost = 0, overflowed = 0, arrived = 0;
  std::vector<std::uint32_t> pending;  ///< when they arrive

  Journeys(const CooperativeScenario& scenario, std::uint64_t seed, std::uint32_t steps) {
    Random random(seed);
    for (std::uint32_t k = 1; k <= steps; ++k) {
      double speed, heading;
      random.normal_pair(speed, heading);
      if (k % scenario.range_every == 0) {
        scenario.noise.draw(random);
        const bool in_water = random.uniform<double>() < scenario.dropout;
        std::uint32_t arrives = k + 2 * scenario.range_every;
        if (random.uniform<double>() < scenario.late) {
          arrives += 1 + static_cast<std::uint32_t>(random.uniform<double>() * scenario.late_steps);
        }
        if (in_water) {
          ++lost;
        } else if (pending.size() == 8) {
          ++overflowed;
        } else {
          pending.push_back(arrives);
        }
      }
      const auto here = std::remove(pending.begin(), pending.end(), k);
      arrived += static_cast<std::uint32_t>(pending.end() - here);
      pending.erase(here, pending.end());
    }
  }
};

TEST_CASE("cooperative: every message is counted once, whatever becomes of it") {
  struct Case {
    std::uint32_t range_every, late_steps;
    double dropout;
    bool overflows, comes_too_late;
  };
  const std::uint32_t steps = 2000;
  for (const Case& c : {Case{5, 10, 0.2, false, false},  // the defaults
                        Case{1, 5, 0.2, false, false},   // 7 steps under way at most: 8 at once
                        Case{1, 6, 0.2, true, false},    // 8 steps: a ninth is sent meanwhile
                        Case{8, 100, 0.1, true, true}}) {
    CAPTURE(c.range_every);
    CAPTURE(c.late_steps);
    CooperativeScenario scenario;
    scenario.timing = auvest::RangeTiming::kOwnTime;
    scenario.range_every = c.range_every;
    scenario.late = 0.9;
    scenario.late_steps = c.late_steps;
    scenario.dropout = c.dropout;
    const Journeys expected(scenario, 3, steps);
    Messages messages;
    run(With<auvest::Unit<double>>(Ekf(Process())), scenario, Range(), 3, steps, messages);
    CHECK(messages.sum.lost == expected.lost);
    CHECK(messages.sum.overflowed == expected.overflowed);
    CHECK(messages.sum.taken + messages.sum.too_late == expected.arrived);
    CHECK(messages.sum.taken > 0);
    CHECK(messages.sum.lost > 0);
    CHECK((messages.sum.overflowed > 0) == c.overflows);
    CHECK((messages.sum.too_late > 0) == c.comes_too_late);
    CHECK(expected.lost + expected.overflowed + expected.arrived + expected.pending.size() ==
          steps / c.range_every);
  }
}

TEST_CASE("cooperative: range noise has its two sizes") {
  auvest::RangeNoise noise;
  noise.outlier_fraction = 0.2;
  Random random(6);
  const int n = 200000;
  double square = 0;
  for (int k = 0; k < n; ++k) {
    const double e = noise.draw(random);
    square += e * e / n;
  }
  CHECK(square == close_to(0.8 * 1 + 0.2 * 100, 0.03));  // 2 % is three standard errors
}

}  // namespace
