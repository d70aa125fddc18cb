// The bit pattern of a float, as an integer, and back.
#pragma once

#include <cstdint>
#include <cstring>

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

/// The IEEE 754 binary32 pattern of `x`.
AUVEST_INLINE uint32_t to_bits(float x) {
  uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}

/// The float with the IEEE 754 binary32 pattern `bits`.
AUVEST_INLINE float from_bits(uint32_t bits) {
  float x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// A bit pattern from its sign on as far as an unsigned int goes: all of it, or, in half of the
/// work, the half that tells an 8-bit chip the exponent.
constexpr unsigned leading(uint32_t bits) {
  return static_cast<unsigned>(bits >> (32 - 8 * (sizeof(unsigned) < 4 ? sizeof(unsigned) : 4)));
}

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
