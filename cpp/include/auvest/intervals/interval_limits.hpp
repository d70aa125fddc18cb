// First, shortest and longest interval: what the adaptive interval policies share.
#pragma once

#include "auvest/math/basic.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct IntervalLimits {
  Scalar initial_s = Scalar(0.5);  ///< T(0), Table 1
  Scalar min_s = Scalar(0.02);     ///< T_min, not stated in the paper
  Scalar max_s = Scalar(1);        ///< T_max, Table 1

  /// 0 < T_min <= T(0) <= T_max, all finite.
  bool valid() const {
    return math::is_positive(min_s) && math::within(initial_s, min_s, max_s) &&
           math::is_finite(max_s);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
