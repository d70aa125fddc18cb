// sin, cos, sincos, atan2: errors against the libm of a wider format, special values, symmetries.

#include <doctest/doctest.h>

#include <cfloat>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "auvest/math/basic.hpp"
#include "auvest/math/bits.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"

namespace math = auvest::math;

namespace {

const float kInfinity = std::numeric_limits<float>::infinity();
const float kNan = std::numeric_limits<float>::quiet_NaN();

/// |computed - truth| in units of the float spacing at truth.
double error_ulp(float computed, double truth) {
  if (std::isnan(truth) || std::isnan(computed)) {
    return std::isnan(truth) && std::isnan(computed) ? 0.0 : 1e30;
  }
  int exponent = truth == 0.0 ? -126 : std::ilogb(truth);
  if (exponent < -126) exponent = -126;
  return std::fabs(static_cast<double>(computed) - truth) * std::ldexp(1.0, 23 - exponent);
}

double error_ulp(double computed, long double truth) {
  int exponent = truth == 0.0L ? -1022 : std::ilogb(truth);
  if (exponent < -1022) exponent = -1022;
  return static_cast<double>(std::fabs(static_cast<long double>(computed) - truth) *
                             std::ldexp(1.0L, 52 - exponent));
}

struct Worst {
  double ulp = 0.0;
  void take(double error) {
    if (!(error <= ulp)) ulp = error;
  }
};

bool same_bits(float a, float b) { return math::to_bits(a) == math::to_bits(b); }

/// The largest errors of sin and cos over floats of both signs, `step` patterns apart.
void sample_sine(uint32_t first, uint32_t last, uint32_t step, Worst& sine, Worst& cosine) {
  for (uint32_t pattern = first; pattern <= last; pattern += step) {
    const float x = math::from_bits(pattern ^ ((pattern & 2u) << 30));
    const double wide = static_cast<double>(x);
    sine.take(error_ulp(math::sin(x), std::sin(wide)));
    cosine.take(error_ulp(math::cos(x), std::cos(wide)));
  }
}

}  // namespace

TEST_CASE("sin, cos: at most 2 ulp, every range") {
  Worst sine, cosine;
  SUBCASE("|x| <= pi/4") {
    sample_sine(0x39000000u, 0x3f490fdbu, 389u, sine, cosine);
    CHECK(sine.ulp < 0.8);
    CHECK(cosine.ulp < 1.4);
  }
  SUBCASE("|x| <= 96, three-part reduction") {
    sample_sine(0x3f490fdbu, 0x42c00000u, 211u, sine, cosine);
    CHECK(sine.ulp < 1.8);
    CHECK(cosine.ulp < 1.8);
  }
  SUBCASE("up to FLT_MAX, integer reduction") {
    sample_sine(0x42c00000u, 0x7f7fffffu, 3571u, sine, cosine);
    CHECK(sine.ulp < 1.8);
    CHECK(cosine.ulp < 1.8);
  }
}

TEST_CASE("sin, cos: floats next to multiples of pi/2, where the reduction cancels most") {
  Worst sine, cosine;
  for (int32_t k = 1; k < 4000000; k = k < 5000 ? k + 1 : k + 997) {
    const float nearest = static_cast<float>(static_cast<double>(k) * 1.5707963267948966);
    for (int step = -2; step <= 2; ++step) {
      const float x = math::from_bits(math::to_bits(nearest) + static_cast<uint32_t>(step));
      sine.take(error_ulp(math::sin(x), std::sin(static_cast<double>(x))));
      cosine.take(error_ulp(math::cos(-x), std::cos(static_cast<double>(x))));
    }
  }
  CHECK(sine.ulp < 1.8);
  CHECK(cosine.ulp < 1.8);
  // Of all floats the closest to a multiple of pi/2: 1.6e-9 rad from it.
  const float closest = 16367173.0f * 4722366482869645213696.0f;  // * 2^72
  CHECK(error_ulp(math::cos(closest), std::cos(static_cast<double>(closest))) < 1.8);
  CHECK(error_ulp(math::sin(closest), std::sin(static_cast<double>(closest))) < 1.8);
}

