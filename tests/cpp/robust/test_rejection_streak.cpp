// Lock-out, and the way out of it.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <cstdint>
#include <initializer_list>

#include "auvest/auvest.hpp"

namespace {

using auvest::Decision;
using auvest::Matrix;
using auvest::Status;
using auvest::Vector;
using auvest::math::Random;

using Igg = auvest::Igg<double>;
using Process = auvest::SpeedHeading<double>;
using Range = auvest::LeaderRange<double, 2>;
using Streak = auvest::RejectionStreak<double>;

Range leader(double x_m, double y_m) {
  Range::Params p;
  p.leader_x_m = x_m;
  p.leader_y_m = y_m;
  return Range(p);
}

double distance2(const auvest::Belief<double, 2>& b) {  // squared Mahalanobis distance to (0, 0)
  const double determinant = b.P(0, 0) * b.P(1, 1) - b.P(1, 0) * b.P(1, 0);
  return (b.x(0) * b.x(0) * b.P(1, 1) - 2 * b.x(0) * b.x(1) * b.P(1, 0) +
          b.x(1) * b.x(1) * b.P(0, 0)) /
         determinant;
}

/// What became of a slave that stands at (0, 0) and is believed 200 m away, one range per 5 s.
struct Outcome {
  int back = 0;     ///< first update after which the error is within 3 sigma; 0: none
  int outside = 0;  ///< updates 12 to 100 with the error beyond 3 sigma
  double error_m_at_40 = 0;
};

template <class Filter>
Outcome displaced(Filter filter, double direction, std::uint64_t seed, int leaders) {
  REQUIRE(filter.reset(Vector<double, 2>(200 * std::cos(direction), 200 * std::sin(direction)),
                       Matrix<double, 2, 2>::Identity()) == Status::kOk);
  const Range sensors[3] = {leader(300, 0), leader(-150, 260), leader(-150, -260)};
  Random random(seed);
  Outcome outcome;
  for (int k = 1; k <= 100; ++k) {
    REQUIRE(filter.predict(5, Vector<double, 3>(0, 0, 0)) == Status::kOk);
    const Range& sensor = sensors[k % leaders];
    Vector<double, 1> z = sensor.h(Vector<double, 2>(0, 0));
    z(0) += random.normal<double>();
    REQUIRE(filter.update(z, sensor).status == Status::kOk);
    const bool within = distance2(filter.belief()) <= 9;
    if (within && outcome.back == 0) outcome.back = k;
    if (!within && k >= 12) ++outcome.outside;
    if (k == 40) outcome.error_m_at_40 = filter.x().norm();
  }
  return outcome;
}

template <template <class> class Filter, class Recovery>
auvest::Robust<Filter<Process>, auvest::RobustUpdate<Igg, Recovery>> slave() {
  Process::Params p;
  p.sigma_starboard = 0.1;
  return auvest::Robust<Filter<Process>, auvest::RobustUpdate<Igg, Recovery>>(
      Filter<Process>(Process(p)));
}

TEST_CASE("lock-out: 200 m off, back within 3 sigma after at most 12 ranges, never without") {
  for (int d = 0; d < 16; ++d) {
    const double direction = 0.1 + d * auvest::math::pi<double>() / 8;
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      CAPTURE(direction);
      CAPTURE(seed);
      for (const Outcome& o : {displaced(slave<auvest::Ekf, Streak>(), direction, seed, 3),
                               displaced(slave<auvest::Ukf, Streak>(), direction, seed, 3)}) {
        CHECK(o.back >= 6);
        CHECK(o.back <= 12);
        CHECK(o.outside <= 1);  // back to stay: 3 sigma are left once in 90 times by chance
        CHECK(o.error_m_at_40 < 5);
      }
      const Outcome lost =
          displaced(slave<auvest::Ekf, auvest::NoRecovery<double>>(), direction, seed, 3);
      CHECK(lost.back == 0);
      CHECK(lost.error_m_at_40 > 150);
    }
  }
}

TEST_CASE("lock-out: it is the streak that counts, and the belief is widened as stated") {
  Streak::Params params;
  params.rejections = 3;
  using Rule = auvest::RobustUpdate<Igg, Streak>;
  auvest::Robust<auvest::Ekf<Process>, Rule> filter{auvest::Ekf<Process>(Process()),
                                                    Rule{Igg(), Streak(params)}};
  REQUIRE(filter.reset(Vector<double, 2>(0, 0), Matrix<double, 2, 2>::Identity()) == Status::kOk);
  const Range east = leader(0, 1e6);
  const Vector<double, 1> good(1e6), bad(1e6 - 40);
  const auto count_after = [&filter, &east](const Vector<double, 1>& z) {
    REQUIRE(filter.update(z, east).status == Status::kOk);
    return int(filter.rule().recovery.count);
  };
  CHECK(count_after(good) == 0);
  CHECK(count_after(bad) == 2);
  CHECK(count_after(good) == 1);
  CHECK(count_after(bad) == 3);
  CHECK(count_after(bad) == 5);
  const Matrix<double, 2, 2> before = filter.P();
  const auto last = filter.update(bad, east);
  CHECK(last.decision == Decision::kRejected);
  CHECK(last.recovered);
  CHECK(filter.rule().recovery.count == 6);
  CHECK(filter.x().norm() < 1e-6);
  // Both axes alike, by r^2 - S: the same innovation stands at one sigma then.
  const double q = last.innovation(0) * last.innovation(0) - last.S(0, 0);
  CHECK(q == close_to(1600, 0.002));
  CHECK(filter.P()(0, 0) == close_to(before(0, 0) + q, 1e-9));
  CHECK(filter.P()(1, 1) == close_to(before(1, 1) + q, 1e-9));
  const auto again = filter.update(bad, east);
  CHECK(std::fabs(again.standardised(0)) == close_to(1, 1e-4));
  CHECK(again.decision == Decision::kAccepted);
  CHECK(filter.x()(1) == close_to(40, 0.01));
  // A reset forgets the past.
  REQUIRE(filter.reset(Vector<double, 2>(0, 0), Matrix<double, 2, 2>::Identity()) == Status::kOk);
  CHECK(filter.rule().recovery.count == 0);
}

TEST_CASE("lock-out: n outliers by chance cost the prior's knowledge, not the position") {
  const Range sensors[2] = {leader(300, 0), leader(0, -280)};
  auto filter = slave<auvest::Ekf, Streak>();
  REQUIRE(filter.reset(Vector<double, 2>(0, 0), Matrix<double, 2, 2>::Identity()) == Status::kOk);
  for (int k = 0; k < 6; ++k) {
    Vector<double, 1> z = sensors[k % 2].h(Vector<double, 2>(0, 0));
    z(0) += 70 + 10 * k;
    const auto correction = filter.update(z, sensors[k % 2]);
    CHECK(correction.decision == Decision::kRejected);
    CHECK(correction.recovered == (k == 5));
  }
  CHECK(filter.x().norm() == 0);
  // The belief is 120 m wide now, and a circle of 300 m bends over that width: it takes a few.
  for (int k = 0; k < 8; ++k) {
    const Range& sensor = sensors[k % 2];
    const auto correction = filter.update(sensor.h(Vector<double, 2>(0, 0)), sensor);
    CHECK(correction.decision != Decision::kRejected);
    CHECK(distance2(filter.belief()) < 1);
  }
  CHECK(filter.x().norm() < 1);
}

}  // namespace
