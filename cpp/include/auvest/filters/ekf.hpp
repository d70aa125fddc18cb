// Extended Kalman filter: the baseline. Models are linearised at the mean, P <- Phi P Phi' + Q and
// S = H P H' + R; the update is the shared square-root form, equal to the Joseph form.
#pragma once

#include "auvest/filters/gaussian_filter.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The first-order expansion of h at the mean, with the second-order term of a model that has one,
/// as GaussianFilter asks for it.
template <class Model, class Point, class Scalar>
AUVEST_INLINE void linearise_by_jacobian(
    const Model& model, const Point& point,
    const Matrix<Scalar, Model::kObserved, Model::kObserved>& root,
    const typename Model::Measurement& z, typename Model::Measurement& innovation,
    Matrix<Scalar, Model::kSize, Model::kObserved>& a, typename Model::Noise& noise) {
  innovation = model.residual(z, point.value());
  project(point.H(), root, a);  // [MEKF 6]
  noise = model.R();
  model.second_order(point, root, innovation, noise);
}

template <class Process>
class Ekf : public GaussianFilter<Ekf<Process>, Process> {
 public:
  using Base = GaussianFilter<Ekf<Process>, Process>;
  using typename Base::BeliefType;
  using typename Base::Covariance;
  using typename Base::Scalar;
  using typename Base::State;

  explicit Ekf(const Process& process = Process()) : Base(process, process.check()) {}

  Status predict_belief(BeliefType& belief, Scalar dt) const {
    this->process().propagate(belief, dt);  // [MEKF 7]
    return Status::kOk;
  }

  template <class Model, class Point>
  Status linearise(const Model& model, const Point& point,
                   const Matrix<Scalar, Model::kObserved, Model::kObserved>& root,
                   const typename Model::Measurement& z, typename Model::Measurement& innovation,
                   Matrix<Scalar, Model::kSize, Model::kObserved>& a,
                   typename Model::Noise& noise) const {
    linearise_by_jacobian(model, point, root, z, innovation, a, noise);
    return Status::kOk;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
