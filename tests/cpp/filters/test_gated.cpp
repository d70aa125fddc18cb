// The gate: the filter inside, bit for bit, but for what it refuses; and the way back.
#include <doctest/doctest.h>

#include <cstring>
#include <limits>

#include "auvest/auvest.hpp"

namespace {

using auvest::Status;
using auvest::Vector;
using Process = auvest::EulerAcceleration<float>;
using Plain = auvest::Ukf<Process>;
using Filter = auvest::Gated<Plain>;
using Sonar = auvest::RangeBearing<float, 6>;

template <class Kind>
Kind started() {
  Kind filter;
  Vector<float, 6> x;
  x << 3, -4, 0.2f, 0.1f, 0, 0.01f;
  const auvest::Matrix<float, 6, 6> P = 0.01f * auvest::Matrix<float, 6, 6>::Identity();
  REQUIRE(filter.reset(x, P) == Status::kOk);
  return filter;
}

bool same(const Plain& a, const Plain& b) {
  return std::memcmp(&a.belief(), &b.belief(), sizeof a.belief()) == 0;
}

/// What the sonar measures of a vehicle at (x, y).
Vector<float, 2> seen(float x, float y) {
  Vector<float, 6> state = Vector<float, 6>::Zero();
  state(0) = x;
  state(1) = y;
  return Sonar().h(state);
}

TEST_CASE("gate: what it lets through has the bits of the filter inside, the rest is refused") {
  Filter gated = started<Filter>();
  Plain plain = started<Plain>();
  CHECK(gated.gate() == 13.8f);
  const Sonar sonar;
  auvest::math::Random random(1);
  int refused = 0;
  for (int k = 0; k < 300; ++k) {
    REQUIRE(gated.predict(0.5f) == Status::kOk);
    REQUIRE(plain.predict(0.5f) == Status::kOk);
    Vector<float, 2> z = sonar.h(plain.x());
    z(0) += 0.05f * random.normal<float>();
    z(1) += 0.01f * random.normal<float>();
    if (k % 10 == 7) z(0) += 2.5f;
    const Filter before = gated;
    Plain without = plain;
    const auto wanted = without.update(z, sonar);
    const auto found = gated.update(z, sonar);
    REQUIRE(wanted.status == Status::kOk);
    CHECK(found.nis == wanted.nis);
    CHECK(found.innovation == wanted.innovation);
    CHECK(found.S == wanted.S);
    if (wanted.nis > 13.8f) {
      ++refused;
      CHECK(found.status == Status::kImplausible);
      CHECK(same(gated, before));
    } else {
      CHECK(found.status == Status::kOk);
      plain = without;
    }
    CHECK(same(gated, plain));
  }
  CHECK(refused >= 25);  // of 30 that are wrong
  CHECK(refused <= 33);
}

TEST_CASE("gate: an estimate that is wrong stays so, until it is widened") {
  Filter gated = started<Filter>();
  const Vector<float, 2> z = seen(4, -6);  // 2.2 m from there, with sigmas of 0.1 m
  auto correction = gated.update(z, Sonar());
  for (int k = 0; k < 20; ++k) {
    REQUIRE(correction.status == Status::kImplausible);
    CHECK(correction.nis > 100);
    correction = gated.update(z, Sonar());
  }
  const auvest::Matrix<float, 6, 6> P = gated.P();
  REQUIRE(gated.widen(correction.nis) == Status::kOk);
  CHECK(gated.P() == correction.nis * P);
  correction = gated.update(z, Sonar());
  CHECK(correction.status == Status::kOk);
  CHECK((gated.x().head<2>() - Vector<float, 2>(4, -6)).norm() < 0.1f);
}

TEST_CASE("gate: what cannot be is refused and changes nothing") {
  Filter gated;
  CHECK(gated.widen(2) == Status::kNotInitialised);
  gated = started<Filter>();
  const Filter before = gated;
  const float infinity = std::numeric_limits<float>::infinity();
  CHECK(gated.set_gate(0) == Status::kBadParameter);
  CHECK(gated.set_gate(-1) == Status::kBadParameter);
  CHECK(gated.set_gate(infinity) == Status::kBadParameter);
  CHECK(gated.gate() == 13.8f);
  CHECK(gated.widen(0.5f) == Status::kBadParameter);
  CHECK(gated.widen(infinity) == Status::kNotFinite);
  REQUIRE(gated.widen(1e30f) == Status::kOk);
  const Filter wide = gated;
  CHECK(gated.widen(1e30f) == Status::kOverflow);
  CHECK(same(gated, wide));
  REQUIRE(gated.restore(before.belief()) == Status::kOk);
  auto correction = gated.update(Vector<float, 2>(infinity, 0), Sonar());
  CHECK(correction.status == Status::kNotFinite);
  CHECK(correction.nis == 0);
  CHECK(same(gated, before));
  REQUIRE(gated.set_gate(5) == Status::kOk);
  Vector<float, 2> z = Sonar().h(gated.x());
  z(0) += 0.28f;  // S of the range is 0.01 + 0.0025: a NIS of 6.3
  correction = gated.update(z, Sonar());
  CHECK(correction.status == Status::kImplausible);
  CHECK(correction.nis > 5);
  CHECK(correction.nis < 7);
}

TEST_CASE("gate: inside a filter that chooses its interval") {
  auvest::AdaptiveInterval<Filter, auvest::CovarianceBudget<float>> adaptive{
      Process(), Plain::default_params()};
  Vector<float, 6> x;
  x << 3, -4, 0.2f, 0.1f, 0, 0.01f;
  REQUIRE(adaptive.reset(x, 0.01f * auvest::Matrix<float, 6, 6>::Identity()) == Status::kOk);
  CHECK(adaptive.update(seen(30, -40), Sonar()).status == Status::kImplausible);
  CHECK(adaptive.x() == x);
  CHECK(adaptive.update(seen(3.1f, -4), Sonar()).status == Status::kOk);
}

}  // namespace
