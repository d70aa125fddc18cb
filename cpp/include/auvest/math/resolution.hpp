// Whether a format is fine enough for a number whose uncertainty is known.
//
// Far from the origin numbers lie far apart: a float near 4e6 (a northing of UTM, in metres) is a
// multiple of 0.25, and what a craft moves in a tenth of a second is rounded away. One rule serves
// starts, beliefs, stations and leaders:
//
//     coarse: half a unit in the last place of x is more than about a tenth of sigma,
//             where no sigma counts as less than a millimetre
//
// Rounding then adds at most a hundredth of the variance, less than any model is right by; beyond,
// it is a noise that no filter knows of. What is known to a millimetre is known, for a vehicle:
// within 4 km of the origin no float is coarse, however sure a filter is. Read from the exponents,
// in a few instructions: with |x| in [2^a, 2^(a+1)) and sigma^2 in [2^b, 2^(b+1)) the half unit is
// 2^(a - digits), and it is compared with 2^(b/2) / 8, which is sigma / 8 to sigma / 11.3.
#pragma once

#include <cfloat>
#include <cstdint>
#include <cstring>

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

namespace detail {

/// The exponent as it is stored: that of 1 is 127, or 1023. Of a float, an 8-bit chip reads the
/// half that has it.
AUVEST_INLINE int stored_exponent(const float& x) {
  unsigned upper;
  const int skipped = static_cast<int>(sizeof x) - static_cast<int>(sizeof upper);
  std::memcpy(&upper, reinterpret_cast<const unsigned char*>(&x) + skipped, sizeof upper);
  return static_cast<int>(static_cast<unsigned>(upper << 1) >> (8 * sizeof upper - 8));
}
AUVEST_INLINE int stored_exponent(double x) {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return static_cast<int>(bits >> 52 & 0x7ff);
}

}  // namespace detail

/// The exponent of the square of a millimetre, about, beside that of 1.
constexpr int kFinestExponent = -20;

/// True where the format cannot tell numbers apart at `x`, in metres, as a variance asks for it.
AUVEST_OUTLINE AUVEST_INLINE bool is_coarse(const float& x, const float& variance) {
  int known = detail::stored_exponent(variance);
  if (known < 127 + kFinestExponent) known = 127 + kFinestExponent;
  return 2 * detail::stored_exponent(x) - known > 127 + 2 * FLT_MANT_DIG - 6;
}
AUVEST_INLINE bool is_coarse(double x, double variance) {
  int known = detail::stored_exponent(variance);
  if (known < 1023 + kFinestExponent) known = 1023 + kFinestExponent;
  return 2 * detail::stored_exponent(x) - known > 1023 + 2 * DBL_MANT_DIG - 6;
}

/// False where no number with this square, or a smaller one, is coarse, whatever its variance.
AUVEST_INLINE bool may_be_coarse(const float& square) {
  return detail::stored_exponent(square) > 127 + kFinestExponent + 2 * FLT_MANT_DIG - 6;
}
AUVEST_INLINE bool may_be_coarse(double square) {
  return detail::stored_exponent(square) > 1023 + kFinestExponent + 2 * DBL_MANT_DIG - 6;
}

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
