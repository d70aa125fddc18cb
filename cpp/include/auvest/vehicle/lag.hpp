// How an actuator follows its command: dead band and saturation of the command, then a first-order
// lag with a rate limit, and saturation of the state.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/select.hpp"
#include "auvest/status.hpp"

namespace auvest {

/// `value` moved into [low, high]; a NaN stays one.
template <class Value>
AUVEST_INLINE Value clamp_to(const Value& value, const Value& low, const Value& high) {
  return math::select(value < low, low, math::select(value > high, high, value));
}

template <class Scalar_>
struct Lag {
  using Scalar = Scalar_;

  struct Params {
    Scalar low = Scalar(0);              ///< lower limit, in the actuator's unit
    Scalar high = Scalar(0);             ///< upper limit
    Scalar dead_band = Scalar(0);        ///< a command smaller than this is none
    Scalar time_constant_s = Scalar(0);  ///< T > 0
    Scalar rate_limit = Scalar(0);       ///< largest rate, unit per second; 0: none

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("low", low);
      v("high", high);
      v("dead_band", dead_band);
      v("time_constant_s", time_constant_s);
      v("rate_limit", rate_limit);
    }

    /// Limits of -limit and limit.
    static Params symmetric(Scalar limit, Scalar time_constant_s) {
      Params p;
      p.low = -limit;
      p.high = limit;
      p.time_constant_s = time_constant_s;
      return p;
    }
  };

  Params params;

  explicit Lag(const Params& p) : params(p) {}

  /// What the actuator makes of a command: where it differs, the command saturates (or is lost in
  /// the dead band), and whoever integrates an error must know.
  template <class Value>
  AUVEST_INLINE Value demand(const Value& command) const {
    const Value reached = limited(command);
    if (params.dead_band == Scalar(0)) return reached;
    const Value size = math::absolute(command);
    return math::select(size < Value(params.dead_band), Value(0), reached);
  }

  /// A state within the limits.
  template <class Value>
  AUVEST_INLINE Value limited(const Value& state) const {
    return clamp_to(state, Value(params.low), Value(params.high));
  }

  template <class Value>
  AUVEST_INLINE Value rate(const Value& state, const Value& wanted) const {
    const Value free = (wanted - state) / Value(params.time_constant_s);  // [HULL A1]
    if (params.rate_limit == Scalar(0)) return free;
    return clamp_to(free, Value(-params.rate_limit), Value(params.rate_limit));
  }

  Status check() const {
    const bool valid =
        math::is_finite(params.low) && math::is_finite(params.high) && params.low <= Scalar(0) &&
        params.high >= Scalar(0) && math::is_nonnegative(params.dead_band) &&
        math::is_positive(params.time_constant_s) && math::is_nonnegative(params.rate_limit);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace auvest
