// The thrust of a thruster from its normalised input c in [-1, 1], and back. A curve offers
//
//     Params                    with visit
//     Scalar thrust(Scalar c)   [N], for an input within the limits; beyond them, the limit's
//     Scalar input(Scalar f)    the inverse; a thrust out of reach gives the limit
//     Scalar lowest(), highest()   [N]
//     Status check()
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/select.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/lag.hpp"

namespace auvest {

/// An odd polynomial of degree 9, the same ahead and astern, monotone up to the input's limit.
template <class Scalar_>
struct OddThrust {
  using Scalar = Scalar_;

  struct Params {
    Scalar c1_n = Scalar(0);   ///< coefficient of c
    Scalar c3_n = Scalar(0);   ///< of c^3
    Scalar c5_n = Scalar(0);   ///< of c^5
    Scalar c7_n = Scalar(0);   ///< of c^7
    Scalar c9_n = Scalar(0);   ///< of c^9
    Scalar limit = Scalar(1);  ///< largest |c| used: not beyond the curve's maximum

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("c1_n", c1_n);
      v("c3_n", c3_n);
      v("c5_n", c5_n);
      v("c7_n", c7_n);
      v("c9_n", c9_n);
      v("limit", limit);
    }
  };

  Params params;

  explicit OddThrust(const Params& p) : params(p), highest_(curve(p.limit)) {}

  template <class Value>
  AUVEST_INLINE Value thrust(const Value& c) const {
    return curve(clamp_to(c, Value(-params.limit), Value(params.limit)));
  }

  Scalar highest() const { return highest_; }
  Scalar lowest() const { return -highest_; }

  /// By bisection and Newton steps within the bracket, to the last digits.
  AUVEST_OUTLINE Scalar input(Scalar f) const {
    const Scalar wanted = math::absolute(f);
    if (wanted == Scalar(0)) return Scalar(0);
    if (wanted >= highest_) return math::copy_sign(params.limit, f);
    Scalar low = Scalar(0), high = params.limit;
    Scalar c = Scalar(0.5) * high;
    for (int i = 0; i < 60; ++i) {
      const Scalar error = curve(c) - wanted;
      if (error > Scalar(0)) {
        high = c;
      } else {
        low = c;
      }
      Scalar next = c - error / slope(c);  // [HULL T3]
      if (!(next > low && next < high)) next = Scalar(0.5) * (low + high);
      if (next == c) break;
      c = next;
    }
    return math::copy_sign(c, f);
  }

  /// The curve rises from 0 to the limit: its slope, at 256 inputs, is positive below it.
  Status check() const {
    if (!math::is_positive(params.limit) || !(params.limit <= Scalar(1))) {
      return Status::kBadParameter;
    }
    for (int i = 0; i < 256; ++i) {
      const Scalar c = params.limit * Scalar(i) / Scalar(256);
      if (!math::is_positive(slope(c))) return Status::kBadParameter;
    }
    return Status::kOk;
  }

 private:
  template <class Value>
  AUVEST_INLINE Value curve(const Value& c) const {
    const Value cc = c * c;
    const Params& p = params;
    // [HULL T2]
    return c * (Value(p.c1_n) +
                cc * (Value(p.c3_n) +
                      cc * (Value(p.c5_n) + cc * (Value(p.c7_n) + cc * Value(p.c9_n)))));
  }

  Scalar slope(Scalar c) const {
    const Scalar cc = c * c;
    const Params& p = params;
    return p.c1_n +
           cc * (Scalar(3) * p.c3_n +
                 cc * (Scalar(5) * p.c5_n + cc * (Scalar(7) * p.c7_n + cc * (Scalar(9) * p.c9_n))));
  }

  Scalar highest_;
};

/// Quadratic beyond a dead band, with less thrust astern than ahead, as a ducted propeller has.
template <class Scalar_>
struct QuadraticThrust {
  using Scalar = Scalar_;

  struct Params {
    Scalar ahead_n = Scalar(0);    ///< thrust at c = 1
    Scalar astern_n = Scalar(0);   ///< its size at c = -1
    Scalar dead_band = Scalar(0);  ///< below this |c| there is none

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("ahead_n", ahead_n);
      v("astern_n", astern_n);
      v("dead_band", dead_band);
    }
  };

  Params params;

  explicit QuadraticThrust(const Params& p) : params(p), span_(Scalar(1) - p.dead_band) {}

  template <class Value>
  AUVEST_INLINE Value thrust(const Value& c) const {
    const Value size = clamp_to(Value(math::absolute(c)), Value(params.dead_band), Value(1));
    const Value x = (size - Value(params.dead_band)) / Value(span_);
    const Value full = math::select(c < Value(0), Value(params.astern_n), Value(params.ahead_n));
    return math::copy_sign(Value(full * x * x), c);  // [HULL T4]
  }

  Scalar highest() const { return params.ahead_n; }
  Scalar lowest() const { return -params.astern_n; }

  /// Of no thrust: 0, in the middle of the dead band.
  Scalar input(Scalar f) const {
    const Scalar full = f < Scalar(0) ? params.astern_n : params.ahead_n;
    const Scalar size = math::absolute(f);
    if (size == Scalar(0)) return Scalar(0);
    if (size >= full) return math::copy_sign(Scalar(1), f);
    return math::copy_sign(params.dead_band + span_ * math::sqrt(size / full), f);
  }

  Status check() const {
    const bool valid = math::is_positive(params.ahead_n) && math::is_positive(params.astern_n) &&
                       math::is_nonnegative(params.dead_band) && params.dead_band < Scalar(1);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  Scalar span_;  // 1 - dead band
};

}  // namespace auvest
