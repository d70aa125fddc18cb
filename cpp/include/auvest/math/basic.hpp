// Square root, absolute value, sign and classification, and the constants of the math folder.
//
// Each has an overload for float and for double. All are exact or correctly rounded, so the float
// bits are the same on every target.
#pragma once

#include <cfloat>
#include <cmath>
#include <cstdint>
#include <limits>

#include "auvest/config.hpp"
#include "auvest/math/bits.hpp"
#include "auvest/math/select.hpp"

namespace auvest {
namespace math {

template <class Scalar>
constexpr Scalar pi() {
  return Scalar(3.14159265358979323846);
}

template <class Scalar>
constexpr Scalar half_pi() {
  return Scalar(1.57079632679489661923);
}

template <class Scalar>
constexpr Scalar two_pi() {
  return Scalar(6.28318530717958647693);
}

/// Distance from 1 to the next number.
template <class Value>
constexpr Value machine_epsilon() {
  return Value(std::numeric_limits<typename ScalarOf<Value>::Type>::epsilon());
}

/// The one NaN that float functions return (0x7fc00000). Targets differ in the NaN they make by
/// themselves.
AUVEST_INLINE float quiet_nan() { return from_bits(0x7fc00000u); }

/// Positive infinity.
AUVEST_INLINE float infinity() { return from_bits(0x7f800000u); }

/// Correctly rounded. Of a negative number: a NaN whose bits are the target's own.
AUVEST_INLINE float sqrt(float x) { return std::sqrt(x); }
AUVEST_INLINE double sqrt(double x) { return std::sqrt(x); }

AUVEST_INLINE float absolute(float x) { return std::fabs(x); }
AUVEST_INLINE double absolute(double x) { return std::fabs(x); }

/// The magnitude of `x` with the sign of `y`, zeros included.
AUVEST_INLINE float copy_sign(float x, float y) {
  return from_bits((to_bits(x) & 0x7fffffffu) | (to_bits(y) & 0x80000000u));
}
AUVEST_INLINE double copy_sign(double x, double y) { return std::copysign(x, y); }

AUVEST_INLINE bool is_nan(float x) { return (to_bits(x) & 0x7fffffffu) > 0x7f800000u; }
AUVEST_INLINE bool is_nan(double x) { return x != x; }

AUVEST_INLINE bool is_finite(float x) {
  return (leading(to_bits(x)) & leading(0x7f800000u)) != leading(0x7f800000u);
}
AUVEST_INLINE bool is_finite(double x) { return absolute(x) <= DBL_MAX; }

/// True if low <= value <= high; false for a NaN.
template <class Scalar>
AUVEST_INLINE bool within(Scalar value, Scalar low, Scalar high) {
  return value >= low && value <= high;
}

/// The value, or the bound that it is beyond, for low <= high. Not a number counts as low.
template <class Scalar>
AUVEST_INLINE Scalar clamp(Scalar value, Scalar low, Scalar high) {
  if (!(value > low)) return low;
  return value > high ? high : value;
}

/// True if 0 <= value, and finite. (In parentheses: Arduino has macros min and max.)
template <class Scalar>
AUVEST_INLINE bool is_nonnegative(Scalar value) {
  return within(value, Scalar(0), (std::numeric_limits<Scalar>::max)());
}

/// True if 0 < value, not subnormal, and finite.
AUVEST_INLINE bool is_positive(float value) {
  return leading(to_bits(value)) - leading(0x00800000u) < leading(0x7f800000u - 0x00800000u);
}
template <class Scalar>
AUVEST_INLINE bool is_positive(Scalar value) {
  return within(value, (std::numeric_limits<Scalar>::min)(), (std::numeric_limits<Scalar>::max)());
}

namespace detail {

/// x 2^power for a normal x > 0 and a result below 2^128; rounded once where it is subnormal. By
/// integers, so that nothing depends on how a target's arithmetic treats subnormals.
inline float scale_by_power(float x, int32_t power) {
  const uint32_t bits = to_bits(x);
  const int32_t exponent = static_cast<int32_t>(bits >> 23) + power;
  if (exponent >= 1) return from_bits(bits + (static_cast<uint32_t>(power) << 23));
  if (exponent < -24) return 0.0f;
  const uint32_t m = (bits & 0x007fffffu) | 0x00800000u;
  const uint32_t drop = static_cast<uint32_t>(1 - exponent);  // 1..25
  return from_bits((m + (static_cast<uint32_t>(1) << (drop - 1u))) >> drop);
}

}  // namespace detail
}  // namespace math
}  // namespace auvest