TEST_CASE("sin, cos, sincos: special values") {
  CHECK(same_bits(math::sin(0.0f), 0.0f));
  CHECK(same_bits(math::sin(-0.0f), -0.0f));
  CHECK(math::cos(0.0f) == 1.0f);
  CHECK(math::cos(-0.0f) == 1.0f);
  const float tiny[] = {1e-45f, -1e-45f, FLT_MIN, -1e-20f, 2e-4f};
  for (float x : tiny) {
    CHECK(same_bits(math::sin(x), static_cast<float>(std::sin(static_cast<double>(x)))));
    CHECK(math::cos(x) == 1.0f);
  }
  for (float x : {0.0f, -0.0f, 1e-45f, -1e-45f, FLT_MIN, -1e-20f, -2e-4f}) {
    float s = 1.0f, c = 0.0f;
    math::sincos(x, s, c);
    CHECK(same_bits(s, math::sin(x)));  // and so the sign of a zero
    CHECK(c == 1.0f);
  }
  const float none[] = {kInfinity, -kInfinity, kNan};
  for (float x : none) {
    CHECK(math::to_bits(math::sin(x)) == 0x7fc00000u);
    CHECK(math::to_bits(math::cos(x)) == 0x7fc00000u);
    float s = 0.0f, c = 0.0f;
    math::sincos(x, s, c);
    CHECK(math::to_bits(s) == 0x7fc00000u);
    CHECK(math::to_bits(c) == 0x7fc00000u);
  }
}

TEST_CASE("sincos has the bits of sin and cos; sin is odd and cos even, to the bit") {
  uint32_t wrong = 0;
  for (uint32_t pattern = 0; pattern < 0x7f800000u; pattern += 7013u) {
    const float x = math::from_bits(pattern);
    float s, c;
    math::sincos(x, s, c);
    if (!same_bits(s, math::sin(x)) || !same_bits(c, math::cos(x))) ++wrong;
    if (!same_bits(math::sin(-x), -s) || !same_bits(math::cos(-x), c)) ++wrong;
  }
  CHECK(wrong == 0);
}

TEST_CASE("float atan2: at most 2 ulp") {
  math::Random random(1);
  Worst worst;
  SUBCASE("any two floats") {
    for (int i = 0; i < 400000; ++i) {
      const float y = math::from_bits(random.next_u32());
      const float x = math::from_bits(random.next_u32());
      worst.take(
          error_ulp(math::atan2(y, x), std::atan2(static_cast<double>(y), static_cast<double>(x))));
    }
  }
  SUBCASE("[-1, 1)^2") {
    for (int i = 0; i < 400000; ++i) {
      const float y = 2.0f * random.uniform<float>() - 1.0f;
      const float x = 2.0f * random.uniform<float>() - 1.0f;
      worst.take(
          error_ulp(math::atan2(y, x), std::atan2(static_cast<double>(y), static_cast<double>(x))));
    }
  }
  SUBCASE("quotients between 2^-150 and 1, through the subnormals") {
    for (int i = 0; i < 300000; ++i) {
      const float x = 1.0f + random.uniform<float>();
      const float y = std::ldexp(1.0f + random.uniform<float>(), -(i % 151));
      worst.take(
          error_ulp(math::atan2(y, x), std::atan2(static_cast<double>(y), static_cast<double>(x))));
      worst.take(error_ulp(math::atan2(-x, -y),
                           std::atan2(static_cast<double>(-x), static_cast<double>(-y))));
    }
  }
  CHECK(worst.ulp < 1.9);
}

TEST_CASE("atan2: C99's special values, float and double") {
  const float values[] = {0.0f,     -0.0f,     1.0f,       -1.0f,   1e-45f,   -1e-45f, FLT_MAX,
                          -FLT_MAX, kInfinity, -kInfinity, FLT_MIN, -FLT_MIN, 1e-30f,  1e30f};
  for (float y : values) {
    for (float x : values) {
      CAPTURE(y);
      CAPTURE(x);
      const double truth = std::atan2(static_cast<double>(y), static_cast<double>(x));
      // In all of these the nearest float is within reach of one rounding.
      CHECK(same_bits(math::atan2(y, x), static_cast<float>(truth)));
      const double wide = math::atan2(static_cast<double>(y), static_cast<double>(x));
      CHECK(error_ulp(wide, static_cast<long double>(truth)) <= 1.0);
      CHECK(std::signbit(wide) == std::signbit(truth));
    }
    CHECK(math::to_bits(math::atan2(y, kNan)) == 0x7fc00000u);
    CHECK(math::to_bits(math::atan2(kNan, y)) == 0x7fc00000u);
    CHECK(std::isnan(math::atan2(static_cast<double>(y), static_cast<double>(kNan))));
    CHECK(std::isnan(math::atan2(static_cast<double>(kNan), static_cast<double>(y))));
  }
}

