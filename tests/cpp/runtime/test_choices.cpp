// Choices at run time: each kind does what the policy does that it stands for.
#include <doctest/doctest.h>

#include <cstring>
#include <vector>

#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/runtime/any_interval.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "auvest/runtime/any_linearisation.hpp"
#include "auvest/runtime/any_recovery.hpp"
#include "auvest/runtime/any_resampling.hpp"

namespace {

using auvest::Matrix;
using auvest::Status;
using auvest::Vector;

template <class Kernel>
void check_kernel(const Kernel& kernel, Kernel bad) {
  const auvest::AnyKernel<double> any(kernel);
  for (double t = -10; t <= 10; t += 0.0625) {
    CHECK(any.weight(t) == kernel.weight(t));
    CHECK(any.rho(t) == kernel.rho(t));
  }
  CHECK(any.check() == Status::kOk);
  CHECK(auvest::AnyKernel<double>(bad).check() == bad.check());
}

TEST_CASE("any kernel: weight, rho and check of the one that was chosen") {
  auvest::Huber<double> huber;
  huber.params.k = -1;
  auvest::Hampel<double> hampel;
  hampel.params.b = -1;
  auvest::Igg<double> igg;
  igg.params.k1 = -1;
  REQUIRE(huber.check() == Status::kBadParameter);
  REQUIRE(hampel.check() == Status::kBadParameter);
  REQUIRE(igg.check() == Status::kBadParameter);
  check_kernel(auvest::Unit<double>(), auvest::Unit<double>());
  check_kernel(auvest::Huber<double>(), huber);
  check_kernel(auvest::Hampel<double>(), hampel);
  check_kernel(auvest::Igg<double>(), igg);
}

/// A filter whose budget is met after a second: what a policy asks of it.
struct Estimate {
  struct Process {
    double position_variance(const auvest::Belief<double, 2>&, double dt) const {
      return 0.01 * dt * dt;
    }
  };
  auvest::Belief<double, 2> now;
  Process model;

  const Vector<double, 2>& x() const { return now.x; }
  const auvest::Belief<double, 2>& belief() const { return now; }
  const Process& process() const { return model; }
};

TEST_CASE("any interval: the law that was chosen, with its own first interval and its own check") {
  using Any = auvest::AnyInterval<double>;
  Any any;
  any.fixed.params.interval_s = 0.2;
  any.mahalanobis.params.initial_s = 0.3;
  any.budget.params.initial_s = 0.4;
  any.budget.params.max_s = 4;
  Estimate estimate;
  estimate.now.x << 1, 2;
  estimate.now.P.setIdentity();
  const Vector<double, 2> reference(1.25, 1.5);

  any.kind = Any::Kind::kFixed;
  CHECK(any.initial() == 0.2);
  CHECK(any.next(estimate, reference) == 0.2);

  any.kind = Any::Kind::kCovarianceBudget;
  auvest::CovarianceBudget<double> budget(any.budget.params);
  CHECK(any.initial() == 0.4);
  CHECK(any.next(estimate, reference) == budget.next(estimate, reference));
  CHECK(any.next(estimate, reference) > 0.99);  // 0.1 m, which grow by 0.1 m/s

  any.kind = Any::Kind::kMahalanobis;
  auvest::MahalanobisInterval<double> law(any.mahalanobis.params);
  CHECK(any.initial() == 0.3);
  any.restart(Vector<double, 2>(0, 1), Vector<double, 2>(1, 0));
  law.restart(Vector<double, 2>(0, 1), Vector<double, 2>(1, 0));
  for (int k = 0; k < 3; ++k) {
    CHECK(any.next(estimate, reference) == law.next(estimate, reference));
    estimate.now.x(0) += 0.5;
  }

  for (const auto kind :
       {Any::Kind::kFixed, Any::Kind::kMahalanobis, Any::Kind::kCovarianceBudget}) {
    Any bad;
    bad.kind = kind;
    CHECK(bad.check() == Status::kOk);
    bad.fixed.params.interval_s = kind == Any::Kind::kFixed ? -1 : 1;
    bad.mahalanobis.params.tau0 = kind == Any::Kind::kMahalanobis ? -1 : 0.5;
    bad.budget.params.min_s = kind == Any::Kind::kCovarianceBudget ? -1 : 0.02;
    CHECK(bad.check() == Status::kBadParameter);
    bad.kind = kind == Any::Kind::kFixed ? Any::Kind::kMahalanobis : Any::Kind::kFixed;
    CHECK(bad.check() == Status::kOk);  // the others are not asked
  }
}

/// Predicts and linearises by the kind as the filter of that kind does.
template <class Filter>
void check_linearisation(auvest::AnyLinearisation<double>::Kind kind) {
  using Process = auvest::ExactAcceleration<double>;
  using Sonar = auvest::RangeBearing<double, 6>;
  auvest::SigmaPoints<double>::Params params;
  params.kappa = -3;
  const auvest::AnyLinearisation<double> any(kind, params, 6);
  const Filter filter{Process()};
  auvest::Belief<double, 6> belief;
  belief.x << 3, -4, 0.2, 0.1, 0, 0.01;
  belief.P = Matrix<double, 6, 6>::Identity() * 0.5;
  belief.P(1, 0) = 0.2;
  auvest::Belief<double, 6> other = belief;
  REQUIRE(any.predict(Process(), belief, 0.5) == Status::kOk);
  REQUIRE(filter.predict_belief(other, 0.5) == Status::kOk);
  CHECK(belief.x == other.x);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) CHECK(belief.P(i, j) == other.P(i, j));
  }
  const Sonar sonar;
  const auto point = sonar.about(belief.x);
  Matrix<double, 2, 2> root;
  root << 0.7, 0, 0.2, 0.6;
  const Vector<double, 2> z(7, -1);
  Vector<double, 2> innovation[2];
  Matrix<double, 2, 2> a[2];
  Matrix<double, 2, 2> noise[2];
  REQUIRE(any.linearise(sonar, point, root, z, innovation[0], a[0], noise[0]) == Status::kOk);
  REQUIRE(filter.linearise(sonar, point, root, z, innovation[1], a[1], noise[1]) == Status::kOk);
  CHECK(innovation[0] == innovation[1]);
  CHECK(a[0] == a[1]);
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j <= i; ++j) CHECK(noise[0](i, j) == noise[1](i, j));
  }
}

