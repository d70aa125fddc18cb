// Bit casts, classification, sign and square root.

#include <doctest/doctest.h>

#include <cfloat>
#include <cmath>
#include <cstdint>
#include <limits>

#include "auvest/math/basic.hpp"
#include "auvest/math/bits.hpp"

namespace math = auvest::math;

namespace {

const float kInfinity = std::numeric_limits<float>::infinity();
const float kNan = std::numeric_limits<float>::quiet_NaN();

}  // namespace

TEST_CASE("bits: known patterns, both ways") {
  CHECK(math::to_bits(1.0f) == 0x3f800000u);
  CHECK(math::to_bits(-0.0f) == 0x80000000u);
  CHECK(math::to_bits(-2.5f) == 0xc0200000u);
  CHECK(math::from_bits(0x00000001u) == std::numeric_limits<float>::denorm_min());
  CHECK(math::from_bits(0x7f7fffffu) == FLT_MAX);
  for (uint32_t pattern = 0; pattern < 0xffff0000u; pattern += 65521u) {
    if ((pattern & 0x7fffffffu) > 0x7f800000u) continue;  // a move may quiet a NaN
    CHECK(math::to_bits(math::from_bits(pattern)) == pattern);
  }
}

TEST_CASE("is_nan, is_finite: every exponent and the borders of the classes") {
  uint32_t disagreements = 0;
  for (uint32_t high = 0; high < 0x200u; ++high) {
    const uint32_t mantissas[] = {0u, 1u, 0x400000u, 0x7fffffu};
    for (uint32_t mantissa : mantissas) {
      const float x = math::from_bits((high << 23) | mantissa);
      if (math::is_nan(x) != std::isnan(x)) ++disagreements;
      if (math::is_finite(x) != std::isfinite(x)) ++disagreements;
      const double wide = static_cast<double>(x);
      if (math::is_nan(wide) != std::isnan(wide)) ++disagreements;
      if (math::is_finite(wide) != std::isfinite(wide)) ++disagreements;
    }
  }
  CHECK(disagreements == 0);
  CHECK(math::is_finite(DBL_MAX));
  CHECK(math::is_finite(-DBL_MAX));
  CHECK_FALSE(math::is_finite(std::numeric_limits<double>::infinity()));
}

TEST_CASE("absolute, copy_sign: the sign bit only, zeros and NaN included") {
  CHECK(math::to_bits(math::absolute(-0.0f)) == 0u);
  CHECK(math::absolute(-kInfinity) == kInfinity);
  CHECK(math::absolute(-1e-45f) == 1e-45f);
  CHECK(math::to_bits(math::copy_sign(0.0f, -3.0f)) == 0x80000000u);
  CHECK(math::copy_sign(-2.0f, 0.0f) == 2.0f);
  CHECK(math::copy_sign(2.0f, -0.0f) == -2.0f);
  CHECK(math::copy_sign(1.0f, -kInfinity) == -1.0f);
  CHECK(std::isnan(math::copy_sign(kNan, -1.0f)));
  CHECK_FALSE(std::signbit(math::absolute(-0.0)));
  CHECK(math::copy_sign(2.0, -0.0) == -2.0);
  CHECK(math::copy_sign(-2.0, 0.0) == 2.0);
}

TEST_CASE("the NaN and the infinity that float functions return") {
  CHECK(math::to_bits(math::quiet_nan()) == 0x7fc00000u);
  CHECK(math::infinity() == kInfinity);
}

TEST_CASE("sqrt: correctly rounded") {
  // The double root of a float, rounded to float, is the correctly rounded float root (53 bits are
  // more than 2 * 24 + 2).
  uint32_t wrong = 0;
  for (uint32_t pattern = 1; pattern < 0x7f800000u; pattern += 4099u) {
    const float x = math::from_bits(pattern);
    if (math::sqrt(x) != static_cast<float>(std::sqrt(static_cast<double>(x)))) ++wrong;
  }
  CHECK(wrong == 0);
  CHECK(math::to_bits(math::sqrt(-0.0f)) == 0x80000000u);
  CHECK(math::sqrt(kInfinity) == kInfinity);
  CHECK(math::is_nan(math::sqrt(-1.0f)));
  CHECK(math::sqrt(2.25) == 1.5);
}

TEST_CASE("constants are the nearest of their format") {
  CHECK(math::to_bits(math::pi<float>()) == 0x40490fdbu);
  CHECK(math::to_bits(math::half_pi<float>()) == 0x3fc90fdbu);
  CHECK(math::to_bits(math::two_pi<float>()) == 0x40c90fdbu);
  CHECK(math::pi<double>() == std::acos(-1.0));
  CHECK(math::half_pi<double>() == std::acos(0.0));
  CHECK(math::two_pi<double>() == 2.0 * std::acos(-1.0));
}

TEST_CASE("scale_by_power: like ldexp, into the subnormals and to zero") {
  const float values[] = {1.0f, 1.5f, 1.99999988f, 0.707106769f, 1.17549435e-38f, 3.0e38f};
  for (float x : values) {
    for (int32_t power = -290; power < 0; ++power) {
      const float expected = std::ldexp(x, power);
      const float computed = math::detail::scale_by_power(x, power);
      // A tie is rounded up where IEEE 754 rounds it to even.
      const uint32_t difference = math::to_bits(computed) - math::to_bits(expected);
      CAPTURE(x);
      CAPTURE(power);
      CHECK(difference <= (expected < FLT_MIN ? 1u : 0u));
    }
  }
  CHECK(math::detail::scale_by_power(0.75f, 128) == std::ldexp(0.75f, 128));
  CHECK(math::to_bits(math::detail::scale_by_power(1.25f, -149)) == 1u);
  CHECK(math::to_bits(math::detail::scale_by_power(1.75f, -149)) == 2u);
  CHECK(math::to_bits(math::detail::scale_by_power(1.75f, -150)) == 1u);
  CHECK(math::to_bits(math::detail::scale_by_power(1.75f, -151)) == 0u);
}
