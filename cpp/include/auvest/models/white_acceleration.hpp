// Nearly constant velocity in the plane or in space: state [x, y, vx, vy] or [x, y, z, vx, vy, vz]
// (m, m/s), driven by white accelerations, independent between the axes: Bar-Shalom, Li and
// Kirubarajan, "Estimation with applications to tracking and navigation", 6.2.2. Per axis, and
// exact for any dt,
//
//     Phi = [1, dt; 0, 1],   Q = q [dt^3/3, dt^2/2; dt^2/2, dt].
//
// z may point up or down, as long as all sensors of the state count it alike. A vehicle's vertical
// manoeuvres are not its horizontal ones: z has a density of its own.
//
// The position comes first, in all models of motion: what sees x and y fits all of them, what sees
// z fits those in space. ConstantVelocity is this model in the plane, with an acceleration to it.
#pragma once

#include "auvest/models/process_model.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Of the model in both sizes: power spectral densities of the accelerations.
template <class Scalar>
struct WhiteAccelerationParams {
  Scalar velocity = Scalar(1e-4);           ///< q of x and y [m^2/s^3]
  Scalar vertical_velocity = Scalar(1e-4);  ///< q of z [m^2/s^3]

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("velocity_psd", velocity);
    v("vertical_velocity_psd", vertical_velocity);
  }
};

template <class Scalar_, int Axes>
struct WhiteAcceleration : ProcessModel<WhiteAcceleration<Scalar_, Axes>, Scalar_, 2 * Axes> {
  static_assert(Axes == 2 || Axes == 3, "in the plane or in space");
  using Base = ProcessModel<WhiteAcceleration<Scalar_, Axes>, Scalar_, 2 * Axes>;
  using Scalar = Scalar_;
  using Base::kStates;
  using typename Base::Covariance;
  using typename Base::State;
  static constexpr bool kLinear = true;
  static constexpr int kPosition = Axes;

  using Params = WhiteAccelerationParams<Scalar>;

  Params params;

  explicit WhiteAcceleration(const Params& p = Params()) : params(p) {}

  State f(const State& x, Scalar dt) const {
    State next = x;
    shift(next, dt);
    return next;
  }

  Covariance Phi(const State&, Scalar dt) const {
    Covariance phi;
    math::set_zero(phi);
    for (int i = 0; i < kStates; ++i) phi(i, i) = Scalar(1);
    for (int i = 0; i < Axes; ++i) phi(i, i + Axes) = dt;
    return phi;
  }

  /// x <- Phi x, P <- Phi P Phi' + Q in place.
  template <class Value>
  AUVEST_INLINE void propagate(Belief<Value, kStates>& belief, Scalar dt) const {
    spread(belief.P, dt);
    add_noise(belief.P, dt);
    shift(belief.x, dt);
  }

  /// Trace of the position block of P, z included, after dt seconds, without forming the rest.
  Scalar position_variance(const Belief<Scalar, kStates>& belief, Scalar dt) const {
    const Covariance& p = belief.P;
    Scalar sum = Scalar(0);
    for (int i = 0; i < Axes; ++i) {
      const Scalar crossed = p(i + Axes, i);
      const Scalar moved = p(i, i) + dt * (crossed + (crossed + dt * p(i + Axes, i + Axes)));
      sum = sum + (moved + density(i) * dt * dt * dt / Scalar(3));
    }
    return sum;
  }

  Status check() const {
    return math::is_nonnegative(params.velocity) && math::is_nonnegative(params.vertical_velocity)
               ? Status::kOk
               : Status::kBadParameter;
  }

  // The same on the leading states of a model that has more of them.

  /// The leading states of x <- Phi x.
  template <class Value, int N>
  static AUVEST_INLINE void shift(Vector<Value, N>& x, Scalar dt) {
    AUVEST_UNROLL
    for (int i = 0; i < Axes; ++i) x(i) = x(i) + dt * x(i + Axes);
  }

  /// The leading block of P <- Phi P Phi', in place. Of Phi P, Cov(v_j, p_i) is new and
  /// Cov(v_i, p_j) still old when P(j, i) is made of both.
  template <class Value, int N>
  static AUVEST_INLINE void spread(Matrix<Value, N, N>& p, Scalar dt) {
    AUVEST_UNROLL
    for (int j = 0; j < Axes; ++j) {
      const Value crossed = p(j + Axes, j);
      p(j + Axes, j) = crossed + dt * p(j + Axes, j + Axes);
      p(j, j) = p(j, j) + dt * (crossed + p(j + Axes, j));
      AUVEST_UNROLL
      for (int i = 0; i < j; ++i) {
        const Value other = p(i + Axes, j);  // Cov(v_i, p_j)
        p(j + Axes, i) = p(j + Axes, i) + dt * p(j + Axes, i + Axes);
        p(i + Axes, j) = other + dt * p(j + Axes, i + Axes);
        p(j, i) = p(j, i) + dt * (other + p(j + Axes, i));
      }
    }
  }

  /// Q added to the leading block of P.
  template <class Value, int N>
  AUVEST_INLINE void add_noise(Matrix<Value, N, N>& p, Scalar dt) const {
    AUVEST_UNROLL
    for (int i = 0; i < Axes; ++i) {
      const Scalar vv = density(i) * dt;
      p(i, i) = p(i, i) + vv * dt * dt / Scalar(3);
      p(i + Axes, i) = p(i + Axes, i) + vv * dt / Scalar(2);
      p(i + Axes, i + Axes) = p(i + Axes, i + Axes) + vv;
    }
  }

 private:
  AUVEST_INLINE Scalar density(int axis) const {
    return axis < 2 ? params.velocity : params.vertical_velocity;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
