// Angles on the circle: wrapping to (-pi, pi].
//
// The modulus is the real number 2 pi, not the nearest float, so no error builds up over turns.
// Definition and measured errors: docs/algorithms/math.md.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "auvest/config.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/bits.hpp"
#include "auvest/math/trigonometry.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

/// The angle of (-pi, pi] that is congruent to `a` (rad) modulo 2 pi. "pi" as a bound is the
/// nearest float (double) to pi; an angle inside the bounds comes back bit for bit, others are
/// reduced modulo the real 2 pi, to within 1 ulp. Not finite: NaN.
AUVEST_OUTLINE AUVEST_INLINE float wrap(float a) {
  const float size = absolute(a);
  if (!is_finite(a)) return quiet_nan();
  // Compared by their bits: an 8-bit chip is quicker at that.
  const uint32_t half_turn = 0x40490fdbu;  // pi
  float wrapped = a;
  if (to_bits(size) > half_turn) {
    // Up to 3 pi exact, then one rounding: 2 pi = 6.28318548 - 1.74845553e-07.
    wrapped = size <= 9.424777f ? (size - 6.28318548f) + 1.74845553e-07f
                                : detail::turn_to_radian(detail::fraction_of_turn(size));
    if ((to_bits(a) & 0x80000000u) != 0) wrapped = -wrapped;
  }
  return to_bits(absolute(wrapped)) == half_turn ? pi<float>() : wrapped;
}

namespace detail {

/// wrap() for a double outside [-pi, pi], by the size of double.
template <std::size_t Bytes>
struct DoubleWrap {
  static double outside(double a) {
    const double size = absolute(a);
    if (size <= 9.424777960769379) {  // 3 pi, rounded down
      if (size == pi<double>()) return size;
      const double wrapped = (size - 6.28318530717958623) - 2.44929359829470641e-16;
      return closed_above(a < 0.0 ? -wrapped : wrapped);
    }
    return closed_above(std::atan2(std::sin(a), std::cos(a)));
  }

 private:
  static double closed_above(double wrapped) {
    return wrapped == -pi<double>() ? pi<double>() : wrapped;
  }
};

template <>
struct DoubleWrap<4> {
  static double outside(double a) { return static_cast<double>(wrap(static_cast<float>(a))); }
};

}  // namespace detail

AUVEST_INLINE double wrap(double a) {
  if (a > -pi<double>() && a <= pi<double>()) return a;
  return detail::DoubleWrap<sizeof(double)>::outside(a);
}

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
