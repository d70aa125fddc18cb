// The master of SLATF, [SLATF 4]: state [x, y, vx, vy, ax, ay] with exact transition Phi (the
// dt^2/2 terms included), a known velocity change u and G = [dt^2/2, dt, 1]' per axis:
//
//     X(k+1) = Phi X(k) + E u(k) + G w(k),   w ~ N(0, q^2) per axis
//
// The paper leaves Phi, E, G and q open. G is that of an acceleration that is constant within a
// step and jumps by w from step to step (Bar-Shalom, Li and Kirubarajan, "Estimation with
// applications to tracking and navigation", 6.3.3). u is the velocity change that the master
// planned for the step, spread evenly over it: E u = [dt/2 u, u, 0].
#pragma once

#include "auvest/models/constant_acceleration.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct PiecewiseAcceleration : ProcessModel<PiecewiseAcceleration<Scalar_>, Scalar_, 6> {
  using Base = ProcessModel<PiecewiseAcceleration<Scalar_>, Scalar_, 6>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;
  static constexpr bool kLinear = true;

  struct Params {
    Scalar acceleration_m_s2 = Scalar(1e-4);  ///< q, standard deviation of w per step
    /// Power spectral density of a random walk of the position [m^2/s], which the paper has not:
    /// with q = 0 and no velocity the master of which nothing is known but that it moves slowly.
    Scalar position_psd = Scalar(0);
  };

  Params params;

  explicit PiecewiseAcceleration(const Params& p = Params()) : params(p) {}

  State f(const State& x, Scalar dt) const { return noiseless().f(x, dt); }  // [SLATF 4]
  Covariance Phi(const State& x, Scalar dt) const { return noiseless().Phi(x, dt); }

  /// Without u: x <- Phi x, P <- Phi P Phi' + G q^2 G' in place.
  template <class Value>
  AUVEST_INLINE void propagate(Belief<Value, 6>& belief, Scalar dt) const {
    // [SLATF 15] [SLATF 16]
    noiseless().propagate(belief, dt);
    add_noise(belief.P, dt);
  }

  Status check() const {
    const bool valid =
        math::is_nonnegative(params.acceleration_m_s2) && math::is_nonnegative(params.position_psd);
    return valid ? Status::kOk : Status::kBadParameter;
  }

  /// Adds Q(dt) to a lower triangle.
  template <class Value>
  AUVEST_INLINE void add_noise(Matrix<Value, 6, 6>& p, Scalar dt) const {
    const Scalar g[3] = {Scalar(0.5) * dt * dt * params.acceleration_m_s2,
                         dt * params.acceleration_m_s2, params.acceleration_m_s2};
    AUVEST_UNROLL
    for (int axis = 0; axis < 2; ++axis) {
      p(axis, axis) = p(axis, axis) + params.position_psd * dt;
      AUVEST_UNROLL
      for (int i = 0; i < 3; ++i) {
        AUVEST_UNROLL
        for (int j = 0; j <= i; ++j) {
          Value& element = p(2 * i + axis, 2 * j + axis);
          element = element + g[i] * g[j];
        }
      }
    }
  }

 private:
  static AUVEST_INLINE ExactAcceleration<Scalar> noiseless() {
    AccelerationNoise<Scalar> none;
    none.position = none.velocity = none.acceleration = Scalar(0);
    return ExactAcceleration<Scalar>(none);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
