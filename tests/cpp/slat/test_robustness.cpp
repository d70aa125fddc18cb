// What must not break a SLAT filter: outliers, dropouts, silence, underflow. Never a NaN,
// covariances positive, and the estimate comes back.
#include <doctest/doctest.h>

#include "gated.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulation/slat.hpp"

namespace {

using namespace slat_test;
using auvest::Echo;
using auvest::SlatScenario;
using auvest::Status;
using auvest::math::Random;

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

TEST_CASE("robustness: SLATF 1.0") { check_all<FloatSlatf1<1>>(); }
TEST_CASE("robustness: SLATF 2.0") { check_all<FloatSlatf2<1>>(); }
TEST_CASE("robustness: SlatfJoint") { check_all<FloatJoint<1>>(); }
TEST_CASE("robustness: EKF-SLAT") { check_all<FloatEkf<1>>(); }

TEST_CASE_TEMPLATE("robustness: two masters cross and nobody says whose echo it is" *
                       doctest::test_suite("statistics"),
                   Filter, FloatSlatf1<2>, FloatSlatf2<2>, FloatJoint<2>, FloatEkf<2>) {
  // They meet within 20 m after 90 s; from then on a swapped pair would stay swapped.
  SlatScenario crossing;
  crossing.count = 2;
  crossing.identified = false;
  crossing.masters[1].position[1] = 380;
  crossing.masters[1].heading = 0.087;
  crossing.masters[1].turn_rate = -crossing.masters[1].turn_rate;
  int swapped = 0;
  int lost = 0;  // a master taken for something else, and no way back
  double worst = 0;
  double rmse = 0;
  const int runs = 20;
  for (int run = 0; run < runs; ++run) {
    Gated<Filter> owner;
    Filter& filter = owner.filter;
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
    lost += own > 100 * 100 ? 1 : 0;
    worst = std::max(worst, std::sqrt(own));
    rmse += std::sqrt(square / 200) / runs;
  }
  MESSAGE("slave ", rmse, " m, worst relative error at the end ", worst, " m, swapped ", swapped,
          ", lost ", lost);
  CHECK(swapped == 0);
  CHECK(lost == 0);
  CHECK(rmse < 40);
}

/// A filter that knows where it is, and a master 300 m away.
template <class Filter>
struct Near : Gated<Filter> {
  Random random;

  explicit Near(float gate) : Gated<Filter>(gate), random(11) {
    typename Filter::SlaveBelief start;
    start.x.setZero();
    start.P << 1, 0, 0, 1;
    REQUIRE(this->filter.reset(start, random) == Status::kOk);
    typename Filter::MasterBelief master;
    master.x << 0, 300, 5, 0, 0, 0;
    master.P = 0.01f * auvest::Matrix<float, 6, 6>::Identity();
    REQUIRE(this->filter.add_master(master) == Status::kOk);
  }

  Status step(float range, float bearing) {
    Echo<float> seen;
    seen.master = 0;
    seen.z << range, bearing;
    const Status status = this->filter.predict(1, auvest::Vector<float, 2>(5, 0), random);
    if (status != Status::kOk) return status;
    return this->filter.update(&seen, 1, auvest::Sonar<float>(), random);
  }

  void check_sane() const {
    const auto slave = this->filter.slave();
    const auto master = this->filter.master(0);
    CHECK(std::isfinite(this->filter.log_likelihood()));
    for (int i = 0; i < 2; ++i) CHECK(std::isfinite(slave.x(i)));
    for (int i = 0; i < 2; ++i) CHECK(slave.P(i, i) >= 0);
    for (int i = 0; i < 6; ++i) CHECK(std::isfinite(master.x(i)));
    for (int i = 0; i < 6; ++i) CHECK(master.P(i, i) > 0);
  }
};

TEST_CASE_TEMPLATE("robustness: weights that all underflow, and an echo from nowhere", Filter,
                   FloatSlatf1<1>, FloatSlatf2<1>, FloatJoint<1>) {
  // Without a gate, up to 1e9 sigma away: as numbers all weights underflow, as logarithms they
  // differ.
  for (const float far : {1e6f, 9e8f}) {
    Near<Filter> near(0);
    for (const float range : {300.0f, far}) {
      REQUIRE(near.step(range, -1.57f) == Status::kOk);
      CHECK(near.filter.effective_size() >= 1);
      near.check_sane();
    }
    // A slave that was thrown to where floats are coarse says so.
    const Status status = near.step(300, -1.57f);
    CHECK((status == Status::kOk || status == Status::kFarFromOrigin));
    near.check_sane();
  }
}

TEST_CASE_TEMPLATE("robustness: echoes that are no numbers leave no trace", Filter, FloatSlatf1<1>,
                   FloatSlatf2<1>, FloatJoint<1>, FloatEkf<1>) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  Near<Filter> clean(16);
  Near<Filter> dirty(16);
  for (int k = 0; k < 20; ++k) {
    REQUIRE(clean.step(300, -1.57f) == Status::kOk);
    REQUIRE(dirty.step(300, -1.57f) == Status::kOk);
    const float bad[4][2] = {{nan, -1.57f}, {300, nan}, {infinity, -1.57f}, {300, -infinity}};
    Echo<float> seen;
    seen.master = 0;
    seen.z << bad[k % 4][0], bad[k % 4][1];
    REQUIRE(dirty.filter.update(&seen, 1, auvest::Sonar<float>(), dirty.random) ==
            Status::kNotFinite);
  }
  CHECK(dirty.filter.slave().x == clean.filter.slave().x);
  CHECK(dirty.filter.slave().P == clean.filter.slave().P);
  CHECK(dirty.filter.master(0).x == clean.filter.master(0).x);
  CHECK(dirty.filter.master(0).P == clean.filter.master(0).P);
  CHECK(dirty.filter.log_likelihood() == clean.filter.log_likelihood());
  CHECK(auvest::math::is_positive_definite(dirty.filter.master(0).P));
  dirty.check_sane();
}

}  // namespace
