// Planar constant velocity on the states [x, y, vx, vy, ax, ay] that the other models have, so that
// they can stand side by side in an Imm.
//
// White accelerations of density q_v push the velocity, as in WhiteAcceleration. White noise has no
// memory, so whatever the acceleration was, dt > 0 seconds later it is N(0, sigma_a^2): what a
// manoeuvre may begin with.
#pragma once

#include "auvest/models/white_acceleration.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct ConstantVelocity : ProcessModel<ConstantVelocity<Scalar_>, Scalar_, 6> {
  using Base = ProcessModel<ConstantVelocity<Scalar_>, Scalar_, 6>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;
  static constexpr bool kLinear = true;

  struct Params {
    Scalar velocity = Scalar(1e-4);                ///< q_v [m^2/s^3]
    Scalar sigma_acceleration_m_s2 = Scalar(0.1);  ///< sigma_a
  };

  Params params;

  explicit ConstantVelocity(const Params& p = Params()) : params(p) {}

  State f(const State& x, Scalar dt) const {
    State next = x;
    shift(next, dt);
    return next;
  }

  Covariance Phi(const State&, Scalar dt) const {
    Covariance phi;
    math::set_zero(phi);
    for (int i = 0; i < 6; ++i) phi(i, i) = i < 4 ? Scalar(1) : memory(dt);
    for (int i = 0; i < 2; ++i) phi(i, i + 2) = dt;
    return phi;
  }

  /// x <- Phi x, P <- Phi P Phi' + Q in place: row by row, from elements that are still old.
  template <class Value>
  AUVEST_INLINE void propagate(Belief<Value, 6>& belief, Scalar dt) const {
    Matrix<Value, 6, 6>& p = belief.P;
    const Scalar keep = memory(dt);
    AUVEST_UNROLL
    for (int i = 4; i < 6; ++i) {
      AUVEST_UNROLL
      for (int j = 0; j < 2; ++j) p(i, j) = keep * (p(i, j) + dt * p(i, j + 2));
      AUVEST_UNROLL
      for (int j = 2; j <= i; ++j) p(i, j) = keep * p(i, j);
    }
    Motion::spread(p, dt);
    add_noise(p, dt);
    shift(belief.x, dt);
  }

  Status check() const {
    return math::is_nonnegative(params.velocity) &&
                   math::is_nonnegative(params.sigma_acceleration_m_s2)
               ? Status::kOk
               : Status::kBadParameter;
  }

  /// Adds Q(dt) to a lower triangle.
  template <class Value>
  AUVEST_INLINE void add_noise(Matrix<Value, 6, 6>& p, Scalar dt) const {
    typename Motion::Params noise;
    noise.velocity = params.velocity;
    Motion(noise).add_noise(p, dt);
    const Scalar fresh = Scalar(1) - memory(dt);
    AUVEST_UNROLL
    for (int i = 4; i < 6; ++i) {
      p(i, i) = p(i, i) + fresh * (params.sigma_acceleration_m_s2 * params.sigma_acceleration_m_s2);
    }
  }

 private:
  using Motion = WhiteAcceleration<Scalar, 2>;

  /// What is left of the acceleration: nothing, but all of it where no time passes.
  static Scalar memory(Scalar dt) { return Scalar(dt > Scalar(0) ? 0 : 1); }

  template <class Value>
  static AUVEST_INLINE void shift(Vector<Value, 6>& x, Scalar dt) {
    Motion::shift(x, dt);
    AUVEST_UNROLL
    for (int i = 4; i < 6; ++i) x(i) = memory(dt) * x(i);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
