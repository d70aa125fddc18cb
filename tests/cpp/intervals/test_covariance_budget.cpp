#include <doctest/doctest.h>

#include <cmath>

#include "auvest/filters/aukf.hpp"
#include "auvest/intervals/covariance_budget.hpp"
#include "auvest/intervals/fixed_interval.hpp"
#include "auvest/models/constant_acceleration.hpp"

namespace {

using auvest::Matrix;
using auvest::Status;
using auvest::Vector;
using Process = auvest::ExactAcceleration<double>;
using Policy = auvest::CovarianceBudget<double>;
using Budgeted = auvest::Aukf<Process, Policy>;

Budgeted filter_with(double sigma, double max_s = 1) {
  Policy::Params params;
  params.position_sigma_m = sigma;
  params.max_s = max_s;
  Budgeted filter{auvest::Ukf<Process>(Process()), Policy(params)};
  Matrix<double, 6, 6> P = Matrix<double, 6, 6>::Zero();
  const double variances[6] = {1e-3, 1e-3, 4e-2, 4e-2, 1e-4, 1e-4};
  for (int i = 0; i < 6; ++i) P(i, i) = variances[i];
  REQUIRE(filter.reset(Vector<double, 6>::Zero(), P) == Status::kOk);
  return filter;
}

double predicted_sigma(Budgeted filter, double dt) {
  REQUIRE(filter.predict(dt) == Status::kOk);
  return std::sqrt(filter.P()(0, 0) + filter.P()(1, 1));
}

TEST_CASE("budget: the interval is the longest that keeps it") {
  for (const double sigma : {0.06, 0.1, 0.2}) {
    Budgeted filter = filter_with(sigma);
    REQUIRE(filter.feedback(Vector<double, 2>::Zero()) == Status::kOk);
    const double t = filter.interval();
    CHECK(predicted_sigma(filter, t) <= sigma);
    CHECK(predicted_sigma(filter, t + 0.98 / 1024) > sigma);  // one bisection width further
  }
}

TEST_CASE("budget: out of reach gives T_min, never needed gives T_max") {
  Budgeted tight = filter_with(1e-3);
  REQUIRE(tight.feedback(Vector<double, 2>::Zero()) == Status::kOk);
  CHECK(tight.interval() == 0.02);
  Budgeted loose = filter_with(10);
  REQUIRE(loose.feedback(Vector<double, 2>::Zero()) == Status::kOk);
  CHECK(loose.interval() == 1);
}

TEST_CASE("budget: what T_max just reaches is within it") {
  Process::Params quiet;
  quiet.position = quiet.velocity = quiet.acceleration = 0;
  Policy::Params params;
  params.position_sigma_m = 0.5;
  Budgeted filter{auvest::Ukf<Process>(Process(quiet)), Policy(params)};
  // After 1 s P_xx = P_yy = 1/16 + 1/16, without rounding: together 0.5^2.
  Matrix<double, 6, 6> P = Matrix<double, 6, 6>::Identity() / 16;
  P(4, 4) = P(5, 5) = 1e-300;
  REQUIRE(filter.reset(Vector<double, 6>::Zero(), P) == Status::kOk);
  REQUIRE(predicted_sigma(filter, 1) == 0.5);
  REQUIRE(filter.feedback(Vector<double, 2>::Zero()) == Status::kOk);
  CHECK(filter.interval() == 1);
}

TEST_CASE("bad parameters are reported") {
  const auto changed = [](double Policy::Params::*member, double value) {
    Policy::Params params;
    params.*member = value;
    return Policy(params).check();
  };
  using P = Policy::Params;
  CHECK(Policy().check() == Status::kOk);
  CHECK(changed(&P::position_sigma_m, 0) == Status::kBadParameter);
  CHECK(changed(&P::position_sigma_m, std::nan("")) == Status::kBadParameter);
  CHECK(changed(&P::min_s, -1) == Status::kBadParameter);
  CHECK(changed(&P::initial_s, 2) == Status::kBadParameter);
  CHECK(changed(&P::initial_s, 0.01) == Status::kBadParameter);  // below T_min
  CHECK(changed(&P::max_s, HUGE_VAL) == Status::kBadParameter);

  auvest::FixedInterval<double>::Params fixed;
  CHECK(auvest::FixedInterval<double>(fixed).check() == Status::kOk);
  for (const double bad : {0.0, -0.5, std::nan(""), HUGE_VAL}) {
    fixed.interval_s = bad;
    CHECK(auvest::FixedInterval<double>(fixed).check() == Status::kBadParameter);
  }
}

}  // namespace
