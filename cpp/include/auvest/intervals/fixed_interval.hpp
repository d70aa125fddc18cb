// The constant sampling interval: a UKF is an AUKF with this policy.
//
// An interval policy is a plain struct that offers
//
//     Scalar initial() const              T(0) [s]
//     void   restart(estimate, reference) forget the past; both positions are those of step 0
//     Scalar next(filter, reference)      T(k) [s], after the update of step k
//     Status check() const                kOk, or kBadParameter if a parameter is out of range;
//                                         its defaults are in range
//
// where `reference` is the position (m) of the desired track at step k.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct FixedInterval {
  using Scalar = Scalar_;
  using Position = Vector<Scalar, 2>;

  struct Params {
    Scalar interval_s = Scalar(0.5);  ///< T > 0, Table 1

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("interval_s", interval_s);
    }
  };

  Params params;

  explicit FixedInterval(const Params& p = Params()) : params(p) {}

  Scalar initial() const { return params.interval_s; }
  void restart(const Position&, const Position&) {}

  template <class Filter>
  Scalar next(const Filter&, const Position&) {
    return params.interval_s;
  }

  Status check() const {
    return math::is_finite(params.interval_s) && params.interval_s > Scalar(0)
               ? Status::kOk
               : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
