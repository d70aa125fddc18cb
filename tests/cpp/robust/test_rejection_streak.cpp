// Lock-out, and the way out of it.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <cstdint>
#include <initializer_list>

#include "auvest/auvest.hpp"
#include "simulation/cooperative.hpp"

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
        CHECK(o.back >= 4);
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

/// What became of a slave among two leaders that is believed 200 m from where it is.
struct Course {
  int ranges = 0;
  int back = 0;  ///< range after which the error is first within 3 sigma; 0: none
  int steps = 0;
  int within = 0;  ///< steps of the second half within 3 sigma

  template <class Step>
  void operator()(const Step& step) {
    if (step.correction != nullptr) ++ranges;
    auvest::Belief<double, 2> error = step.filter.belief();
    for (int i = 0; i < 2; ++i) error.x(i) -= step.fleet.position[i];
    const bool inside = distance2(error) <= 9;
    if (inside && ranges > 0 && back == 0) back = ranges;
    if (++steps > 500 && inside) ++within;
  }
};

template <template <class> class Filter, class Recovery>
Course among_two_leaders(double direction, std::uint64_t seed, std::uint64_t run) {
  using Robust = auvest::Robust<Filter<Process>, auvest::RobustUpdate<Igg, Recovery>>;
  Robust filter{Filter<Process>(Process())};
  REQUIRE(filter.reset(Vector<double, 2>(200 * std::cos(direction), 200 * std::sin(direction)),
                       Matrix<double, 2, 2>::Identity()) == Status::kOk);
  Random random(seed, run);
  Course course;
  REQUIRE(auvest::cooperate(filter, Range(), auvest::CooperativeScenario(), random, 1000, course) ==
          Status::kOk);
  return course;
}

TEST_CASE("lock-out: the same with two leaders that move, the paper's geometry" *
          doctest::test_suite("statistics")) {
  for (int d = 0; d < 12; ++d) {
    const double direction = (d + 0.5) * auvest::math::pi<double>() / 6;
    CAPTURE(direction);
    for (std::uint64_t run = 0; run < 8; ++run) {
      CAPTURE(run);
      for (const Course& c :
           {among_two_leaders<auvest::Ekf, Streak>(direction, 1 + std::uint64_t(d), run),
            among_two_leaders<auvest::Ukf, Streak>(direction, 1 + std::uint64_t(d), run)}) {
        CHECK(c.back >= 4);
        CHECK(c.back <= 12);
        CHECK(c.within > 250);
      }
    }
    CHECK(among_two_leaders<auvest::Ekf, auvest::NoRecovery<double>>(direction, 1, 0).back == 0);
  }
}

using Rule = auvest::RobustUpdate<Igg, Streak>;
using Slave = auvest::Robust<auvest::Ekf<Process>, Rule>;

Slave patient(std::uint8_t rejections) {
  Streak::Params params;
  params.rejections = rejections;
  Slave filter{auvest::Ekf<Process>(Process()), Rule{Igg(), Streak(params)}};
  REQUIRE(filter.reset(Vector<double, 2>(0, 0), Matrix<double, 2, 2>::Identity()) == Status::kOk);
  return filter;
}

/// The count after a range to a leader far away, `degrees` east of north, that is too short by
/// `error_m`.
int count_after(Slave& filter, double degrees, double error_m) {
  const double angle = degrees * auvest::math::pi<double>() / 180;
  const Range sensor = leader(1e6 * std::cos(angle), 1e6 * std::sin(angle));
  const double z = sensor.h(filter.x())(0) - error_m;
  REQUIRE(filter.update(Vector<double, 1>(z), sensor).status == Status::kOk);
  return int(filter.rule().recovery.count);
}

TEST_CASE("lock-out: what each range says about the prior, in halves of a nat") {
  Slave filter = patient(30);
  CHECK(count_after(filter, 90, 0) == 0);
  CHECK(count_after(filter, 90, 40) == 4);    // a line not looked along
  CHECK(count_after(filter, 90, 0) == 2);     // an acceptance
  CHECK(count_after(filter, 90, 40) == 9);    // the same again
  CHECK(count_after(filter, 90, 100) == 10);  // another innovation along this line
  CHECK(count_after(filter, 90, 40) == 17);   // the one before last
  CHECK(count_after(filter, 105, 40) == 24);  // a line that has turned a little
  CHECK(count_after(filter, 130, 40) == 28);  // and one too far from it
  CHECK(count_after(filter, 310, 40) == 32);  // from the other side it would be the other sign
  // Each of the last two lines looked along is remembered, the one before them is not.
  CHECK(count_after(filter, 130, 40) == 39);
  CHECK(count_after(filter, 310, 40) == 46);
  CHECK(count_after(filter, 310, 40) == 53);
  CHECK(count_after(filter, 130, 40) == 60);
  CHECK(count_after(filter, 105, 40) == 64);
  // The same is what differs by less than 3 of its sigmas and an eighth of its size together.
  const double s = filter.P()(0, 0) + 1;
  const double alike_m = std::sqrt(9 * s + 30 * 30 / 64.0);
  CHECK(count_after(filter, 180, 30 + 1.01 * alike_m) == 68);
  CHECK(count_after(filter, 180, 30) == 69);
  CHECK(count_after(filter, 0, 30 + 0.99 * alike_m) == 73);
  CHECK(count_after(filter, 0, 30) == 80);
}