TEST_CASE("any linearisation: each kind is its filter; only a UKF asks for its parameters") {
  using Any = auvest::AnyLinearisation<double>;
#define AUVEST_CHECK(name, filter) \
  check_linearisation<auvest::filter<auvest::ExactAcceleration<double>>>(Any::Kind::name);
  AUVEST_LINEARISATIONS(AUVEST_CHECK)
#undef AUVEST_CHECK
  auvest::SigmaPoints<double>::Params flat;
  flat.alpha = 0;
  CHECK(Any(Any::Kind::kUkf, flat, 6).check() == Status::kBadParameter);
  CHECK(Any(Any::Kind::kEkf, flat, 6).check() == Status::kOk);
  CHECK(Any(Any::Kind::kCkf, flat, 6).check() == Status::kOk);
}

TEST_CASE("any recovery: a streak where it is asked for, else none") {
  for (const bool enabled : {false, true}) {
    auvest::AnyRecovery<double> any;
    any.enabled = enabled;
    any.streak.params.rejections = 1;
    auvest::RejectionStreak<double> streak(any.streak.params);
    auvest::RobustCorrection<double, 1> correction(Status::kOk);
    correction.decision = auvest::Decision::kRejected;
    correction.innovation(0) = 30;
    correction.S(0, 0) = 2;
    const Matrix<double, 1, 2> a(1, 0);
    const Matrix<double, 2, 2> root = Matrix<double, 2, 2>::Identity();
    auvest::Belief<double, 2> belief;
    belief.x.setZero();
    belief.P.setIdentity();
    auvest::Belief<double, 2> other = belief;
    REQUIRE(streak.after(correction, a, root, other));
    CHECK(any.after(correction, a, root, belief) == enabled);
    CHECK((belief.P == other.P) == enabled);
    CHECK(belief.P.isIdentity(0) != enabled);
  }
}

template <class Policy>
void check_resampling(auvest::AnyResampling::Kind kind) {
  const std::vector<double> weights = {0.4, 3.6, 0.1, 0.9, 2.7, 0.3, 1.2, 0.8};
  auvest::AnyResampling any;
  any.kind = kind;
  auvest::math::Random random(7);
  auvest::math::Random same(7);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<double> a = weights;
    std::vector<double> b = weights;
    any.count(a.data(), 8, random);
    Policy::count(b.data(), 8, same);
    CHECK(a == b);
  }
}

TEST_CASE("any resampling: the draws of the policy that was chosen") {
  using Kind = auvest::AnyResampling::Kind;
  check_resampling<auvest::SystematicResampling>(Kind::kSystematic);
  check_resampling<auvest::StratifiedResampling>(Kind::kStratified);
  check_resampling<auvest::ResidualResampling>(Kind::kResidual);
  check_resampling<auvest::MultinomialResampling>(Kind::kMultinomial);
}

}  // namespace
