// wrap: unchanged inside, congruent modulo the real 2 pi outside, idempotent.

#include <doctest/doctest.h>

#include <cfloat>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>

#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/bits.hpp"

namespace math = auvest::math;

namespace {

const float kInfinity = std::numeric_limits<float>::infinity();
const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kPi = 3.14159274f;
const long double kTwoPi = 6.283185307179586476925286766559L;
const long double kTwoPiTail = -1.0033115225336664047e-19L;  // 2 pi minus its 80-bit value

/// Distance on the circle of `wrapped` from `a`, in units of the float spacing at `wrapped`. The
/// remainder by the 80-bit 2 pi is off by |turns| * 2^-63 at most: good for |a| up to 1e5.
double incongruence_ulp(float a, float wrapped) {
  const long double gap =
      std::remainder(static_cast<long double>(a) - static_cast<long double>(wrapped), kTwoPi);
  return static_cast<double>(std::fabs(gap)) /
         std::ldexp(1.0, std::ilogb(static_cast<double>(wrapped)) - 23);
}

bool inside(float a) { return a > -kPi && a <= kPi; }

TEST_CASE("wrap: the first double above pi comes to lie on pi, not on -pi") {
  // It is congruent to -3.14159265358979303, whose nearest double is -pi: the open end.
  const double above = std::nextafter(auvest::math::pi<double>(), 4.0);
  CHECK(auvest::math::wrap(above) == auvest::math::pi<double>());
  CHECK(auvest::math::wrap(-above) == auvest::math::pi<double>());
}

}  // namespace

TEST_CASE("wrap (float): inside (-pi, pi] nothing changes, bit for bit") {
  uint32_t changed = 0;
  for (uint32_t pattern = 0; pattern <= 0x40490fdbu; pattern += 499u) {
    const float a = math::from_bits(pattern);
    if (math::to_bits(math::wrap(a)) != pattern) ++changed;
    if (math::to_bits(math::wrap(-a)) != (pattern | 0x80000000u)) ++changed;
  }
  CHECK(changed == 0);
  CHECK(math::to_bits(math::wrap(-0.0f)) == 0x80000000u);
  CHECK(math::wrap(kPi) == kPi);
  CHECK(math::wrap(-kPi) == kPi);
  CHECK(math::wrap(-std::nextafter(kPi, 0.0f)) == -std::nextafter(kPi, 0.0f));
}

TEST_CASE("wrap (float): congruent modulo the real 2 pi") {
  double worst = 0.0;
  uint32_t outside = 0;
  for (uint32_t pattern = 0x40490fdcu; pattern < 0x47c35000u; pattern += 101u) {
    const float a = math::from_bits(pattern ^ ((pattern & 2u) << 30));
    const float wrapped = math::wrap(a);
    if (!inside(wrapped)) ++outside;
    const double error = incongruence_ulp(a, wrapped);
    if (!(error <= worst)) worst = error;
  }
  CHECK(outside == 0);
  CHECK(worst < 0.7);
}

TEST_CASE("wrap (float): the whole range against sin and cos of the same number") {
  // The double sin and cos reduce by the real 2 pi, whatever the size of the argument.
  double worst = 0.0;
  uint32_t outside = 0;
  for (uint32_t pattern = 0x40490fdcu; pattern < 0x7f800000u; pattern += 1009u) {
    const float a = math::from_bits(pattern ^ ((pattern & 2u) << 30));
    const float wrapped = math::wrap(a);
    if (!inside(wrapped)) ++outside;
    const double wide = static_cast<double>(a);
    double gap = static_cast<double>(wrapped) - std::atan2(std::sin(wide), std::cos(wide));
    if (gap > 3.2) gap -= 6.283185307179586;
    if (gap < -3.2) gap += 6.283185307179586;
    const double error =
        std::fabs(gap) / std::ldexp(1.0, std::ilogb(static_cast<double>(wrapped)) - 23);
    if (!(error <= worst)) worst = error;
  }
  CHECK(outside == 0);
  CHECK(worst < 0.7);
}