TEST_CASE("float atan2: odd in y, to the bit; the axes and diagonals are the nearest floats") {
  math::Random random(2);
  uint32_t wrong = 0;
  for (int i = 0; i < 100000; ++i) {
    const float y = 2.0f * random.uniform<float>() - 1.0f;
    const float x = 2.0f * random.uniform<float>() - 1.0f;
    if (!same_bits(math::atan2(-y, x), -math::atan2(y, x))) ++wrong;
  }
  CHECK(wrong == 0);
  CHECK(same_bits(math::atan2(3.0f, 3.0f), 0.785398163f));
  CHECK(same_bits(math::atan2(3.0f, -3.0f), 2.35619449f));
  CHECK(same_bits(math::atan2(7.0f, 0.0f), math::half_pi<float>()));
  CHECK(same_bits(math::atan2(0.0f, -7.0f), math::pi<float>()));
  CHECK(same_bits(math::atan2(-0.0f, -7.0f), -math::pi<float>()));
}

TEST_CASE("double atan2: at most 2 ulp of the 80-bit arctangent") {
  math::Random random(3);
  Worst worst;
  const auto take = [&worst](double y, double x) {
    worst.take(error_ulp(math::atan2(y, x),
                         std::atan2(static_cast<long double>(y), static_cast<long double>(x))));
  };
  SUBCASE("[-1, 1)^2") {
    for (int i = 0; i < 300000; ++i) {
      const double y = 2.0 * random.uniform<double>() - 1.0;
      take(y, 2.0 * random.uniform<double>() - 1.0);
    }
  }
  SUBCASE("next to the nodes of the table and the borders of its intervals") {
    for (int i = 0; i < 200000; ++i) {
      double x = 0.5 + random.uniform<double>();
      double y = x * static_cast<double>(i % 129) / 128.0;
      if ((i & 1) != 0) y = std::nextafter(y, 9.0);
      if ((i & 2) != 0) y = std::nextafter(y, -9.0);
      if ((i & 4) != 0) std::swap(x, y);
      take((i & 8) != 0 ? -y : y, (i & 16) != 0 ? -x : x);
    }
  }
  SUBCASE("far from 1") {
    for (int i = 0; i < 100000; ++i) {
      const int power = static_cast<int>(random.next_u32() % 2000u) - 1000;
      const double y = std::ldexp(0.5 + random.uniform<double>(), power);
      take(y, std::ldexp(0.5 + random.uniform<double>(), power + i % 23 - 11));
    }
  }
  CHECK(worst.ulp < 1.9);
}

TEST_CASE("double sin, cos, sincos are libm's") {
  double s, c;
  math::sincos(1.25, s, c);
  CHECK(s == std::sin(1.25));
  CHECK(c == std::cos(1.25));
  CHECK(math::sin(-2.5) == std::sin(-2.5));
  CHECK(math::cos(-2.5) == std::cos(-2.5));
}

TEST_CASE("golden bits: the float results that every target must repeat") {
  CHECK(math::to_bits(math::sin(1.0f)) == 0x3f576aa5u);
  CHECK(math::to_bits(math::sin(-2.5f)) == 0xbf193579u);
  CHECK(math::to_bits(math::sin(50.0f)) == 0xbe8655ffu);
  CHECK(math::to_bits(math::sin(1e10f)) == 0xbef99a64u);
  CHECK(math::to_bits(math::cos(1.0f)) == 0x3f0a5140u);
  CHECK(math::to_bits(math::cos(4.0f)) == 0xbf275530u);
  CHECK(math::to_bits(math::cos(-3e20f)) == 0xbf0bde85u);
  CHECK(math::to_bits(math::atan2(0.3f, -0.7f)) == 0x402f261bu);
  CHECK(math::to_bits(math::atan2(-5.0f, 2.0f)) == 0xbf985b6cu);
  CHECK(math::to_bits(math::atan2(1.0f, 9.0f)) == 0x3de2a041u);
  CHECK(math::to_bits(math::atan2(-0.6f, -0.5f)) == 0xc010fe85u);
  CHECK(math::to_bits(math::atan2(1e-30f, 3e9f)) == 0x0003a133u);
}
