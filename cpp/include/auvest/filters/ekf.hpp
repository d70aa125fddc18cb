// Extended Kalman filter: the baseline. Models are linearised at the mean, P <- Phi P Phi' + Q and
// S = H P H' + R; the update is the shared square-root form, equal to the Joseph form.
#pragma once

#include "auvest/filters/gaussian_filter.hpp"

namespace auvest {

template <class Process>
class Ekf : public GaussianFilter<Ekf<Process>, Process> {
 public:
  using Base = GaussianFilter<Ekf<Process>, Process>;
  using typename Base::BeliefType;
  using typename Base::Covariance;
  using typename Base::Scalar;
  using typename Base::State;

  explicit Ekf(const Process& process) : Base(process) {}

  /// kBadParameter if a parameter of the process is out of range.
  Status check() const { return this->process().check(); }

  Status predict_belief(BeliefType& belief, Scalar dt) const {
    this->process().propagate(belief, dt);
    return Status::kOk;
  }

  template <class Model>
  Status linearise(const Model& model, const State& x, const Covariance& factor,
                   const typename Model::Measurement& z, typename Model::Measurement& innovation,
                   Matrix<Scalar, Model::kObserved, Model::kSize>& a,
                   typename Model::Noise& noise) const {
    const auto point = model.about(x);
    innovation = model.residual(z, point.value());
    Base::project(point.H(), factor, a);
    noise = model.R();
    return Status::kOk;
  }
};

}  // namespace auvest