TEST_CASE("wrap (float): neighbours of the multiples of pi stay inside and are congruent") {
  double worst = 0.0;
  for (int k = 1; k < 2000; ++k) {
    const float at = static_cast<float>(static_cast<double>(k) * 3.14159265358979323846);
    for (int step = -3; step <= 3; ++step) {
      const float a = math::from_bits(math::to_bits(at) + static_cast<uint32_t>(step));
      for (const float signed_a : {a, -a}) {
        const float wrapped = math::wrap(signed_a);
        CHECK(inside(wrapped));
        if (k == 1 && math::absolute(a) <= kPi) continue;
        const double error = incongruence_ulp(signed_a, wrapped);
        if (!(error <= worst)) worst = error;
      }
    }
  }
  // Only at the seam can more than half an ulp appear: -pi is given as +pi.
  CHECK(worst <= 1.0);
  // Not the remainder by the float 2 pi, which would be 0 here.
  CHECK(math::wrap(6.28318548f) == 1.74845553e-07f);
  CHECK(math::wrap(-6.28318548f) == -1.74845553e-07f);
}

TEST_CASE("wrap (float): idempotent, to the bit") {
  uint32_t changed = 0;
  for (uint32_t pattern = 0; pattern < 0x7f800000u; pattern += 4001u) {
    const float once = math::wrap(math::from_bits(pattern ^ ((pattern & 2u) << 30)));
    if (math::to_bits(math::wrap(once)) != math::to_bits(once)) ++changed;
  }
  CHECK(changed == 0);
}

TEST_CASE("wrap: what is not finite gives NaN") {
  const float none[] = {kInfinity, -kInfinity, kNan};
  for (float a : none) {
    CHECK(math::to_bits(math::wrap(a)) == 0x7fc00000u);
    CHECK(std::isnan(math::wrap(static_cast<double>(a))));
  }
}

TEST_CASE("wrap (double): unchanged inside, congruent outside, idempotent") {
  const double pi = math::pi<double>();
  CHECK(math::wrap(pi) == pi);
  CHECK(math::wrap(-pi) == pi);
  CHECK(std::signbit(math::wrap(-0.0)));
  CHECK(math::wrap(3.0) == 3.0);
  CHECK(math::wrap(-3.0) == -3.0);
  CHECK(math::wrap(2.0 * pi) == -2.4492935982947064e-16);
  double worst = 0.0;
  for (int i = -40000; i <= 40000; ++i) {
    const double a = static_cast<double>(i) * 0.00317;
    const double wrapped = math::wrap(a);
    REQUIRE(wrapped > -pi);
    REQUIRE(wrapped <= pi);
    REQUIRE(math::wrap(wrapped) == wrapped);
    if (std::fabs(a) <= pi) REQUIRE(wrapped == a);
    // a - turns * 2 pi to the last bit: one rounding, then the part of 2 pi below 80 bits.
    const long double turns = std::round(static_cast<long double>(a) / kTwoPi);
    const long double truth =
        std::fma(-turns, kTwoPi, static_cast<long double>(a)) - turns * kTwoPiTail;
    const long double gap = static_cast<long double>(wrapped) - truth;
    const double spacing = i == 0 ? 1.0 : std::ldexp(1.0, std::ilogb(wrapped) - 52);
    const double error = static_cast<double>(std::fabs(gap)) / spacing;
    if (!(error <= worst)) worst = error;
  }
  CHECK(worst < 2.0);
  // Both sides of the border at 3 pi.
  const double border = 9.424777960769379;
  for (const double a : {std::nextafter(border, 0.0), border, std::nextafter(border, 10.0),
                         std::nextafter(std::nextafter(border, 10.0), 10.0)}) {
    CHECK(std::fabs(math::wrap(a)) <= pi);
    CHECK(math::wrap(a) > -pi);
    CHECK(math::wrap(-a) > -pi);
    CHECK(std::fabs(std::sin(math::wrap(a)) - std::sin(a)) < 1e-15);
  }
}

TEST_CASE("golden bits: the float results that every target must repeat") {
  CHECK(math::to_bits(math::wrap(4.0f)) == 0xc0121fb5u);
  CHECK(math::to_bits(math::wrap(-9.0f)) == 0xc02de04bu);
  CHECK(math::to_bits(math::wrap(100.0f)) == 0xbf07ed51u);
  CHECK(math::to_bits(math::wrap(-1e20f)) == 0xbf375d8bu);
}
