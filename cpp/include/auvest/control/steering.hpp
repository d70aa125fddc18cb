// How a rudder turns the vehicle: Nomoto's model T dr/dt + r = K delta, which both heading
// controllers steer by, with K that grows as the square of the speed, [CONTROL 4].
#pragma once

#include "auvest/math/basic.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct Steering {
  Scalar time_constant_s = Scalar(1);  ///< T, > 0
  Scalar gain = Scalar(0.6);           ///< K [1/s], > 0, at `speed_m_s`
  Scalar speed_m_s = Scalar(1.5);      ///< the speed for which K is given, > 0
  Scalar slowest_m_s = Scalar(0);      ///< K stays below this speed; 0: K is a constant
  Scalar max_rudder_rad = Scalar(0.2617993877991494);  ///< limit of |delta|, > 0; 15 deg

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("time_constant_s", time_constant_s);
    v("gain", gain);
    v("speed_m_s", speed_m_s);
    v("slowest_m_s", slowest_m_s);
    v("max_rudder_rad", max_rudder_rad);
  }

  bool valid() const {
    return math::is_positive(time_constant_s) && math::is_positive(gain) &&
           math::is_positive(speed_m_s) && math::is_nonnegative(slowest_m_s) &&
           math::is_positive(max_rudder_rad);
  }

  /// K at this speed through the water.
  Scalar gain_at(Scalar speed) const {
    if (!(slowest_m_s > Scalar(0))) return gain;
    const Scalar ratio = (speed < slowest_m_s ? slowest_m_s : speed) / speed_m_s;
    return gain * (ratio * ratio);  // [CONTROL 4]
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
