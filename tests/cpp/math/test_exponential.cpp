// exp, log: errors against the double libm, overflow, underflow, special values.

#include <doctest/doctest.h>

#include <cfloat>
#include <cmath>
#include <cstdint>
#include <limits>

#include "auvest/math/basic.hpp"
#include "auvest/math/bits.hpp"
#include "auvest/math/exponential.hpp"

namespace math = auvest::math;

namespace {

const float kInfinity = std::numeric_limits<float>::infinity();
const float kNan = std::numeric_limits<float>::quiet_NaN();

/// |computed - truth| in units of the float spacing at truth.
double error_ulp(float computed, double truth) {
  if (!std::isfinite(computed)) return 1e30;
  int exponent = truth == 0.0 ? -126 : std::ilogb(truth);
  if (exponent < -126) exponent = -126;
  return std::fabs(static_cast<double>(computed) - truth) * std::ldexp(1.0, 23 - exponent);
}

struct Worst {
  double ulp = 0.0;
  void take(double error) {
    if (!(error <= ulp)) ulp = error;
  }
};

}  // namespace

TEST_CASE("exp: at most 2 ulp, normal and subnormal results") {
  Worst normal, subnormal;
  for (uint32_t pattern = 0x30000000u; pattern <= 0x42b17218u; pattern += 293u) {
    const float x = math::from_bits(pattern);
    normal.take(error_ulp(math::exp(x), std::exp(static_cast<double>(x))));
    if (x < 87.3f) normal.take(error_ulp(math::exp(-x), std::exp(static_cast<double>(-x))));
  }
  for (float x = -87.3f; x > -105.0f; x -= 0.0001f) {
    subnormal.take(error_ulp(math::exp(x), std::exp(static_cast<double>(x))));
  }
  CHECK(normal.ulp < 1.0);
  CHECK(subnormal.ulp < 1.1);
}

TEST_CASE("exp: both sides of the overflow and of the underflow") {
  CHECK(error_ulp(math::exp(88.7228317f), std::exp(static_cast<double>(88.7228317f))) < 1.1);
  CHECK(math::exp(std::nextafter(88.7228317f, 100.0f)) == kInfinity);
  CHECK(math::exp(FLT_MAX) == kInfinity);
  CHECK(math::to_bits(math::exp(-103.9f)) == 1u);  // the smallest subnormal
  CHECK(math::to_bits(math::exp(-104.0f)) == 0u);
  CHECK(math::to_bits(math::exp(-104.1f)) == 0u);
  CHECK(math::to_bits(math::exp(-FLT_MAX)) == 0u);
}

TEST_CASE("exp: special values") {
  CHECK(math::exp(0.0f) == 1.0f);
  CHECK(math::exp(-0.0f) == 1.0f);
  CHECK(math::exp(1e-45f) == 1.0f);
  CHECK(math::exp(kInfinity) == kInfinity);
  CHECK(math::to_bits(math::exp(-kInfinity)) == 0u);
  CHECK(math::to_bits(math::exp(kNan)) == 0x7fc00000u);
  CHECK(math::to_bits(math::exp(-kNan)) == 0x7fc00000u);
}

TEST_CASE("exp grows: no step back where the power of two changes") {
  // Between k ln 2 and its neighbours the result comes from two different powers.
  for (int k = -120; k <= 120; ++k) {
    float x = static_cast<float>((k + 0.5) * 0.69314718055994531);
    for (int step = -20; step < 20; ++step) {
      const float here = math::from_bits(math::to_bits(x) + static_cast<uint32_t>(step));
      const float next = std::nextafter(here, kInfinity);
      CHECK(math::exp(next) >= math::exp(here) * 0.9999999f);
    }
  }
}

TEST_CASE("log: at most 2 ulp, normal and subnormal arguments") {
  Worst normal, subnormal, near_one;
  for (uint32_t pattern = 0x00800000u; pattern < 0x7f800000u; pattern += 2297u) {
    const float x = math::from_bits(pattern);
    normal.take(error_ulp(math::log(x), std::log(static_cast<double>(x))));
  }
  for (uint32_t pattern = 1; pattern < 0x00800000u; pattern = pattern * 5u / 4u + 1u) {
    const float x = math::from_bits(pattern);
    subnormal.take(error_ulp(math::log(x), std::log(static_cast<double>(x))));
  }
  for (uint32_t pattern = 0x3f300000u; pattern < 0x3fc00000u; pattern += 31u) {
    const float x = math::from_bits(pattern);
    near_one.take(error_ulp(math::log(x), std::log(static_cast<double>(x))));
  }
  CHECK(normal.ulp < 1.0);
  CHECK(subnormal.ulp < 1.0);
  CHECK(near_one.ulp < 1.0);
}

TEST_CASE("log: special values") {
  CHECK(math::to_bits(math::log(1.0f)) == 0u);
  CHECK(math::log(0.0f) == -kInfinity);
  CHECK(math::log(-0.0f) == -kInfinity);
  CHECK(math::log(kInfinity) == kInfinity);
  const float none[] = {-1.0f, -1e-45f, -FLT_MAX, -kInfinity, kNan, -kNan};
  for (float x : none) CHECK(math::to_bits(math::log(x)) == 0x7fc00000u);
  // Neighbours of 1: log(1 + e) = e - e^2/2 and only that survives.
  CHECK(math::log(1.00000012f) == 1.1920928244535389e-07f);
  CHECK(math::log(0.99999994f) == -5.9604646551e-08f);
}

TEST_CASE("double exp, log are libm's") {
  CHECK(math::exp(-3.25) == std::exp(-3.25));
  CHECK(math::log(3.25) == std::log(3.25));
}

TEST_CASE("golden bits: the float results that every target must repeat") {
  CHECK(math::to_bits(math::exp(1.0f)) == 0x402df854u);
  CHECK(math::to_bits(math::exp(-10.3f)) == 0x380d1141u);
  CHECK(math::to_bits(math::exp(-95.0f)) == 0x00000f64u);
  CHECK(math::to_bits(math::exp(88.0f)) == 0x7ef882b7u);
  CHECK(math::to_bits(math::log(0.3f)) == 0xbf9a1bc8u);
  CHECK(math::to_bits(math::log(1.1f)) == 0x3dc331ffu);
  CHECK(math::to_bits(math::log(1e30f)) == 0x428a27b5u);
  CHECK(math::to_bits(math::log(1e-42f)) == 0xc2c16a85u);
}
