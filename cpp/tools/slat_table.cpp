// The RMSE of dead reckoning, SLATF 1.0 and 2.0 and EKF-SLAT over the noise levels of the SLATF
// paper, in configuration R1 (docs/algorithms/slatf.md).
//
//     slat_table [runs] [particles]     prints means and standard errors in metres
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "auvest/auvest.hpp"
#include "auvest/scenarios/slat.hpp"

namespace {

using Scalar = double;
using Motion = auvest::CompassMotion<Scalar>;
using Master = auvest::PiecewiseAcceleration<Scalar>;
using Slatf1 = auvest::Slatf1<Motion, Master, 1>;
using Slatf2 = auvest::Slatf2<Motion, Master, 1>;

struct Column {
  const char* name;
  double sum = 0;
  double squares = 0;
  int runs = 0;

  explicit Column(const char* title) : name(title) {}
  void add(double value) {
    sum += value;
    squares += value * value;
    ++runs;
  }
  double mean() const { return sum / runs; }
  double error() const { return std::sqrt((squares / runs - mean() * mean()) / runs); }
};

/// Root mean square of the slave's position error over the pings of one run.
template <class Filter>
double rmse(Filter& filter, const auvest::SlatScenario& scenario, int run) {
  auvest::Sonar<Scalar>::Params sonar;
  sonar.sigma_range_m = scenario.sigma_range_m;
  sonar.sigma_bearing_rad = scenario.sigma_bearing_rad;
  auvest::math::Random world(1, 2 * static_cast<std::uint64_t>(run));
  auvest::math::Random random(1, 2 * static_cast<std::uint64_t>(run) + 1);
  double square = 0;
  int pings = 0;
  const auvest::Status status =
      auvest::run_slat(filter, auvest::Sonar<Scalar>(sonar), scenario, world, random,
                       [&](const auvest::SlatStep<Filter>& step) {
                         const auto x = filter.slave().x;
                         for (int i = 0; i < 2; ++i) {
                           const double e = x(i) - step.slave.position[i];
                           square += e * e;
                         }
                         ++pings;
                       });
  if (status != auvest::Status::kOk) {
    std::fprintf(stderr, "slat_table: %s\n", auvest::describe(status));
    std::exit(1);
  }
  return std::sqrt(square / pings);
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 50;
  const int particles = argc > 2 ? std::atoi(argv[2]) : 100;
  if (argc > 3 || runs < 1 || particles < 1) {
    std::fputs("usage: slat_table [runs >= 1] [particles >= 1]\n", stderr);
    return 2;
  }
  // Section 7: standard deviations of range [m] and bearing [rad] of levels 1 to 7.
  const double levels[7][2] = {{15, 0.4},   {10, 0.3},   {1, 0.06},   {0.5, 0.03},
                               {1.5, 0.09}, {0.8, 0.05}, {0.3, 0.015}};
  std::vector<Scalar> storage1(Slatf1::Set::storage_size(particles));
  std::vector<Scalar> storage2(Slatf2::Set::storage_size(particles));
  Motion::Params plain;
  plain.compensate_bias = false;
  std::printf("%d runs, N = %d, RMSE in m\nlevel", runs, particles);
  for (int level = 0; level < 7; ++level) {
    auvest::SlatScenario scenario;
    scenario.sigma_range_m = levels[level][0];
    scenario.sigma_bearing_rad = levels[level][1];
    Column columns[5] = {Column("dead reckoning"), Column("compensated"), Column("SLATF 1.0"),
                         Column("SLATF 2.0"), Column("EKF-SLAT")};
    for (int run = 0; run < runs; ++run) {
      auvest::DeadReckoning<Motion> reckoning((Motion(plain)));
      auvest::DeadReckoning<Motion> compensated((Motion()));
      Slatf1 slatf1(Motion(), Master(), Slatf1::Params(), storage1.data(), particles);
      Slatf2 slatf2(Motion(), Master(), Slatf2::Params(), storage2.data(), particles);
      auvest::EkfSlat<Motion, Master, 1> ekf((Motion()), Master());
      columns[0].add(rmse(reckoning, scenario, run));
      columns[1].add(rmse(compensated, scenario, run));
      columns[2].add(rmse(slatf1, scenario, run));
      columns[3].add(rmse(slatf2, scenario, run));
      columns[4].add(rmse(ekf, scenario, run));
    }
    if (level == 0) {
      for (const Column& column : columns) std::printf("  %16s", column.name);
      std::printf("\n");
    }
    std::printf("%5d", level + 1);
    for (const Column& column : columns) {
      std::printf("    %6.1f +- %4.1f", column.mean(), column.error());
    }
    std::printf("\n");
  }
}