TEST_CASE("lock-out: one line and no two innovations alike takes longer, but not for ever") {
  Slave filter = patient(6);
  int rejected = 0;
  while (filter.P()(1, 1) < 100) {
    REQUIRE(++rejected < 30);
    count_after(filter, 90, 40 * (1 + rejected % 3));
  }
  CHECK(rejected == 21);  // 4 + 20 * 1 = 4 n
}

TEST_CASE("lock-out: at the limit the belief is widened as stated") {
  Slave filter = patient(3);
  const Range east = leader(0, 1e6);
  const Vector<double, 1> bad(1e6 - 40);
  CHECK(filter.update(bad, east).recovered == false);
  CHECK(filter.rule().recovery.count == 4);
  const Matrix<double, 2, 2> before = filter.P();
  CHECK(filter.update(bad, east).recovered == false);
  CHECK(filter.rule().recovery.count == 11);
  const auto last = filter.update(bad, east);
  CHECK(last.decision == Decision::kRejected);
  CHECK(last.recovered);
  CHECK(filter.rule().recovery.count == 12);
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
  CHECK(filter.rule().recovery.recent.isZero());
}

/// r^2 - S of a range that is too short by `error_m`, to a leader far away in the east.
double needed(const Slave& filter, double error_m) {
  return error_m * error_m - (filter.P()(1, 1) + 1);
}

TEST_CASE("lock-out: five recoveries at once, then one in fifty ranges, and the status says so") {
  Slave filter = patient(1);  // every rejection is followed by a recovery
  double error_m = 8;
  for (int k = 0; k < 5; ++k) {
    CHECK(filter.status() == Status::kOk);
    const double before = filter.P()(1, 1);
    count_after(filter, 90, error_m);
    CHECK(filter.P()(1, 1) > before + 0.5 * error_m * error_m);
    error_m *= 10;  // ten sigma of the belief that has been widened for the last one
  }
  CHECK(filter.status() == Status::kRecoveriesRepeat);
  const double before = filter.P()(1, 1);
  const int count = count_after(filter, 90, error_m);
  CHECK(count == 4);  // at the limit
  CHECK(filter.P()(1, 1) == before);
  // Ranges that are believed let the count run out: of 250 less 5 so far, to 205.
  int ranges = 0;
  while (filter.status() == Status::kRecoveriesRepeat) {
    count_after(filter, 90, 0);
    REQUIRE(++ranges < 100);
  }
  CHECK(ranges == 40);
  count_after(filter, 90, error_m);
  CHECK(filter.P()(1, 1) > 0.5 * error_m * error_m);
  CHECK(filter.status() == Status::kRecoveriesRepeat);

  REQUIRE(filter.reset(Vector<double, 2>(0, 0), Matrix<double, 2, 2>::Identity()) == Status::kOk);
  CHECK(filter.status() == Status::kOk);
  CHECK(Slave{auvest::Ekf<Process>(Process())}.status() == Status::kNotInitialised);
}

/// Recoveries of a slave that circles among three leaders, and ranges at whose end the status was
/// kRecoveriesRepeat; each range is `scale` times as long as it should be.
void circle(double scale, int& recoveries, int& repeated) {
  Slave filter = patient(3);
  const Range sensors[3] = {leader(300, 0), leader(-150, 260), leader(-150, -260)};
  Random random(1);
  Vector<double, 2> truth(0, 0);
  recoveries = repeated = 0;
  for (int k = 0; k < 1000; ++k) {
    const double heading = 0.02 * k;
    truth += 2 * Vector<double, 2>(std::cos(heading), std::sin(heading));
    REQUIRE(filter.predict(2, Vector<double, 3>(1, 0, heading)) == Status::kOk);
    Vector<double, 1> z = sensors[k % 3].h(truth);
    z(0) = scale * z(0) + random.normal<double>();
    const auto correction = filter.update(z, sensors[k % 3]);
    REQUIRE(correction.status == Status::kOk);
    recoveries += correction.recovered ? 1 : 0;
    repeated += filter.status() == Status::kRecoveriesRepeat ? 1 : 0;
  }
}

