// A filter that chooses its own sampling interval: any Gaussian filter plus an interval policy.
//
//     filter.predict(filter.interval());    // the sensor is read interval() seconds later
//     filter.update(z, sonar);              // left out when the measurement is missing
//     filter.feedback(reference);           // T(k): when to read the sensor next
#pragma once

#include "auvest/filters/gaussian_filter.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Filter, class Policy_>
class AdaptiveInterval : public Filter {
 public:
  using Policy = Policy_;
  using typename Filter::BeliefType;
  using typename Filter::Covariance;
  using typename Filter::Scalar;
  using typename Filter::State;
  using Position = Vector<Scalar, 2>;

  explicit AdaptiveInterval(const Filter& filter, const Policy& policy = Policy())
      : Filter(filter),
        policy_(policy),
        interval_(policy.initial()),
        policy_check_(policy.check()) {}

  /// The filter made from its own arguments, with the default policy: in place, because on a chip
  /// copies take flash and stack.
  template <class F = Filter>
  AdaptiveInterval(const typename F::Process& process, const typename F::Params& params)
      : Filter(process, params),
        policy_(),
        interval_(policy_.initial()),
        policy_check_(Status::kOk) {}

  /// The same of a filter that needs no more than a process.
  explicit AdaptiveInterval(const typename Filter::Process& process = typename Filter::Process())
      : Filter(process), policy_(), interval_(policy_.initial()), policy_check_(Status::kOk) {}

  /// Sets the belief and starts the policy; `reference` is the desired position (m) at step 0.
  Status reset(const State& x0, const Covariance& P0, const Position& reference) {
    if (!math::all_finite(reference)) return Status::kNotFinite;
    if (policy_check_ != Status::kOk) return policy_check_;
    const Status status = Filter::reset(x0, P0);
    if (status != Status::kOk) return status;
    policy_.restart(position(x0), reference);
    interval_ = policy_.initial();
    return Status::kOk;
  }

  /// As above, with the desired track starting where the filter does: X(0) = R(0).
  Status reset(const State& x0, const Covariance& P0) { return reset(x0, P0, position(x0)); }

  /// Takes back what belief(), policy() and interval() gave: the same bits go on.
  Status restore(const BeliefType& belief, const Policy& policy, Scalar interval) {
    if (!math::is_finite(interval)) return Status::kNotFinite;
    if (!(interval > Scalar(0)) || policy.check() != Status::kOk) return Status::kBadParameter;
    const Status status = Filter::restore(belief);
    if (status != Status::kOk) return status;
    policy_ = policy;
    policy_check_ = Status::kOk;
    interval_ = interval;
    return Status::kOk;
  }

  /// As above with policy and interval as they stand.
  Status restore(const BeliefType& belief) { return restore(belief, Policy(policy_), interval_); }

  /// Chooses the interval to the next sample; `reference` is the desired position (m) now.
  Status feedback(const Position& reference) {
    if (!this->initialised()) return Status::kNotInitialised;
    if (!math::all_finite(reference)) return Status::kNotFinite;
    interval_ = policy_.next(*this, reference);
    return Status::kOk;
  }

  /// As that of the filter; first, whether a parameter of the policy is out of range.
  Status check() const { return policy_check_ != Status::kOk ? policy_check_ : Filter::check(); }

  Scalar interval() const { return interval_; }  ///< T(k) [s]
  const Policy& policy() const { return policy_; }

 private:
  static Position position(const State& x) {
    Position p;
    p(0) = x(0);
    p(1) = x(Filter::kStates > 1 ? 1 : 0);  // one state: there is no plane to have a law for
    return p;
  }

  Policy policy_;
  Scalar interval_;
  Status policy_check_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
