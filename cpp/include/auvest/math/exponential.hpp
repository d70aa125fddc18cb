// The exponential and the natural logarithm.
//
// float: own implementations from + - * and integer operations in one fixed order, so the bits are
// the same on every target; at most 2 ulp from the true value for every float. double: <cmath>.
// Where double has 32 bits, the double overloads are the float functions.
// Derivation and measured errors: docs/algorithms/math.md.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "auvest/config.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/bits.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {
namespace detail {

/// e^r for |r| <= ln(2)/2 after x = k ln 2 + r; `shifted` has k in its last bits. ln 2 in two
/// parts: k times the first (15 bits) is exact.
template <class Value>
AUVEST_INLINE Value exp_kernel(const Value& x, Value& shifted) {
  const Value shift(12582912.0f);  // 1.5 * 2^23: adding it rounds to an integer
  shifted = x * Value(1.44269504f) + shift;
  const Value k = shifted - shift;
  const Value r = (x - k * Value(6.93145752e-01f)) - k * Value(1.42860677e-06f);
  const Value p = Value(4.99999934e-01f) +
                  r * (Value(1.66665204e-01f) +
                       r * (Value(4.16683893e-02f) +
                            r * (Value(8.36874583e-03f) + r * Value(1.38146205e-03f))));
  return Value(1) + (r + (r * r) * p);
}

/// ln(m 2^k), sqrt(1/2) <= m < sqrt(2): ln(1 + f) = f - f^2/2 + f^3 P(f).
template <class Value>
AUVEST_INLINE Value log_kernel(const Value& m, const Value& k) {
  const Value f = m - Value(1);  // exact
  const Value u = f * f;
  const Value p =
      Value(3.33333313e-01f) +
      f * (Value(-2.50008225e-01f) +
           f * (Value(2.00012267e-01f) +
                f * (Value(-1.66233569e-01f) +
                     f * (Value(1.42017558e-01f) +
                          f * (Value(-1.31601885e-01f) +
                               f * (Value(1.27615809e-01f) + f * Value(-7.63447732e-02f)))))));
  const Value tail = (f * u) * p + k * Value(1.42860677e-06f);
  return k * Value(6.93145752e-01f) + (f + (tail - Value(0.5f) * u));
}

}  // namespace detail

/// e^x. Above log(FLT_MAX): infinity. Results below FLT_MIN go through the subnormals to 0.
inline float exp(float x) {
  if (is_nan(x)) return quiet_nan();
  if (x > 88.7228317f) return infinity();
  if (x < -104.0f) return 0.0f;
  float shifted;
  const float e = detail::exp_kernel(x, shifted);
  return detail::scale_by_power(e, static_cast<int32_t>(to_bits(shifted) - 0x4b400000u));
}

/// ln(x). Zero: -infinity. Below zero: NaN.
inline float log(float x) {
  uint32_t bits = to_bits(x);
  int32_t power = -127;
  if (bits - 0x00800000u >= 0x7f000000u) {  // not a positive normal number
    if ((bits & 0x7fffffffu) == 0) return -infinity();
    if (bits == 0x7f800000u) return x;
    if (bits > 0x7f800000u) return quiet_nan();
    bits = to_bits(static_cast<float>(static_cast<int32_t>(bits)));  // subnormal: times 2^149
    power -= 149;
  }
  // x = m 2^power, sqrt(1/2) <= m < sqrt(2).
  bits += 0x3f800000u - 0x3f3504f3u;
  power += static_cast<int32_t>(bits >> 23);
  const float m = from_bits((bits & 0x007fffffu) + 0x3f3504f3u);
  return detail::log_kernel(m, static_cast<float>(power));
}

/// e^x where that is a normal number: for batches, which need not look for other x.
AUVEST_INLINE float exp_normal(float x) { return exp(x); }

/// ln(x) for a positive normal number: as above.
AUVEST_INLINE float log_normal(float x) { return log(x); }

namespace detail {

/// The double functions, by the size of double.
template <std::size_t Bytes>
struct DoubleExponential {
  static double exp(double x) { return std::exp(x); }
  static double log(double x) { return std::log(x); }
};

template <>
struct DoubleExponential<4> {
  static double exp(double x) { return static_cast<double>(math::exp(static_cast<float>(x))); }
  static double log(double x) { return static_cast<double>(math::log(static_cast<float>(x))); }
};

}  // namespace detail

inline double exp(double x) { return detail::DoubleExponential<sizeof(double)>::exp(x); }
inline double log(double x) { return detail::DoubleExponential<sizeof(double)>::log(x); }
inline double exp_normal(double x) { return exp(x); }
inline double log_normal(double x) { return log(x); }

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
