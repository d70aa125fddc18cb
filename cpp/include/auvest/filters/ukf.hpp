// Unscented Kalman filter in deviation form (derived in docs/algorithms/ukf.md).
//
// Sigma points are redrawn from the predicted P before an update. Two exact savings need no second
// implementation: a linear process is propagated in closed form, and a measurement of the first O
// states has zero deviations along the other n - O columns of the lower-triangular L, so 2 O points
// are evaluated instead of 2 n (c keeps the full n). A model without structure takes the same code
// with O = n and deviations by subtraction.
#pragma once

#include "auvest/filters/gaussian_filter.hpp"
#include "auvest/filters/sigma_points.hpp"

namespace auvest {

template <class Process>
class Ukf : public GaussianFilter<Ukf<Process>, Process> {
 public:
  using Base = GaussianFilter<Ukf<Process>, Process>;
  using Base::kStates;
  using typename Base::BeliefType;
  using typename Base::Covariance;
  using typename Base::Scalar;
  using typename Base::State;
  using Params = typename SigmaPoints<Scalar>::Params;

  explicit Ukf(const Process& process, const Params& params = Params())
      : Base(process), points_(params, kStates) {}

  Status predict_belief(BeliefType& belief, Scalar dt) const {
    return predict_belief(belief, dt, Linear<Process::kLinear>());
  }

  template <class Model>
  Status describe(const Model& model, const State& x, const Covariance& factor,
                  const typename Model::Measurement& z, typename Model::Measurement& innovation,
                  Matrix<Scalar, Model::kObserved, Model::kSize>& a,
                  typename Model::Noise& noise) const {
    constexpr int kSize = Model::kSize;
    constexpr int kObserved = Model::kObserved;
    const Status status = allowed(Model::kClosedForm);
    if (status != Status::kOk) return status;

    const auto point = model.about(x);
    typename Model::Measurement mean;
    noise = model.R();
    AUVEST_UNROLL
    for (int k = 0; k < kObserved; ++k) {
      typename Model::ObservedState e;
      AUVEST_UNROLL
      for (int i = 0; i < kObserved; ++i) {
        e(i) = i < k ? Scalar(0) : points_.sqrt_c * factor(i, k);
      }
      typename Model::Measurement sum;
      typename Model::Measurement difference;
      point.deviations(e, sum, difference);
      AUVEST_UNROLL
      for (int m = 0; m < kSize; ++m) {
        a(k, m) = points_.half_sqrt_c * difference(m);  // t_k
        sum(m) = points_.half_sqrt_c * sum(m);          // s_k
        mean(m) = k == 0 ? sum(m) : mean(m) + sum(m);
        AUVEST_UNROLL
        for (int l = 0; l <= m; ++l) noise(m, l) = noise(m, l) + sum(m) * sum(l);
      }
    }
    typename Model::Measurement predicted;
    AUVEST_UNROLL
    for (int m = 0; m < kSize; ++m) {
      mean(m) = points_.mean_weight * mean(m);
      predicted(m) = point.value()(m) + mean(m);
      AUVEST_UNROLL
      for (int l = 0; l <= m; ++l) {
        noise(m, l) = noise(m, l) + points_.centre * mean(m) * mean(l);
      }
    }
    innovation = model.residual(z, predicted);
    return Status::kOk;
  }

  /// kBadParameter if alpha, beta or kappa is out of range.
  Status check() const { return points_.status; }

 private:
  template <bool>
  struct Linear {};

  Status predict_belief(BeliefType& belief, Scalar dt, Linear<true>) const {
    this->process().propagate(belief, dt);
    return Status::kOk;
  }

  Status predict_belief(BeliefType& belief, Scalar dt, Linear<false>) const {
    const Status status = allowed(Process::kClosedForm);
    if (status != Status::kOk) return status;
    Covariance factor = belief.P;
    if (!math::partial_cholesky<kStates>(factor)) return Status::kNotPositiveDefinite;

    const auto point = this->process().about(belief.x, dt);
    State mean;
    belief.P = this->process().Q(dt);
    for (int k = 0; k < kStates; ++k) {
      State e;
      for (int i = 0; i < kStates; ++i) {
        e(i) = i < k ? Scalar(0) : points_.sqrt_c * factor(i, k);
      }
      State sum;
      State difference;
      point.deviations(e, sum, difference);
      for (int i = 0; i < kStates; ++i) {
        sum(i) = points_.half_sqrt_c * sum(i);
        difference(i) = points_.half_sqrt_c * difference(i);
        mean(i) = k == 0 ? sum(i) : mean(i) + sum(i);
        for (int j = 0; j <= i; ++j) {
          belief.P(i, j) = belief.P(i, j) + (sum(i) * sum(j) + difference(i) * difference(j));
        }
      }
    }
    for (int i = 0; i < kStates; ++i) {
      mean(i) = points_.mean_weight * mean(i);
      belief.x(i) = point.value()(i) + mean(i);
      for (int j = 0; j <= i; ++j) {
        belief.P(i, j) = belief.P(i, j) + points_.centre * mean(i) * mean(j);
      }
    }
    return Status::kOk;
  }

  Status allowed(bool closed_form) const {
    if (points_.status != Status::kOk) return points_.status;
    return points_.fine && !closed_form ? Status::kAlphaTooSmall : Status::kOk;
  }

  SigmaPoints<Scalar> points_;
};

}  // namespace auvest