TEST_CASE(
    "lock-out: a scale of the ranges is no wrong belief, and is not recovered from for ever") {
  int recoveries = 0;
  int repeated = 0;
  circle(1, recoveries, repeated);
  CHECK(recoveries == 0);
  CHECK(repeated == 0);
  circle(1.2, recoveries, repeated);
  CHECK(recoveries >= 5);
  CHECK(recoveries <= 5 + 1000 / 50);
  CHECK(repeated > 500);
}

TEST_CASE("lock-out: a streak that ends by acceptances asks for nothing later") {
  Slave filter = patient(3);
  CHECK(count_after(filter, 90, 90) == 4);
  CHECK(filter.rule().recovery.variance == close_to(needed(filter, 90), 1e-6));
  CHECK(count_after(filter, 90, 0) == 2);
  CHECK(filter.rule().recovery.variance > 8000);  // not yet
  CHECK(count_after(filter, 90, 0) == 0);
  CHECK(filter.rule().recovery.variance == 0);
  CHECK(count_after(filter, 0, 40) == 4);
  CHECK(count_after(filter, 180, 40) == 8);
  const double before = filter.P()(1, 1);
  const double wanted = needed(filter, 40);
  CHECK(count_after(filter, 90, 40) == 12);
  CHECK(filter.P()(1, 1) - before == close_to(wanted, 0.001));  // 1600, not 8100
}

TEST_CASE("lock-out: after a recovery the next rejection widens by its own need alone") {
  Slave filter = patient(3);
  for (int k = 0; k < 3; ++k) count_after(filter, 90, 90);
  CHECK(filter.P()(1, 1) > 8000);  // recovered
  CHECK(filter.rule().recovery.variance == 0);
  CHECK(count_after(filter, 90, 0) == 10);  // and the leader in the east narrows it again
  CHECK(filter.P()(1, 1) < 2);
  CHECK(count_after(filter, 90, 40) == 11);  // not the 90 m of before
  const double before = filter.P()(1, 1);
  const double wanted = needed(filter, 40);
  CHECK(count_after(filter, 90, 40) == 12);
  CHECK(filter.P()(1, 1) - before == close_to(wanted, 0.001));
  CHECK(filter.rule().recovery.variance == 0);
}

TEST_CASE("lock-out: the belief is widened by what the greatest of the rejections asks for") {
  Slave filter = patient(3);
  CHECK(count_after(filter, 90, 90) == 4);
  CHECK(count_after(filter, 90, 40) == 5);
  const double before = filter.P()(1, 1);
  const double wanted = needed(filter, 90);
  CHECK(count_after(filter, 90, 40) == 12);
  CHECK(filter.P()(1, 1) - before == close_to(wanted, 0.001));
}

TEST_CASE("lock-out: components of one measurement do not repeat each other") {
  using Still = auvest::LinearProcess<double, 2>;
  using Pair = auvest::LinearMeasurement<double, 2, 2>;
  using Square = Matrix<double, 2, 2>;
  auvest::Robust<auvest::Ekf<Still>, Rule> filter{
      auvest::Ekf<Still>(Still(Square::Identity(), Square::Zero()))};
  REQUIRE(filter.reset(Vector<double, 2>(0, 0), Square::Identity()) == Status::kOk);
  Square rows;  // both see the first state
  rows << 1, 0, 1, 0;
  const Pair sensor(rows, Square::Identity());
  const auto first = filter.update(Vector<double, 2>(40, 40), sensor);
  REQUIRE(first.decision == Decision::kRejected);
  CHECK(filter.rule().recovery.count == 4);
  CHECK(filter.rule().recovery.recent(0, 2) == 40);  // both are remembered
  CHECK(filter.rule().recovery.recent(1, 2) == 40);
  // One that was measured later does repeat them.
  REQUIRE(filter.update(Vector<double, 2>(40, 40), sensor).decision == Decision::kRejected);
  CHECK(filter.rule().recovery.count == 11);
}

