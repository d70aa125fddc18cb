// A filter that has run and is reset is as a new one, to the bit; what it is refused leaves no
// trace, then or later.
#include <doctest/doctest.h>

#include "gated.hpp"

#include <cmath>

#include "auvest/models/constant_velocity.hpp"
#include "auvest/slat/dead_reckoning.hpp"
#include "auvest/slat/imm_slat.hpp"

namespace {

using namespace slat_test;
using Pair = auvest::Vector<float, 2>;
using auvest::Echo;
using auvest::Status;
using auvest::math::Random;

using Straight = auvest::ConstantVelocity<float>;
using Accelerated = auvest::ExactAcceleration<float>;
template <int Masters>
using FloatImm = auvest::EkfSlat<FloatCompass, auvest::Imm<Straight, Accelerated>, Masters>;

template <class Filter>
typename Filter::SlaveBelief slave_at(float x) {
  typename Filter::SlaveBelief slave;
  slave.x << x, 2;
  slave.P << 1, 0.2f, 0.2f, 2;
  return slave;
}

template <class Filter>
typename Filter::MasterBelief master_at(float x) {
  typename Filter::MasterBelief master;
  master.x << x, 150, 2, 1, 0.01f, 0;
  master.P = 0.5f * auvest::Matrix<float, 6, 6>::Identity();
  return master;
}

Echo<float> echo_of(int master, float range, float bearing) {
  Echo<float> seen;
  seen.master = master;
  seen.z << range, bearing;
  return seen;
}

/// Two masters and some pings, after a reset.
template <class Filter>
void run(Filter& filter, Random& random, int pings) {
  const auvest::Sonar<float> sonar;
  REQUIRE(filter.add_master(master_at<Filter>(100)) == Status::kOk);
  REQUIRE(filter.add_master(master_at<Filter>(-200)) == Status::kOk);
  for (int k = 0; k < pings; ++k) {
    REQUIRE(filter.predict(1, Pair(2, 0.1f), random) == Status::kOk);
    const Echo<float> seen[2] = {echo_of(0, 180.0f + float(k), -2.16f),
                                 echo_of(1, 250.0f - float(k), -0.65f)};
    REQUIRE(filter.update(seen, 1 + k % 2, sonar, random) == Status::kOk);
  }
}

template <class Filter>
void check_same(const Filter& a, const Filter& b) {
  CHECK(a.masters() == b.masters());
  CHECK(a.log_likelihood() == b.log_likelihood());
  CHECK(a.slave().x == b.slave().x);
  CHECK(a.slave().P == b.slave().P);
  for (int n = 0; n < b.masters(); ++n) {
    CHECK(a.master(n).x == b.master(n).x);
    CHECK(a.master(n).P == b.master(n).P);
  }
}

/// What only filters with particles have, or only those without.
template <class Filter>
auto check_same_numbers(const Filter& a, const Filter& b) -> decltype(a.resamplings(), void()) {
  CHECK(a.resamplings() == b.resamplings());
  CHECK(a.effective_size() == b.effective_size());
  CHECK(a.particles() == b.particles());
}
template <class Filter>
auto check_same_numbers(const Filter& a, const Filter& b) -> decltype(a.nis(), void()) {
  CHECK(a.nis() == b.nis());
}

TEST_CASE_TEMPLATE("second run: a filter that is reset is as a new one", Filter, FloatSlatf1<2>,
                   FloatSlatf2<2>, FloatJoint<2>, FloatEkf<2>, FloatImm<2>) {
  Gated<Filter> used(0);
  Gated<Filter> fresh(0);
  Random before(1);
  REQUIRE(used.filter.reset(slave_at<Filter>(-30), before) == Status::kOk);
  run(used.filter, before, 12);
  CHECK(used.filter.log_likelihood() != 0);
  Random random[2] = {Random(7), Random(7)};
  REQUIRE(used.filter.reset(slave_at<Filter>(1), random[0]) == Status::kOk);
  REQUIRE(fresh.filter.reset(slave_at<Filter>(1), random[1]) == Status::kOk);
  CHECK(used.filter.masters() == 0);
  CHECK(used.filter.log_likelihood() == 0);
  check_same(used.filter, fresh.filter);
  check_same_numbers(used.filter, fresh.filter);
  run(used.filter, random[0], 5);
  run(fresh.filter, random[1], 5);
  check_same(used.filter, fresh.filter);
  check_same_numbers(used.filter, fresh.filter);
}

TEST_CASE_TEMPLATE("second run: what is refused leaves no trace", Filter, FloatSlatf1<2>,
                   FloatSlatf2<2>, FloatJoint<2>, FloatEkf<2>, FloatImm<2>) {
  const float nan = std::nanf("");
  const auvest::Sonar<float> sonar;
  const Pair u(2, 0.1f);
  Gated<Filter> refused;
  Gated<Filter> other;
  Random random[2] = {Random(8), Random(8)};
  Filter& filter = refused.filter;
  Echo<float> seen[2] = {echo_of(0, 180, -2.16f), echo_of(1, 250, -0.65f)};
  CHECK(filter.add_master(master_at<Filter>(0)) == Status::kNotInitialised);
  CHECK(filter.predict(1, u, random[0]) == Status::kNotInitialised);
  CHECK(filter.update(seen, 1, sonar, random[0]) == Status::kNotInitialised);
  REQUIRE(filter.reset(slave_at<Filter>(1), random[0]) == Status::kOk);
  REQUIRE(other.filter.reset(slave_at<Filter>(1), random[1]) == Status::kOk);

  auto wrong = master_at<Filter>(0);
  wrong.x(5) = nan;
  CHECK(filter.add_master(wrong) == Status::kNotFinite);
  wrong = master_at<Filter>(0);
  wrong.P(5, 2) = nan;
  CHECK(filter.add_master(wrong) == Status::kNotFinite);
  wrong = master_at<Filter>(0);
  wrong.P(3, 3) = 0;
  CHECK(filter.add_master(wrong) == Status::kNotPositiveDefinite);
  CHECK(filter.masters() == 0);
  run(filter, random[0], 3);
  run(other.filter, random[1], 3);

  CHECK(filter.add_master(master_at<Filter>(0)) == Status::kBadParameter);
  auto slave = slave_at<Filter>(1);
  slave.x(1) = nan;
  CHECK(filter.reset(slave, random[0]) == Status::kNotFinite);
  slave = slave_at<Filter>(1);
  slave.P(1, 0) = INFINITY;
  CHECK(filter.reset(slave, random[0]) == Status::kNotFinite);
  const Pair plan[2] = {Pair(0, 0), Pair(0, nan)};
  CHECK(filter.predict(nan, u, random[0]) == Status::kNotFinite);
  CHECK(filter.predict(INFINITY, u, random[0]) == Status::kNotFinite);
  CHECK(filter.predict(-1, u, random[0]) == Status::kTimeBackwards);
  CHECK(filter.predict(1, Pair(nan, 0), random[0]) == Status::kNotFinite);
  CHECK(filter.predict(1, Pair(2, INFINITY), random[0]) == Status::kNotFinite);
  CHECK(filter.predict(1, u, random[0], plan) == Status::kNotFinite);
  CHECK(filter.update(seen, -1, sonar, random[0]) == Status::kBadParameter);
  CHECK(filter.update(seen, 3, sonar, random[0]) == Status::kBadParameter);
  CHECK(filter.update(seen, 0, sonar, random[0]) == Status::kOk);  // nothing was heard
  for (const float z : {1.1e9f, -1.1e9f}) {
    seen[1].z(0) = z;
    CHECK(filter.update(seen, 2, sonar, random[0]) == Status::kOverflow);
    seen[1].z << 250, z;
    CHECK(filter.update(seen, 2, sonar, random[0]) == Status::kOverflow);
    seen[1].z << 250, -0.65f;
  }
  for (const int master : {-2, 0, 2}) {  // no such number, heard twice, not there
    seen[1].master = master;
    CHECK(filter.update(seen, 2, sonar, random[0]) == Status::kBadParameter);
  }
  check_same(filter, other.filter);
  check_same_numbers(filter, other.filter);
  REQUIRE(filter.predict(1, u, random[0]) == Status::kOk);
  REQUIRE(other.filter.predict(1, u, random[1]) == Status::kOk);
  check_same(filter, other.filter);  // and they drew the same numbers
}

TEST_CASE("second run: dead reckoning forgets and refuses as the others do") {
  using Filter = auvest::DeadReckoning<FloatCompass>;
  const float nan = std::nanf("");
  const Pair u(2, 0.1f);
  Filter used{FloatCompass()};
  Random random(9);
  CHECK(used.predict(1, u, random) == Status::kNotInitialised);
  CHECK(used.update(nullptr, 0, auvest::Sonar<float>(), random) == Status::kNotInitialised);
  auto start = slave_at<Filter>(1);
  start.P(0, 1) = nan;  // only the lower triangle is read
  REQUIRE(used.reset(start, random) == Status::kOk);
  CHECK(used.slave().x == start.x);
  CHECK(used.slave().P(0, 1) == 0.2f);
  CHECK(used.update(nullptr, 0, auvest::Sonar<float>(), random) == Status::kOk);
  for (int k = 0; k < 5; ++k) REQUIRE(used.predict(1, u, random) == Status::kOk);
  const auto before = used.slave();
  CHECK(before.P(0, 1) == before.P(1, 0));
  start.x(0) = INFINITY;
  CHECK(used.reset(start, random) == Status::kNotFinite);
  start = slave_at<Filter>(1);
  start.P(1, 0) = nan;
  CHECK(used.reset(start, random) == Status::kNotFinite);
  CHECK(used.predict(nan, u, random) == Status::kNotFinite);
  CHECK(used.predict(1, Pair(2, nan), random) == Status::kNotFinite);
  CHECK(used.predict(-1, u, random) == Status::kTimeBackwards);
  CHECK(used.slave().x == before.x);
  CHECK(used.slave().P == before.P);

  Filter fresh{FloatCompass()};
  for (Filter* each : {&used, &fresh}) {
    REQUIRE(each->reset(slave_at<Filter>(1), random) == Status::kOk);
    REQUIRE(each->predict(1, u, random) == Status::kOk);
  }
  CHECK(used.slave().x == fresh.slave().x);
  CHECK(used.slave().P == fresh.slave().P);
}

}  // namespace
