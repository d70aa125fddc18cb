// Unscented Kalman filter in deviation form (derived in docs/algorithms/ukf.md).
//
// Sigma points are redrawn from the predicted P before an update. Two exact savings need no second
// implementation: a linear process is propagated in closed form, and a measurement of the first O
// states has zero deviations along the other n - O columns of the lower-triangular root of P, so 2
// O points are evaluated instead of 2 n (c keeps the full n). A model without structure takes the
// same code with O = n and deviations by subtraction.
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

  explicit Ukf(const Process& process, const Params& params = default_params())
      : Ukf(process, SigmaPoints<Scalar>(params, kStates)) {}

  Status predict_belief(BeliefType& belief, Scalar dt) const {
    return predict_belief(belief, dt, Linear<Process::kLinear>());
  }

  template <class Model, class Point>
  AUVEST_OUTLINE_HOT Status
  linearise(const Model& model, const Point& point,
            const Matrix<Scalar, Model::kObserved, Model::kObserved>& root,
            const typename Model::Measurement& z, typename Model::Measurement& innovation,
            Matrix<Scalar, Model::kSize, Model::kObserved>& a, typename Model::Noise& noise) const {
    if (points_.fine && !Model::kClosedForm) return Status::kAlphaTooSmall;
    typename Model::Measurement predicted;
    math::copy(model.R(), noise);
    // [UKF D3]: P_oy = L A', with the t_i in the columns of A
    points_.transform(point, root, a, predicted, noise);
    AUVEST_UNROLL
    for (int m = 0; m < Model::kSize; ++m) predicted(m) = point.value()(m) + predicted(m);
    math::copy(model.residual(z, predicted), innovation);
    return Status::kOk;
  }

  /// Params() with kappa = 3 - n, which matches the fourth moments of a Gaussian.
  static Params default_params() {
    Params params;
    params.kappa = Scalar(3 - kStates);
    return params;
  }

 private:
  Ukf(const Process& process, const SigmaPoints<Scalar>& points)
      : Base(process, points.status != Status::kOk ? points.status : process.check()),
        points_(points) {}

  template <bool>
  struct Linear {};

  Status predict_belief(BeliefType& belief, Scalar dt, Linear<true>) const {
    this->process().propagate(belief, dt);
    return Status::kOk;
  }

  Status predict_belief(BeliefType& belief, Scalar dt, Linear<false>) const {
    if (points_.fine && !Process::kClosedForm) return Status::kAlphaTooSmall;
    Covariance root;
    Matrix<Scalar, 1, kStates> no_others;
    if (!math::factor_leading(belief.P, root, no_others)) return Status::kNotPositiveDefinite;
    const auto point = this->process().about(belief.x, dt);
    Covariance t;
    State shift;
    belief.P = this->process().Q(dt);
    points_.transform(point, root, t, shift, belief.P);
    for (int i = 0; i < kStates; ++i) {
      belief.x(i) = point.value()(i) + shift(i);  // [UKF D1]
      for (int j = 0; j <= i; ++j) {
        // [UKF D2]
        belief.P(i, j) = math::plus_dot(belief.P(i, j), &t(i, 0), &t(j, 0), kStates);
      }
    }
    return Status::kOk;
  }

  SigmaPoints<Scalar> points_;
};

}  // namespace auvest
