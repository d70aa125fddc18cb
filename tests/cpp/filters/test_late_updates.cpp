// Late measurements end in the bits of the filter that had them in time; the memory is bounded.
#include <doctest/doctest.h>

#include <initializer_list>
#include <limits>

#include "auvest/auvest.hpp"

namespace {

using auvest::Matrix;
using auvest::Status;
using auvest::Vector;
using Process = auvest::SpeedHeading<float>;
using Range = auvest::LeaderRange<float, 2>;
using Filter = auvest::RobustEkf<Process>;
using Input = Vector<float, 3>;
using Z = Vector<float, 1>;
template <int Capacity>
using Late = auvest::LateUpdates<Filter, Range, Capacity>;

Filter slave() {
  Filter filter{auvest::Ekf<Process>(Process())};
  REQUIRE(filter.reset(Vector<float, 2>(0, 0), 4 * Matrix<float, 2, 2>::Identity()) == Status::kOk);
  return filter;
}

Range leader(int k) {
  Range::Params p;
  p.leader_x_m = k % 2 == 0 ? 300.0f : -150.0f;
  p.leader_y_m = k % 2 == 0 ? 20.0f : 260.0f;
  return Range(p);
}

Input motion(int k) { return Input(1.5f, 0.1f, 0.01f * float(k)); }

Z range(int k) { return Z(250.0f + 10.0f * float(k % 7) + (k % 11 == 0 ? 60.0f : 0.0f)); }

bool same(const Filter& a, const Filter& b) {
  return a.x() == b.x() && a.P() == b.P() && a.rule().recovery.count == b.rule().recovery.count &&
         a.rule().recovery.variance == b.rule().recovery.variance;
}

/// Of a filter that had every range in time: measured after step k, k = 4, 9, 14, ...
Filter in_time(int steps, int without_after) {
  Filter filter = slave();
  for (int k = 0; k < steps; ++k) {
    REQUIRE(filter.predict(1, motion(k)) == Status::kOk);
    if (k % 5 == 4 && k <= without_after) {
      REQUIRE(filter.update(range(k), leader(k)).status == Status::kOk);
    }
  }
  return filter;
}

TEST_CASE("late updates: ten steps late, the bits are those of the filter that had them in time") {
  Late<20> late(slave());
  for (int k = 0; k < 200; ++k) {
    REQUIRE(late.predict(1, motion(k)) == Status::kOk);
    if (k % 5 == 4 && k >= 10) {
      const int measured = k - 10;
      const auto report = late.update(range(measured), leader(measured), 10);
      REQUIRE(report.status == Status::kOk);
    }
    CHECK(same(late.filter(), in_time(k + 1, k % 5 == 4 ? k - 10 : k - k % 5 - 11)));
  }
}

TEST_CASE("late updates: in any order, and the report is that of its own time") {
  Filter plain = slave();
  Late<64> late(slave());
  auvest::RobustCorrection<float, 1> wanted(Status::kOk);
  for (int k = 0; k < 12; ++k) {
    REQUIRE(plain.predict(1, motion(k)) == Status::kOk);
    REQUIRE(late.predict(1, motion(k)) == Status::kOk);
    if (k == 3) wanted = plain.update(range(3), leader(3));
    if (k == 7) REQUIRE(plain.update(range(7), leader(7)).status == Status::kOk);
  }
  REQUIRE(late.update(range(7), leader(7), 4).status == Status::kOk);
  const auto found = late.update(range(3), leader(3), 8);
  CHECK(found.innovation == wanted.innovation);
  CHECK(found.S == wanted.S);
  CHECK(found.nis == wanted.nis);
  CHECK(same(late.filter(), plain));
}

TEST_CASE("late updates: a time between two steps is that of the nearer") {
  for (const float age : {1.6f, 2.0f, 2.4f}) {
    Late<16> a(slave()), b(slave());
    for (int k = 0; k < 6; ++k) {
      REQUIRE(a.predict(1, motion(k)) == Status::kOk);
      REQUIRE(b.predict(1, motion(k)) == Status::kOk);
      if (k == 3) REQUIRE(b.update(range(3), leader(3)).status == Status::kOk);
    }
    REQUIRE(a.update(range(3), leader(3), age).status == Status::kOk);
    CHECK(same(a.filter(), b.filter()));
  }
}

TEST_CASE("late updates: of a process without input") {
  using Coasting = auvest::Ekf<auvest::WhiteAcceleration<float, 2>>;
  using Fix = auvest::Position<float, 4, 2>;
  const Matrix<float, 4, 4> P = Matrix<float, 4, 4>::Identity();
  const Vector<float, 4> x(0, 0, 1, 0.5f);
  Coasting plain;
  auvest::LateUpdates<Coasting, Fix, 8> late;
  REQUIRE(plain.reset(x, P) == Status::kOk);
  REQUIRE(late.reset(x, P) == Status::kOk);
  const Vector<float, 2> z(2.5f, 0.7f);
  for (int k = 0; k < 5; ++k) {
    REQUIRE(plain.predict(0.75f) == Status::kOk);
    REQUIRE(late.predict(0.75f) == Status::kOk);
    if (k == 2) REQUIRE(plain.update(z, Fix()).status == Status::kOk);
  }
  REQUIRE(late.update(z, Fix(), 1.5f).status == Status::kOk);
  CHECK(late.filter().x() == plain.x());
  CHECK(late.filter().P() == plain.P());
}

TEST_CASE("late updates: with a full memory, one that is older than all that is kept") {
  Filter plain = slave();
  Late<4> late(slave());
  REQUIRE(plain.update(range(1), leader(1)).status == Status::kOk);
  for (int k = 0; k < 4; ++k) {
    REQUIRE(plain.predict(1, motion(k)) == Status::kOk);
    REQUIRE(late.predict(1, motion(k)) == Status::kOk);
    if (k == 1) REQUIRE(plain.update(range(2), leader(2)).status == Status::kOk);
  }
  REQUIRE(late.update(range(1), leader(1), 4).status == Status::kOk);
  REQUIRE(late.update(range(2), leader(2), 2).status == Status::kOk);  // goes on from the first
  CHECK(same(late.filter(), plain));
}

TEST_CASE("late updates: where a later event cannot be repeated nothing changes, then or later") {
  // A range of 3e19 m is a NIS of 9e34 to a slave that may be 100 m off. After a good range to the
  // same leader, of which it learns only now, it would be one of 6e38, beyond float.
  using Plain = auvest::Ekf<Process>;
  using Memory = auvest::LateUpdates<Plain, Range, 8>;
  Range::Params far;
  far.leader_x_m = 1e6f;
  const Range sensor(far);
  const Input still(0, 0, 0);
  Plain filter{Process()};
  REQUIRE(filter.reset(Vector<float, 2>(0, 0), 1e4f * Matrix<float, 2, 2>::Identity()) ==
          Status::kOk);
  Memory late(filter), other(filter);
  for (Memory* each : {&late, &other}) {
    REQUIRE(each->predict(1, still) == Status::kOk);
    REQUIRE(each->predict(1, still) == Status::kOk);
    REQUIRE(each->update(Z(3e19f), sensor).status == Status::kOk);
  }
  const auto refused = late.update(Z(1e6f), sensor, 1);
  CHECK(refused.status == Status::kOverflow);
  CHECK(refused.nis == 0);
  CHECK(refused.S(0, 0) == 0);
  CHECK(late.filter().x() == other.filter().x());
  CHECK(late.filter().P() == other.filter().P());
  far.sigma_range_m = 1e5f;  // one that says little can be taken in, before the same event
  for (Memory* each : {&late, &other}) {
    REQUIRE(each->update(Z(1e6f), Range(far), 1).status == Status::kOk);
  }
  CHECK(late.filter().x() == other.filter().x());
  CHECK(late.filter().P() == other.filter().P());
}

TEST_CASE("late updates: half a step old is now; half a step before all is at their start") {
  for (const float age : {0.5f, 1.5f}) {  // after and before the only step, of 1 s
    Filter plain = slave();
    Late<4> late(slave());
    if (age > 1) REQUIRE(plain.update(range(1), leader(1)).status == Status::kOk);
    REQUIRE(plain.predict(1, motion(1)) == Status::kOk);
    REQUIRE(late.predict(1, motion(1)) == Status::kOk);
    if (age < 1) REQUIRE(plain.update(range(1), leader(1)).status == Status::kOk);
    REQUIRE(late.update(range(1), leader(1), age).status == Status::kOk);
    CHECK(same(late.filter(), plain));
  }
  Late<4> late(slave());
  REQUIRE(late.predict(1, motion(1)) == Status::kOk);
  CHECK(late.update(range(1), leader(1), 1.51f).status == Status::kTimeBackwards);
}

TEST_CASE("late updates: what is refused changes nothing, then or later") {
  Late<8> late(slave()), other(slave());
  const auto check_refused = [&](const Z& z, float age, Status wanted) {
    CHECK(late.update(z, leader(0), age).status == wanted);
    CHECK(same(late.filter(), other.filter()));
  };
  check_refused(Z(250), 1, Status::kTimeBackwards);  // nothing is known of then
  for (int k = 0; k < 30; ++k) {
    REQUIRE(late.predict(1, motion(k)) == Status::kOk);
    REQUIRE(other.predict(1, motion(k)) == Status::kOk);
    if (k < 10) continue;
    check_refused(Z(250), 9, Status::kTimeBackwards);  // 8 events
    check_refused(Z(250), -1, Status::kTimeBackwards);
    check_refused(Z(250), std::numeric_limits<float>::infinity(), Status::kNotFinite);
    check_refused(Z(std::numeric_limits<float>::quiet_NaN()), 3, Status::kNotFinite);
    check_refused(Z(std::numeric_limits<float>::infinity()), 0, Status::kNotFinite);
    CHECK(late.predict(-1, motion(k)) == Status::kTimeBackwards);
    CHECK(same(late.filter(), other.filter()));
  }
  REQUIRE(late.update(range(1), leader(1), 8).status == Status::kOk);
  REQUIRE(other.update(range(1), leader(1), 8).status == Status::kOk);
  CHECK(same(late.filter(), other.filter()));
}

TEST_CASE("late updates: reset begins anew, whatever was before") {
  const Vector<float, 2> x(10, -20);
  const Matrix<float, 2, 2> P = 9 * Matrix<float, 2, 2>::Identity();
  Late<8> late;
  CHECK(late.predict(1, motion(0)) == Status::kNotInitialised);
  CHECK(late.update(250.0f, leader(0)).status == Status::kNotInitialised);
  REQUIRE(late.reset(Vector<float, 2>(0, 0), P) == Status::kOk);
  for (int k = 0; k < 4; ++k) REQUIRE(late.predict(1, motion(k)) == Status::kOk);
  REQUIRE(late.update(range(1), leader(1), 2).status == Status::kOk);

  const Filter before = late.filter();
  CHECK(late.reset(x, -P) == Status::kNotPositiveDefinite);
  CHECK(same(late.filter(), before));
  CHECK(late.update(range(2), leader(2), 1).status == Status::kOk);  // its past is still there

  REQUIRE(late.reset(x, P) == Status::kOk);
  CHECK(late.update(range(2), leader(2), 1).status == Status::kTimeBackwards);
  Filter filter;
  REQUIRE(filter.reset(x, P) == Status::kOk);
  Late<8> other(filter);
  for (Late<8>* each : {&late, &other}) {
    for (int k = 0; k < 4; ++k) REQUIRE(each->predict(1, motion(k)) == Status::kOk);
    REQUIRE(each->update(range(1), leader(1), 2).status == Status::kOk);
  }
  CHECK(same(late.filter(), other.filter()));
}

TEST_CASE("late updates: a range may be a plain number") {
  Late<8> a(slave()), b(slave());
  for (int k = 0; k < 3; ++k) {
    REQUIRE(a.predict(1, motion(k)) == Status::kOk);
    REQUIRE(b.predict(1, motion(k)) == Status::kOk);
  }
  REQUIRE(a.update(range(1), leader(1), 1).status == Status::kOk);
  REQUIRE(b.update(range(1)(0), leader(1), 1).status == Status::kOk);
  CHECK(same(a.filter(), b.filter()));
  REQUIRE(a.update(range(2), leader(2)).status == Status::kOk);
  REQUIRE(b.update(0.5f * range(2) + 0.5f * range(2), leader(2)).status == Status::kOk);
  CHECK(same(a.filter(), b.filter()));
}

}  // namespace
