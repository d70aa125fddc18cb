// Linear models of any size: x' = Phi x + w and z = H x + v with constant matrices.
//
// With them every filter of auvest is the Kalman filter, which is how the tests check them.
#pragma once

#include "auvest/models/measurement_model.hpp"
#include "auvest/models/process_model.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// x(k+1) = Phi x(k) + w, w ~ N(0, Q), for one fixed step: dt only says that a step was taken.
template <class Scalar_, int N>
struct LinearProcess : ProcessModel<LinearProcess<Scalar_, N>, Scalar_, N> {
  using Scalar = Scalar_;
  using State = Vector<Scalar, N>;
  using Covariance = Matrix<Scalar, N, N>;
  static constexpr bool kLinear = true;

  Covariance transition;
  Covariance noise;

  LinearProcess(const Covariance& phi, const Covariance& q) : transition(phi), noise(q) {}

  State f(const State& x, Scalar) const {
    State next;
    for (int i = 0; i < N; ++i) {
      next(i) = Scalar(0);
      for (int j = 0; j < N; ++j) next(i) = next(i) + transition(i, j) * x(j);
    }
    return next;
  }
  const Covariance& Phi(const State&, Scalar) const { return transition; }
  const Covariance& Q(Scalar) const { return noise; }
};

/// z = H x[0:Observed] + v, v ~ N(0, R).
template <class Scalar_, int N, int M, int Observed = N>
struct LinearMeasurement
    : MeasurementModel<LinearMeasurement<Scalar_, N, M, Observed>, Scalar_, N, M, Observed> {
  using Base =
      MeasurementModel<LinearMeasurement<Scalar_, N, M, Observed>, Scalar_, N, M, Observed>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;
  static constexpr bool kClosedForm = true;

  Jacobian matrix;
  Noise noise;

  LinearMeasurement(const Jacobian& h, const Noise& r) : matrix(h), noise(r) {}

  struct Expansion {
    const Jacobian& matrix;
    Measurement centre;

    const Measurement& value() const { return centre; }
    const Jacobian& H() const { return matrix; }
    void deviations(const ObservedState& e, Measurement& sum, Measurement& difference) const {
      for (int i = 0; i < M; ++i) {
        sum(i) = Scalar(0);
        difference(i) = Scalar(0);
        for (int j = 0; j < Observed; ++j) {
          difference(i) = difference(i) + Scalar(2) * matrix(i, j) * e(j);
        }
      }
    }
  };

  Expansion about(const State& x) const { return Expansion{matrix, h(x)}; }

  Measurement h(const State& x) const {
    Measurement z;
    for (int i = 0; i < M; ++i) {
      z(i) = Scalar(0);
      for (int j = 0; j < Observed; ++j) z(i) = z(i) + matrix(i, j) * x(j);
    }
    return z;
  }
  const Jacobian& H(const State&) const { return matrix; }
  const Noise& R() const { return noise; }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
