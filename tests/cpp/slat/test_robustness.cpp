// What must not break a SLAT filter: outliers, dropouts, silence, underflow. Never a NaN,
// covariances positive, and the estimate comes back.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/scenarios/slat.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/slatf.hpp"

namespace {

using auvest::SlatScenario;
using auvest::Status;
using auvest::math::Random;
using Compass = auvest::CompassMotion<float>;
using Master = auvest::PiecewiseAcceleration<float>;
using Slatf1 = auvest::Slatf1<Compass, Master, 1>;
using Slatf2 = auvest::Slatf2<Compass, Master, 1>;
using Ekf = auvest::EkfSlat<Compass, Master, 1>;

/// Float filters with N = 100 and a gate of 16.
template <class Filter>
struct Gated {
  std::vector<float> storage;
  Filter filter;
  Gated()
      : storage(Filter::Set::storage_size(100)),
        filter(Compass(), Master(), params(), storage.data(), 100) {}
  static auvest::SlatfParams<float> params() {
    auvest::SlatfParams<float> p;
    p.gate = 16;
    return p;
  }
};

template <>
struct Gated<Ekf> {
  Ekf filter;
  Gated() : filter(Compass(), Master(), params()) {}
  static Ekf::Params params() {
    Ekf::Params p;
    p.gate = 16;
    return p;
  }
};

struct Result {
  double rmse;          ///< of the slave's position over the run [m]
  double relative_end;  ///< error of master - slave at the end [m]
};

/// Mean over runs; every step's numbers are checked.
template <class Filter>
Result run(const SlatScenario& scenario) {
  Result result = {0, 0};
  const int runs = 10;
  auvest::Sonar<float>::Params sonar;
  sonar.sigma_range_m = static_cast<float>(scenario.sigma_range_m);
  sonar.sigma_bearing_rad = static_cast<float>(scenario.sigma_bearing_rad);
  for (int k = 0; k < runs; ++k) {
    Gated<Filter> owner;
    Filter& filter = owner.filter;
    Random world(7, static_cast<std::uint64_t>(k));
    Random random(8, static_cast<std::uint64_t>(k));
    double square = 0;
    double relative = 0;
    int steps = 0;
    const Status status = auvest::run_slat(
        filter, auvest::Sonar<float>(sonar), scenario, world, random,
        [&](const auvest::SlatStep<Filter>& step) {
          const auto slave = filter.slave();
          const auto master = filter.master(0);
          relative = 0;
          for (int i = 0; i < 2; ++i) {
            REQUIRE(std::isfinite(slave.x(i)));
            REQUIRE(slave.P(i, i) > 0);
            const double e = static_cast<double>(slave.x(i)) - step.slave.position[i];
            const double m = static_cast<double>(master.x(i)) - step.masters[0].position[i];
            square += e * e;
            relative += (m - e) * (m - e);
          }
          for (int i = 0; i < 6; ++i) REQUIRE(std::isfinite(master.x(i)));
          REQUIRE(auvest::math::is_positive_definite(master.P));
          ++steps;
        });
    REQUIRE(status == Status::kOk);
    result.rmse += std::sqrt(square / steps) / runs;
    result.relative_end += std::sqrt(relative) / runs;
  }
  return result;
}

template <class Filter>
void check_all() {
  const SlatScenario calm;
  const Result reference = run<Filter>(calm);
  MESSAGE("calm: ", reference.rmse, " m, relative at the end ", reference.relative_end, " m");

  SlatScenario wild;
  wild.outlier = 0.1;
  const Result outliers = run<Filter>(wild);
  MESSAGE("10 % outliers of 100 sigma: ", outliers.rmse, " m, ", outliers.relative_end, " m");
  CHECK(outliers.rmse < 1.5 * reference.rmse + 3);
  CHECK(outliers.relative_end < 3 * reference.relative_end + 3);

  SlatScenario lossy;
  lossy.dropout = 0.3;
  const Result dropouts = run<Filter>(lossy);
  MESSAGE("30 % dropouts: ", dropouts.rmse, " m, ", dropouts.relative_end, " m");
  CHECK(dropouts.rmse < 1.5 * reference.rmse + 3);
  CHECK(dropouts.relative_end < 2 * reference.relative_end + 3);

  SlatScenario silent;
  silent.silent_from_s = 100;
  silent.silent_to_s = 300;
  const Result silence = run<Filter>(silent);
  MESSAGE("silent for 200 s: ", silence.rmse, " m, ", silence.relative_end, " m");
  CHECK(silence.rmse < 2.5 * reference.rmse);
  CHECK(silence.relative_end < 3 * reference.relative_end + 3);
}

TEST_CASE("robustness: SLATF 1.0") { check_all<Slatf1>(); }
TEST_CASE("robustness: SLATF 2.0") { check_all<Slatf2>(); }
TEST_CASE("robustness: EKF-SLAT") { check_all<Ekf>(); }

TEST_CASE_TEMPLATE("robustness: two masters cross and nobody says whose echo it is", Filter,
                   auvest::Slatf1<Compass, Master, 2>, auvest::Slatf2<Compass, Master, 2>) {
  // They meet within 20 m after 90 s; from then on a swapped pair would stay swapped.
  SlatScenario crossing;
  crossing.count = 2;
  crossing.identified = false;
  crossing.masters[1].position[1] = 380;
  crossing.masters[1].heading = 0.087;
  crossing.masters[1].turn_rate = -crossing.masters[1].turn_rate;
  auvest::SlatfParams<float> params;
  params.gate = 16;
  int swapped = 0;
  double worst = 0;
  double rmse = 0;
  const int runs = 20;
  for (int run = 0; run < runs; ++run) {
    std::vector<float> storage(Filter::Set::storage_size(100));
    Filter filter(Compass(), Master(), params, storage.data(), 100);
    Random world(9, static_cast<std::uint64_t>(run));
    Random random(10, static_cast<std::uint64_t>(run));
    double own = 0;
    double other = 0;
    double square = 0;
    const Status status = auvest::run_slat(
        filter, auvest::Sonar<float>(), crossing, world, random,
        [&](const auvest::SlatStep<Filter>& step) {
          own = other = 0;
          const auto slave = filter.slave().x;
          for (int n = 0; n < 2; ++n) {
            const auto master = filter.master(n);
            REQUIRE(auvest::math::is_positive_definite(master.P));
            for (int i = 0; i < 2; ++i) {
              const double relative = static_cast<double>(master.x(i) - slave(i));
              const double here = step.slave.position[i];
              own += std::pow(relative - (step.masters[n].position[i] - here), 2);
              other += std::pow(relative - (step.masters[1 - n].position[i] - here), 2);
            }
          }
          for (int i = 0; i < 2; ++i) {
            square += std::pow(static_cast<double>(slave(i)) - step.slave.position[i], 2);
          }
        });
    REQUIRE(status == Status::kOk);
    swapped += other < own ? 1 : 0;
    worst = std::max(worst, std::sqrt(own));
    rmse += std::sqrt(square / 200) / runs;
  }
  MESSAGE("slave ", rmse, " m, worst relative error at the end ", worst, " m, swapped ", swapped);
  CHECK(swapped == 0);
  CHECK(rmse < 40);
}

TEST_CASE("robustness: weights that all underflow, and an echo from nowhere") {
  // Without a gate, 1e6 sigma away: every weight underflows as a number; as logarithms they differ.
  std::vector<float> storage(Slatf1::Set::storage_size(100));
  Slatf1 filter(Compass(), Master(), auvest::SlatfParams<float>(), storage.data(), 100);
  Random random(11);
  Slatf1::SlaveBelief start;
  start.x.setZero();
  start.P << 1, 0, 0, 1;
  REQUIRE(filter.reset(start, random) == Status::kOk);
  Slatf1::MasterBelief master;
  master.x << 0, 300, 5, 0, 0, 0;
  master.P = 0.01f * auvest::Matrix<float, 6, 6>::Identity();
  REQUIRE(filter.add_master(master) == Status::kOk);
  for (const float range : {1e6f, 9e8f, 300.0f}) {
    auvest::Sighting<float> seen;
    seen.master = 0;
    seen.z << range, -1.57f;
    REQUIRE(filter.predict(1, auvest::Vector<float, 2>(5, 0), random) == Status::kOk);
    REQUIRE(filter.update(&seen, 1, auvest::Sonar<float>(), random) == Status::kOk);
    const auto slave = filter.slave();
    const auto belief = filter.master(0);
    CHECK(filter.effective_size() >= 1);
    CHECK(std::isfinite(filter.log_likelihood()));
    for (int i = 0; i < 2; ++i) CHECK(std::isfinite(slave.x(i)));
    for (int i = 0; i < 6; ++i) {
      CHECK(std::isfinite(belief.x(i)));
      CHECK(belief.P(i, i) > 0);
    }
  }
}

}  // namespace
