// The smallest and the largest range that a sensor can measure: a part of the Params of every model
// that measures one.
//
// No range is negative, and what lies outside of what the instrument can do is no measurement but a
// code for "no echo" (-1, 0, 9999), a multiple of its gate or a wrong unit. A filter that took one
// would move to where no vehicle is.
#pragma once

#include <limits>

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct RangeLimits {
  /// Finite. Below 0 for readings whose noise is not cut off at 0, as simulated ones are.
  Scalar smallest_range_m = Scalar(0);
  Scalar largest_range_m = Scalar(std::numeric_limits<Scalar>::infinity());  ///< above it

  /// Names both members, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("smallest_range_m", smallest_range_m);
    v("largest_range_m", largest_range_m);
  }

  /// kImpossibleRange for a range that the sensor cannot have measured.
  Status admits(Scalar range_m) const {
    return math::within(range_m, smallest_range_m, largest_range_m) ? Status::kOk
                                                                    : Status::kImpossibleRange;
  }

  /// Takes every range, however far below 0.
  void lift_smallest() { smallest_range_m = -(std::numeric_limits<Scalar>::max)(); }

  bool valid() const {
    return math::is_finite(smallest_range_m) && largest_range_m > smallest_range_m;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
