// A Kalman filter that linearises by a few points around the mean: the frame that the unscented and
// the cubature filter share (derived in docs/algorithms/ukf.md).
//
// Points are drawn anew from the predicted P before an update. Two exact savings need no second
// implementation: a linear process is propagated in closed form, and a measurement of the first O
// states has zero deviations along the other n - O columns of the lower-triangular root of P, so 2
// O points are evaluated instead of 2 n. A model without structure takes the same code with O = n
// and deviations by subtraction.
//
// `Points` offers what SigmaPoints does: transform(), `fine` and `status`.
#pragma once

#include "auvest/filters/gaussian_filter.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The mean and the covariance of h over a belief whose P_oo is root root', as GaussianFilter asks
/// for them.
template <class Points, class Model, class Point, class Scalar>
AUVEST_OUTLINE_HOT Status linearise_by_points(
    const Points& points, const Model& model, const Point& point,
    const Matrix<Scalar, Model::kObserved, Model::kObserved>& root,
    const typename Model::Measurement& z, typename Model::Measurement& innovation,
    Matrix<Scalar, Model::kSize, Model::kObserved>& a, typename Model::Noise& noise) {
  if (points.fine && !Model::kClosedForm) return Status::kAlphaTooSmall;
  typename Model::Measurement predicted;
  math::copy(model.R(), noise);
  // [UKF D3]: P_oy = L A', with the t_i in the columns of A
  points.transform(point, root, a, predicted, noise);
  AUVEST_UNROLL
  for (int m = 0; m < Model::kSize; ++m) predicted(m) = point.value()(m) + predicted(m);
  math::copy(model.residual(z, predicted), innovation);
  return Status::kOk;
}

/// Chooses between the two forms of predict_by_points (avr-gcc has no std::enable_if).
template <bool>
struct IsLinear {};

/// The belief after dt seconds of a process that is linear: there is nothing to sample.
template <class Points, class Process, class Scalar, int N>
Status predict_by_points(const Points&, const Process& process, Belief<Scalar, N>& belief,
                         Scalar dt, IsLinear<true>) {
  process.propagate(belief, dt);
  return Status::kOk;
}

/// The belief after dt seconds of any other process.
template <class Points, class Process, class Scalar, int N>
Status predict_by_points(const Points& points, const Process& process, Belief<Scalar, N>& belief,
                         Scalar dt, IsLinear<false>) {
  if (points.fine && !Process::kClosedForm) return Status::kAlphaTooSmall;
  Matrix<Scalar, N, N> root;
  Matrix<Scalar, 1, N> no_others;
  if (!math::factor_leading(belief.P, root, no_others)) return Status::kNotPositiveDefinite;
  const auto point = process.about(belief.x, dt);
  Matrix<Scalar, N, N> t;
  Vector<Scalar, N> shift;
  belief.P = process.Q(dt);
  points.transform(point, root, t, shift, belief.P);
  for (int i = 0; i < N; ++i) {
    belief.x(i) = point.value()(i) + shift(i);  // [UKF D1]
    for (int j = 0; j <= i; ++j) {
      // [UKF D2]
      belief.P(i, j) = math::plus_dot(belief.P(i, j), &t(i, 0), &t(j, 0), N);
    }
  }
  return Status::kOk;
}

template <class Process, class Points_>
class SigmaPointFilter : public GaussianFilter<SigmaPointFilter<Process, Points_>, Process> {
 public:
  using Base = GaussianFilter<SigmaPointFilter<Process, Points_>, Process>;
  using Points = Points_;
  using typename Base::BeliefType;
  using typename Base::Scalar;

  SigmaPointFilter(const Process& process, const Points& points)
      : Base(process, points.status != Status::kOk ? points.status : process.check()),
        points_(points) {}

  Status predict_belief(BeliefType& belief, Scalar dt) const {
    return predict_by_points(points_, this->process(), belief, dt, IsLinear<Process::kLinear>());
  }

  template <class Model, class Point>
  Status linearise(const Model& model, const Point& point,
                   const Matrix<Scalar, Model::kObserved, Model::kObserved>& root,
                   const typename Model::Measurement& z, typename Model::Measurement& innovation,
                   Matrix<Scalar, Model::kSize, Model::kObserved>& a,
                   typename Model::Noise& noise) const {
    return linearise_by_points(points_, model, point, root, z, innovation, a, noise);
  }

  const Points& points() const { return points_; }

 private:
  Points points_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
