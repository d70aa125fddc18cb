// A prediction over a time of which only bounds are known: how long the power was off, or how late
// a clock is.
//
// The time that passed is t in [least, most], with any distribution. With x(t) and P(t) the
// predicted belief, the one given here has the mean between the two ends and, at least,
//
//     P = P(most) + d d' / 4,   d = x(most) - x(least):
//
// of all distributions on an interval the one with half of it at each end has the largest variance
// (Popoviciu), a quarter of the square of its length. That holds where x(t) is a line from end to
// end, as it is without acceleration, and where P grows with t. A vehicle that may have turned
// meanwhile is the process noise's business.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

namespace detail {

/// In steps that the filter allows.
template <class Filter>
Status predict_long(Filter& filter, typename Filter::Scalar dt) {
  using Scalar = typename Filter::Scalar;
  const Scalar longest = filter.longest_step_s();
  Status status = Status::kOk;
  while (status == Status::kOk && dt > longest) {
    status = filter.predict(longest);
    const Scalar left = dt - longest;
    if (!(left < dt)) return Status::kStepTooLong;  // it would never end
    dt = left;
  }
  return status == Status::kOk ? filter.predict(dt) : status;
}

}  // namespace detail

/// Carries the belief 0 <= least_s <= t <= most_s seconds forward, whatever t is. Refused, it is as
/// it was.
template <class Filter>
Status predict_within(Filter& filter, typename Filter::Scalar least_s,
                      typename Filter::Scalar most_s) {
  using Scalar = typename Filter::Scalar;
  if (!filter.initialised()) return Status::kNotInitialised;
  if (!math::is_finite(least_s) || !math::is_finite(most_s)) return Status::kNotFinite;
  if (least_s < Scalar(0) || most_s < least_s) return Status::kBadParameter;
  const typename Filter::BeliefType before = filter.belief();
  Status status = detail::predict_long(filter, least_s);
  if (status == Status::kOk) {
    const typename Filter::State early = filter.x();
    status = detail::predict_long(filter, most_s - least_s);
    if (status == Status::kOk) {
      typename Filter::BeliefType belief = filter.belief();
      const typename Filter::State d = filter.process().residual(belief.x, early);
      for (int i = 0; i < Filter::kStates; ++i) {
        belief.x(i) = early(i) + Scalar(0.5) * d(i);
        for (int j = 0; j <= i; ++j) belief.P(i, j) = belief.P(i, j) + Scalar(0.25) * (d(i) * d(j));
      }
      status = filter.restore(belief);
    }
  }
  if (status != Status::kOk) filter.restore(before);
  return status;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
