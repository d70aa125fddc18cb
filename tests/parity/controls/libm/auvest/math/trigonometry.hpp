// Stands in front of the library's own header, as someone would do who trusts the toolchain's libm.
#pragma once

#include <cmath>
#include <cstdint>

#include "auvest/math/basic.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {
namespace detail {

inline uint64_t fraction_of_turn(float) { return 0; }
inline float turn_to_radian(uint64_t) { return 0.0f; }

}  // namespace detail

inline float sin(float x) { return ::sinf(x); }
inline float cos(float x) { return ::cosf(x); }
inline float atan2(float y, float x) { return ::atan2f(y, x); }
inline void sincos(float x, float& s, float& c) {
  s = sin(x);
  c = cos(x);
}
inline void sincos_near(float x, float& s, float& c) { sincos(x, s, c); }

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
