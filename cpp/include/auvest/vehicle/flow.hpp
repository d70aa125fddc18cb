// The water as the hull meets it, once per evaluation of the forces.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/vehicle/freedom.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Value>
struct Flow {
  Value nu[6];         ///< velocities through the water [m/s, rad/s]; 0 on dropped axes
  Value cross_square;  ///< v^2 + w^2 [m^2/s^2]
  Value speed;         ///< U_r [m/s]

  /// Only `nu` is filled in; the two others where a load needs them.
  template <class Freedom>
  AUVEST_INLINE void set(const Value* velocities, bool with_speed, Freedom) {
    AUVEST_UNROLL
    for (int i = 0; i < 6; ++i) nu[i] = Value(0);
    AUVEST_UNROLL
    for (int i = 0; i < Freedom::kSize; ++i) nu[Freedom::axis(i)] = velocities[i];
    if (!with_speed) return;
    cross_square = nu[kSway] * nu[kSway];
    if (Freedom::keeps(kHeave)) cross_square = cross_square + nu[kHeave] * nu[kHeave];
    speed = math::sqrt(nu[kSurge] * nu[kSurge] + cross_square);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
