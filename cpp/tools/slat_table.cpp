// The RMSE of dead reckoning, SLATF 1.0 and 2.0, SlatfJoint and EKF-SLAT over the noise levels of
// the SLATF paper, in configuration R1 (docs/algorithms/slatf.md), and whether they know how far
// off they are: the NEES of the slave's position, 2 on average for a consistent filter.
//
//     slat_table [runs] [particles] [kept]     prints means and standard errors in metres
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "auvest/auvest.hpp"
#include "simulation/slat.hpp"

namespace {

using Scalar = double;
using Motion = auvest::CompassMotion<Scalar>;
using Master = auvest::PiecewiseAcceleration<Scalar>;
using Slatf1 = auvest::Slatf1<Motion, Master, 1>;
using Slatf2 = auvest::Slatf2<Motion, Master, 1>;
using SlatfJoint = auvest::SlatfJoint<Motion, Master, 1>;
using SlatfShared = auvest::SlatfShared<Motion, Master, 1>;

constexpr double kBound95 = 5.991;  // chi-square, 2 degrees of freedom

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
  double error() const { return std::sqrt((squares / runs - value() * value()) / runs); }
};

struct Column {
  const char* name;
  Mean rmse;    ///< of the slave's position over the pings of a run
  Mean inside;  ///< share of a run's pings with the slave's NEES inside its 95 % bound

  explicit Column(const char* title) : name(title) {}
};

template <class Filter>
void run(Filter& filter, const auvest::SlatScenario& scenario, int number, Column& column) {
  auvest::Sonar<Scalar>::Params sonar;
  sonar.sigma_range_m = scenario.sigma_range_m;
  sonar.sigma_bearing_rad = scenario.sigma_bearing_rad;
  auvest::math::Random world(1, 2 * static_cast<std::uint64_t>(number));
  auvest::math::Random random(1, 2 * static_cast<std::uint64_t>(number) + 1);
  double square = 0;
  int inside = 0;
  int pings = 0;
  const auvest::Status status = auvest::run_slat(
      filter, auvest::Sonar<Scalar>(sonar), scenario, world, random,
      [&](const auvest::SlatStep<Filter>& step) {
        const auto slave = filter.slave();
        const double x = slave.x(0) - step.slave.position[0];
        const double y = slave.x(1) - step.slave.position[1];
        const auto& P = slave.P;
        const double determinant = P(0, 0) * P(1, 1) - P(1, 0) * P(1, 0);
        square += x * x + y * y;
        inside += P(1, 1) * x * x - 2 * P(1, 0) * x * y + P(0, 0) * y * y < kBound95 * determinant
                      ? 1
                      : 0;
        ++pings;
      });
  if (status != auvest::Status::kOk) {
    std::fprintf(stderr, "slat_table: %s\n", auvest::describe(status));
    std::exit(1);
  }
  column.rmse.add(std::sqrt(square / pings));
  column.inside.add(static_cast<double>(inside) / pings);
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 50;
  const int particles = argc > 2 ? std::atoi(argv[2]) : 100;
  // As in the paper, without a gate; the shared covariance as it is shown first, with one.
  SlatfJoint::Params joint_params;
  auvest::EkfSlat<Motion, Master, 1>::Params ekf_params;
  Slatf1::Params params;
  joint_params.gate = ekf_params.gate = params.gate = 0;
  params.monte_carlo = false;
  if (argc > 3) joint_params.kept = std::atof(argv[3]);
  if (argc > 4 || runs < 1 || particles < 1 ||
      !(joint_params.kept >= 0 && joint_params.kept <= 1)) {
    std::fputs("usage: slat_table [runs >= 1] [particles >= 1] [kept, 0 to 1]\n", stderr);
    return 2;
  }
  // Section 7: standard deviations of range [m] and bearing [rad] of levels 1 to 7.
  const double levels[7][2] = {{15, 0.4},   {10, 0.3},   {1, 0.06},   {0.5, 0.03},
                               {1.5, 0.09}, {0.8, 0.05}, {0.3, 0.015}};
  std::vector<Scalar> storage1(Slatf1::Set::storage_size(particles));
  std::vector<Scalar> storage2(Slatf2::Set::storage_size(particles));
  std::vector<Scalar> storage_joint(SlatfJoint::Set::storage_size(particles));
  std::vector<Scalar> storage_shared(SlatfShared::Set::storage_size(particles));
  Motion::Params plain;
  plain.compensate_bias = false;
  std::printf("%d runs, N = %d, kept = %g: RMSE in m (NEES inside its 95 %% bound)\nlevel", runs,
              particles, joint_params.kept);
  for (int level = 0; level < 7; ++level) {
    auvest::SlatScenario scenario;
    scenario.sigma_range_m = levels[level][0];
    scenario.sigma_bearing_rad = levels[level][1];
    Column columns[7] = {Column("dead reckoning"), Column("compensated"), Column("SLATF 1.0"),
                         Column("SLATF 2.0"),      Column("SlatfJoint"),  Column("SlatfShared"),
                         Column("EKF-SLAT")};
    for (int k = 0; k < runs; ++k) {
      auvest::DeadReckoning<Motion> reckoning((Motion(plain)));
      auvest::DeadReckoning<Motion> compensated((Motion()));
      Slatf1 slatf1(Motion(), Master(), params, storage1.data(), particles);
      Slatf2 slatf2(Motion(), Master(), params, storage2.data(), particles);
      SlatfJoint joint(Motion(), Master(), joint_params, storage_joint.data(), particles);
      SlatfShared shared(Motion(), Master(), SlatfShared::Params(), storage_shared.data(),
                         particles);
      auvest::EkfSlat<Motion, Master, 1> ekf((Motion()), Master(), ekf_params);
      run(reckoning, scenario, k, columns[0]);
      run(compensated, scenario, k, columns[1]);
      run(slatf1, scenario, k, columns[2]);
      run(slatf2, scenario, k, columns[3]);
      run(joint, scenario, k, columns[4]);
      run(shared, scenario, k, columns[5]);
      run(ekf, scenario, k, columns[6]);
    }
    if (level == 0) {
      for (const Column& column : columns) std::printf("  %20s", column.name);
      std::printf("\n");
    }
    std::printf("%5d", level + 1);
    for (const Column& column : columns) {
      std::printf("  %7.1f +- %3.1f (%2.0f %%)", column.rmse.value(), column.rmse.error(),
                  100 * column.inside.value());
    }
    std::printf("\n");
  }
}
