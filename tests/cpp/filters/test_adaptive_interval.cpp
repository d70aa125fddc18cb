// A filter that chooses its own interval: what starts the policy, what is refused, what goes on.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>

#include "auvest/filters/aukf.hpp"
#include "auvest/intervals/covariance_budget.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"

namespace {

using auvest::Matrix;
using auvest::Status;
using auvest::Vector;
using Position = Vector<double, 2>;
using Process = auvest::ExactAcceleration<double>;
using Law = auvest::Aukf<Process>;
using Policy = auvest::CovarianceBudget<double>;
using Budgeted = auvest::Aukf<Process, Policy>;

const Vector<double, 6> kStart = (Vector<double, 6>() << 3, -4, 0.2, 0.1, 0, 0).finished();
const Matrix<double, 6, 6> kPrior = 0.04 * Matrix<double, 6, 6>::Identity();

Policy budget(double sigma_m) {
  Policy::Params params;
  params.position_sigma_m = sigma_m;
  return Policy(params);
}

Budgeted budgeted(double sigma_m) {
  return Budgeted{auvest::Ukf<Process>(Process()), budget(sigma_m)};
}

/// After a step of the paper's law that has moved all that the policy remembers.
Law after_a_step() {
  Law filter{auvest::Ukf<Process>(Process())};
  REQUIRE(filter.reset(kStart, kPrior) == Status::kOk);
  REQUIRE(filter.predict(filter.interval()) == Status::kOk);
  REQUIRE(filter.feedback(Position(3.1, -3.9)) == Status::kOk);
  REQUIRE(filter.interval() != filter.policy().initial());
  return filter;
}

bool same(const Law& a, const Law& b) {
  return a.x() == b.x() && a.P() == b.P() && a.interval() == b.interval() &&
         a.policy().memory.tau == b.policy().memory.tau &&
         a.policy().memory.last_estimate == b.policy().memory.last_estimate &&
         a.policy().memory.last_reference == b.policy().memory.last_reference;
}

TEST_CASE("adaptive interval: a reset starts the policy anew, at the estimate and the reference") {
  Law filter = after_a_step();
  REQUIRE(filter.reset(kStart, kPrior, Position(7, 8)) == Status::kOk);
  CHECK(filter.interval() == 0.5);  // T(0) of Table 1, until the first feedback
  CHECK(filter.policy().memory.interval == 0.5);
  CHECK(filter.policy().memory.tau == 0.5);
  CHECK(filter.policy().memory.last_estimate == Position(3, -4));
  CHECK(filter.policy().memory.last_reference == Position(7, 8));

  filter = after_a_step();
  REQUIRE(filter.reset(kStart, kPrior) == Status::kOk);  // without a reference: X(0) = R(0)
  CHECK(filter.interval() == 0.5);
  CHECK(filter.policy().memory.last_estimate == Position(3, -4));
  CHECK(filter.policy().memory.last_reference == Position(3, -4));
}

TEST_CASE("adaptive interval: a reset that is refused changes nothing") {
  Law filter = after_a_step();
  const Law before = filter;
  const Position nowhere = Position::Constant(std::nan(""));
  CHECK(filter.reset(kStart, kPrior, nowhere) == Status::kNotFinite);
  CHECK(filter.reset(kStart, -kPrior) == Status::kNotPositiveDefinite);
  CHECK(filter.feedback(nowhere) == Status::kNotFinite);
  CHECK(same(filter, before));

  Budgeted bad = budgeted(-1);
  CHECK(bad.reset(kStart, kPrior) == Status::kBadParameter);
  CHECK(bad.reset(kStart, kPrior, Position(0, 0)) == Status::kBadParameter);
  CHECK(!bad.initialised());
  CHECK(bad.feedback(Position(0, 0)) == Status::kNotInitialised);
}

TEST_CASE("adaptive interval: what was saved goes on with the same bits") {
  Law filter = after_a_step();
  Law copy{auvest::Ukf<Process>(Process())};
  REQUIRE(copy.restore(filter.belief(), filter.policy(), filter.interval()) == Status::kOk);
  CHECK(same(copy, filter));
  for (Law* each : {&filter, &copy}) {
    REQUIRE(each->predict(each->interval()) == Status::kOk);
    REQUIRE(each->feedback(Position(3.2, -3.7)) == Status::kOk);
  }
  CHECK(same(copy, filter));
}

TEST_CASE("adaptive interval: what cannot go on is not restored, and changes nothing") {
  Law filter = after_a_step();
  const Law before = filter;
  Law other = after_a_step();
  REQUIRE(other.reset(2 * kStart, kPrior) == Status::kOk);
  Law::Policy::Params params;
  params.tau0 = 0;
  CHECK(filter.restore(other.belief(), Law::Policy(params), 0.5) == Status::kBadParameter);
  for (const double interval : {0.0, -1.0}) {
    CHECK(filter.restore(other.belief(), other.policy(), interval) == Status::kBadParameter);
  }
  for (const double interval : {std::nan(""), HUGE_VAL}) {
    CHECK(filter.restore(other.belief(), other.policy(), interval) == Status::kNotFinite);
  }
  Law::BeliefType broken = other.belief();
  broken.x(1) = std::nan("");
  CHECK(filter.restore(broken, other.policy(), 0.5) == Status::kNotFinite);
  CHECK(same(filter, before));
}

TEST_CASE("adaptive interval: a memory that no step leaves behind is not restored") {
  Law filter = after_a_step();
  const Law before = filter;
  using Memory = Law::Policy::Memory;
  const auto refuses = [&](const std::function<void(Memory&)>& damage) {
    Law::Policy policy = before.policy();
    damage(policy.memory);
    CHECK(filter.restore(filter.belief(), policy, 0.5) == Status::kBadParameter);
    CHECK(same(filter, before));
  };
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    refuses([bad](Memory& m) { m.tau = bad; });
    refuses([bad](Memory& m) { m.interval = bad; });
    refuses([bad](Memory& m) { m.ratio = bad; });
    refuses([bad](Memory& m) { m.mahalanobis_squared = bad; });
    for (int i = 0; i < 2; ++i) {
      refuses([bad, i](Memory& m) { m.last_estimate(i) = bad; });
      refuses([bad, i](Memory& m) { m.last_reference(i) = bad; });
    }
  }
  refuses([](Memory& m) { m.tau = 1; });
  refuses([](Memory& m) { m.tau = 0; });
  refuses([](Memory& m) { m.interval = 0; });
  refuses([](Memory& m) { m.ratio = 1.5; });
  refuses([](Memory& m) { m.mahalanobis_squared = -1; });
}

