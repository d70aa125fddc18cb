// The interval policy that keeps accuracy instead of a ratio: the largest T in [T_min, T_max] after
// which the predicted position standard deviation, sqrt(P_xx + P_yy), is still within a budget.
//
// Not in the paper. It needs no reference track, and it spends samples where uncertainty grows.
#pragma once

#include "auvest/intervals/interval_limits.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct CovarianceBudget {
  using Scalar = Scalar_;
  using Position = Vector<Scalar, 2>;

  struct Params : IntervalLimits<Scalar> {
    Scalar position_sigma_m = Scalar(0.1);  ///< budget for sqrt(P_xx + P_yy) before an update

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("initial_s", this->initial_s);
      v("min_s", this->min_s);
      v("max_s", this->max_s);
      v("position_sigma_m", position_sigma_m);
    }
  };

  Params params;

  explicit CovarianceBudget(const Params& p = Params()) : params(p) {}

  Scalar initial() const { return params.initial_s; }
  void restart(const Position&, const Position&) {}

  /// Bisection on the predicted variance, ten halvings: T is right to 0.1 % of T_max - T_min and
  /// never above the budget, unless T_min itself is. The variance is taken to grow with T, as it
  /// does but for a belief whose velocity is correlated with minus its position.
  template <class Filter>
  Scalar next(const Filter& filter, const Position&) {
    const Scalar budget = params.position_sigma_m * params.position_sigma_m;
    if (variance(filter, params.max_s) <= budget) return params.max_s;
    Scalar low = params.min_s;
    Scalar high = params.max_s;
    for (int i = 0; i < 10; ++i) {
      const Scalar middle = Scalar(0.5) * (low + high);
      if (variance(filter, middle) <= budget) {
        low = middle;
      } else {
        high = middle;
      }
    }
    return low;
  }

  Status check() const {
    return params.valid() && math::is_positive(params.position_sigma_m) ? Status::kOk
                                                                        : Status::kBadParameter;
  }

 private:
  template <class Filter>
  static Scalar variance(const Filter& filter, Scalar dt) {
    return filter.process().position_variance(filter.belief(), dt);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
