// Readings that cannot be: beyond what the instrument measures, or changed faster than anything
// moves.
#include <doctest/doctest.h>

#include <limits>

#include "auvest/board/plausible.hpp"

namespace {

using Limits = auvest::ReadingLimits<float>;
using Reading = auvest::PlausibleReading<float>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST_CASE("plausible: within the limits, whatever it was before the first") {
  const Limits limits(0, 500, 3, 2);
  const Reading range;
  CHECK(range.admits(0, limits));
  CHECK(range.admits(500, limits));
  CHECK(!range.admits(500.1f, limits));
  CHECK(!range.admits(-0.1f, limits));
  CHECK(!range.admits(kInfinity, limits));
  CHECK(!range.admits(std::numeric_limits<float>::quiet_NaN(), limits));
}

TEST_CASE("plausible: a change may be as large as noise and time allow") {
  const Limits limits(0, 500, 3, 2);
  Reading range;
  range.take(100);
  CHECK(range.admits(102, limits));
  CHECK(range.admits(98, limits));
  CHECK(!range.admits(102.5f, limits));
  range.wait(1);
  CHECK(range.admits(105, limits));
  CHECK(!range.admits(105.5f, limits));
  CHECK(!range.admits(94.5f, limits));
  range.wait(0.5f);
  CHECK(range.admits(106.5f, limits));
  CHECK(!range.admits(300, limits));
  range.wait(66);  // a wrong one shuts nobody out for good
  CHECK(range.admits(300, limits));
  range.take(300);
  CHECK(!range.admits(106.5f, limits));
}

TEST_CASE("plausible: an angle comes round") {
  const Limits limits = Limits::angle(0.5f, 0.1f);
  Reading heading;
  CHECK(heading.admits(6.2831855f, limits));
  CHECK(heading.admits(-6.2831855f, limits));
  CHECK(!heading.admits(57, limits));  // degrees
  heading.take(3.1f);
  CHECK(heading.admits(-3.1f, limits));
  CHECK(heading.admits(3.1f - 6.2831853f, limits));
  CHECK(!heading.admits(2.9f, limits));
  CHECK(!heading.admits(-2.9f, limits));
  heading.wait(1);
  CHECK(heading.admits(-2.9f, limits));
}

TEST_CASE("plausible: without a limit of the change, any within the limits") {
  const Limits limits(0, 500, kInfinity, 0);
  Reading range;
  range.take(100);
  CHECK(range.admits(400, limits));
  range.wait(1);
  CHECK(range.admits(400, limits));
}

}  // namespace
