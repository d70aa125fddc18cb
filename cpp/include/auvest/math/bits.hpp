// The bit pattern of a float, as an integer, and back.
#pragma once

#include <cstdint>
#include <cstring>

#include "auvest/config.hpp"

namespace auvest {
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

}  // namespace math
}  // namespace auvest