TEST_CASE("lock-out: parameters and saved counts out of their range are refused") {
  const auto status = [](int rejections, int count) {
    Streak::Params params;
    params.rejections = static_cast<std::uint8_t>(rejections);
    Streak streak(params);
    streak.count = static_cast<std::uint8_t>(count);
    return streak.check();
  };
  CHECK(Streak().check() == Status::kOk);
  CHECK(status(0, 0) == Status::kBadParameter);
  CHECK(status(1, 0) == Status::kOk);
  CHECK(status(60, 240) == Status::kOk);
  CHECK(status(61, 0) == Status::kBadParameter);  // from 64 on no count would reach the limit
  CHECK(status(64, 0) == Status::kBadParameter);
  CHECK(status(3, 12) == Status::kOk);
  CHECK(status(3, 13) == Status::kBadParameter);
  for (const double bad : {-1.0, std::nan(""), HUGE_VAL}) {
    Streak streak;
    streak.variance = bad;
    CHECK(streak.check() == Status::kBadParameter);
  }
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    Streak streak;
    streak.recent(1, 2) = bad;
    CHECK(streak.check() == Status::kBadParameter);
  }

  Slave filter = patient(3);
  count_after(filter, 90, 40);
  Rule saved = filter.rule();
  saved.recovery.count = 13;
  CHECK(filter.restore(filter.belief(), saved) == Status::kBadParameter);
  CHECK(filter.rule().recovery.count == 4);
  saved.recovery.count = 12;
  CHECK(filter.restore(filter.belief(), saved) == Status::kOk);
  CHECK(filter.rule().recovery.count == 12);
}

TEST_CASE("lock-out: n outliers by chance cost the prior's knowledge, not the position") {
  auto filter = slave<auvest::Ekf, Streak>();
  REQUIRE(filter.reset(Vector<double, 2>(0, 0), Matrix<double, 2, 2>::Identity()) == Status::kOk);
  const auto around = [](int k) {
    const double angle = k * auvest::math::pi<double>() / 3;
    return leader(300 * std::cos(angle), 300 * std::sin(angle));
  };
  for (int k = 0; k < 6; ++k) {
    Vector<double, 1> z = around(k).h(Vector<double, 2>(0, 0));
    z(0) += 70 + 10 * k;
    const auto correction = filter.update(z, around(k));
    CHECK(correction.decision == Decision::kRejected);
    CHECK(correction.recovered == (k == 5));
  }
  CHECK(filter.x().norm() == 0);
  // The belief is 120 m wide now, and a circle of 300 m bends over that width: it takes a few.
  for (int k = 0; k < 8; ++k) {
    const Range sensor = around(2 * k);
    const auto correction = filter.update(sensor.h(Vector<double, 2>(0, 0)), sensor);
    CHECK(correction.decision != Decision::kRejected);
    CHECK(distance2(filter.belief()) < 1);
  }
  CHECK(filter.x().norm() < 1);
}

/// Recoveries of a slave that is where it is believed to be, where every fifth range is an outlier.
int false_recoveries(double outlier_sigma_m) {
  auvest::CooperativeScenario scenario;
  scenario.noise.outlier_fraction = 0.2;
  scenario.noise.outlier_sigma_m = outlier_sigma_m;
  int recoveries = 0;
  for (std::uint64_t run = 0; run < 20; ++run) {
    Slave filter = patient(6);
    Random random(11, run);
    const auto count =
        [&recoveries](
            const auvest::CooperativeStep<Slave, auvest::RobustCorrection<double, 1>>& step) {
          if (step.correction != nullptr && step.correction->recovered) ++recoveries;
        };
    REQUIRE(auvest::cooperate(filter, Range(), scenario, random, 8280, count) == Status::kOk);
  }
  return recoveries;
}

TEST_CASE("lock-out: outliers are hardly ever taken for a wrong prior" *
          doctest::test_suite("statistics")) {
  // 33,120 ranges each.
  CHECK(false_recoveries(10) <= 3);
  CHECK(false_recoveries(30) <= 1);
}

TEST_CASE("what does not see the position does not widen it") {
  Streak streak{[] {
    Streak::Params params;
    params.rejections = 1;
    return params;
  }()};
  auvest::Belief<double, 4> belief;
  belief.P = Matrix<double, 4, 4>::Identity();
  const Matrix<double, 4, 4> root = belief.P;
  auvest::RobustCorrection<double, 1> correction;
  correction.weight(0) = 0;
  correction.innovation(0) = 30;
  correction.S(0, 0) = 1;
  Matrix<double, 1, 4> a = Matrix<double, 1, 4>::Zero();
  a(0, 2) = 1;  // a velocity
  a(0, 0) = 1e-12;
  CHECK(streak.after(correction, a, root, belief));
  CHECK(belief.P(0, 0) == 1);
  // One that sees a thousandth of it asks for 30^2 - 1 over the square of that, which is in range.
  a(0, 0) = 1e-3;
  CHECK(streak.after(correction, a, root, belief));
  CHECK(belief.P(0, 0) == doctest::Approx(1 + 899e6));
}

}  // namespace