TEST_CASE("adaptive interval: its check asks the policy, and the filter") {
  CHECK(budgeted(0.1).check() == Status::kOk);
  CHECK(budgeted(-1).check() == Status::kBadParameter);
  auvest::Ukf<Process>::Params points;
  points.alpha = 2;
  CHECK(Budgeted{auvest::Ukf<Process>(Process(), points), budget(0.1)}.check() ==
        Status::kBadParameter);
}

TEST_CASE("adaptive interval: a policy that is restored takes the place of a bad one") {
  Budgeted bad = budgeted(-1);
  Budgeted good = budgeted(0.1);
  REQUIRE(good.reset(kStart, kPrior) == Status::kOk);
  REQUIRE(bad.restore(good.belief(), good.policy(), 0.25) == Status::kOk);
  CHECK(bad.interval() == 0.25);
  CHECK(bad.policy().params.position_sigma_m == 0.1);
  CHECK(bad.reset(kStart, kPrior) == Status::kOk);
  CHECK(bad.interval() == 0.5);
}

TEST_CASE("adaptive interval: made in place it is the filter with the default policy") {
  auvest::Ukf<Process>::Params points;
  points.alpha = 0.25;
  Law in_place(Process(), points);
  Law copied{auvest::Ukf<Process>(Process(), points)};
  for (Law* filter : {&in_place, &copied}) {
    REQUIRE(filter->reset(kStart, kPrior) == Status::kOk);
    REQUIRE(filter->predict(filter->interval()) == Status::kOk);
    const Vector<double, 2> z(6.6, -1.1);
    REQUIRE(filter->update(z, auvest::RangeBearing<double, 6>()).status == Status::kOk);
    REQUIRE(filter->feedback(Position(3.1, -3.9)) == Status::kOk);
  }
  CHECK(in_place.x() == copied.x());
  CHECK(in_place.P() == copied.P());
  CHECK(in_place.interval() == copied.interval());
  points.alpha = 2;
  CHECK(Law(Process(), points).check() == Status::kBadParameter);
}

}  // namespace
