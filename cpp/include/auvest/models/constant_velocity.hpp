// Planar constant velocity on the states [x, y, vx, vy, ax, ay] that the other models have, so that
// they can stand side by side in an Imm.
//
// White accelerations of density q_v push the velocity: Bar-Shalom, Li and Kirubarajan, "Estimation
// with applications to tracking and navigation", 6.2.2. White noise has no memory, so whatever the
// acceleration was, dt > 0 seconds later it is N(0, sigma_a^2): what a manoeuvre may begin with.
#pragma once

#include "auvest/models/process_model.hpp"

namespace auvest {

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

  Covariance Q(Scalar dt) const {
    Covariance q;
    math::set_zero(q);
    add_noise(q, dt);
    math::mirror_lower(q);
    return q;
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
    const Value yx = p(2, 1);  // Cov(vx, y) and Cov(vy, x)
    const Value xy = p(3, 0);
    AUVEST_UNROLL
    for (int i = 0; i < 2; ++i) {
      const Value crossed = p(i + 2, i);
      p(i + 2, i) = crossed + dt * p(i + 2, i + 2);
      p(i, i) = p(i, i) + dt * (crossed + p(i + 2, i));
    }
    p(3, 0) = xy + dt * p(3, 2);
    p(2, 1) = yx + dt * p(3, 2);
    p(1, 0) = p(1, 0) + dt * (yx + p(3, 0));
    add_noise(p, dt);
    shift(belief.x, dt);
  }

  Status check() const {
    return math::is_nonnegative(params.velocity) &&
                   math::is_nonnegative(params.sigma_acceleration_m_s2)
               ? Status::kOk
               : Status::kBadParameter;
  }

 private:
  /// What is left of the acceleration: nothing, but all of it where no time passes.
  static Scalar memory(Scalar dt) { return Scalar(dt > Scalar(0) ? 0 : 1); }

  template <class Value>
  static AUVEST_INLINE void shift(Vector<Value, 6>& x, Scalar dt) {
    AUVEST_UNROLL
    for (int i = 0; i < 2; ++i) {
      x(i) = x(i) + dt * x(i + 2);
      x(i + 4) = memory(dt) * x(i + 4);
    }
  }

  template <class Value>
  AUVEST_INLINE void add_noise(Matrix<Value, 6, 6>& p, Scalar dt) const {
    const Scalar vv = params.velocity * dt;
    const Scalar fresh = Scalar(1) - memory(dt);
    AUVEST_UNROLL
    for (int i = 0; i < 2; ++i) {
      p(i, i) = p(i, i) + vv * dt * dt / Scalar(3);
      p(i + 2, i) = p(i + 2, i) + vv * dt / Scalar(2);
      p(i + 2, i + 2) = p(i + 2, i + 2) + vv;
      p(i + 4, i + 4) = p(i + 4, i + 4) +
                        fresh * (params.sigma_acceleration_m_s2 * params.sigma_acceleration_m_s2);
    }
  }
};

}  // namespace auvest
