// Planar constant acceleration: state [x, y, vx, vy, ax, ay] (m, m/s, m/s^2), [AUKF 4] and [AUKF 5]
// of the AUKF paper (Deng, Yin, Duan 2019).
//
// With N the shift that maps velocity to position and acceleration to velocity, the transition
// matrix is Phi(dt) = exp(N dt) = I + N dt + N^2 dt^2 / 2. The paper stops after the first power:
//
//   EulerAcceleration   Phi = I + N dt                 exactly [AUKF 4], no dt^2/2 term
//   ExactAcceleration   Phi = I + N dt + N^2 dt^2 / 2  the exact discretisation
//
// Differs from [AUKF 4]: the paper gives no covariance for its process noise w. Here white noise
// drives each derivative with a power spectral density per state, so that Q fits any interval:
// Q = dt diag(q) to first order (Euler), and the integral of Phi(s) diag(q) Phi(s)' ds (exact).
#pragma once

#include "auvest/models/process_model.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Power spectral densities of the white noise on the rates of the six states, equal for x and y.
template <class Scalar>
struct AccelerationNoise {
  Scalar position = Scalar(1e-6);      ///< q_p [m^2/s]
  Scalar velocity = Scalar(1e-4);      ///< q_v [m^2/s^3]
  Scalar acceleration = Scalar(1e-5);  ///< q_a [m^2/s^5]: white jerk

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("position_psd", position);
    v("velocity_psd", velocity);
    v("acceleration_psd", acceleration);
  }
};

template <class Scalar_, int Order>
struct ConstantAcceleration : ProcessModel<ConstantAcceleration<Scalar_, Order>, Scalar_, 6> {
  static_assert(Order == 1 || Order == 2, "the Taylor series of Phi ends with its second power");
  using Base = ProcessModel<ConstantAcceleration<Scalar_, Order>, Scalar_, 6>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;  // [AUKF 5]
  using Params = AccelerationNoise<Scalar>;
  static constexpr bool kLinear = true;

  Params params;

  explicit ConstantAcceleration(const Params& noise = Params()) : params(noise) {}

  /// x(k+1) = Phi(dt) x(k).
  State f(const State& x, Scalar dt) const {
    State next = x;
    advance(next.data(), 6, Coefficients(dt));  // [AUKF 4]
    return next;
  }

  Covariance Phi(const State&, Scalar dt) const {
    const Coefficients c(dt);
    Covariance phi;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        phi(i, j) = Scalar(0);
        if (j == i) phi(i, j) = Scalar(1);
        if (j == i + 2) phi(i, j) = c.first;
        if (Order == 2 && j == i + 4) phi(i, j) = c.second;
      }
    }
    return phi;
  }

  /// x <- Phi x, P <- Phi P Phi' + Q in place. Row by row, every element is formed from elements
  /// further down or to the right, which still hold their old values. The upper triangle has no
  /// meaning afterwards.
  template <class Value>
  AUVEST_INLINE void propagate(Belief<Value, 6>& belief, Scalar dt) const {
    const Coefficients c(dt);
    Matrix<Value, 6, 6>& p = belief.P;
    math::mirror_lower(p);
    AUVEST_UNROLL
    for (int i = 0; i < 6; ++i) {
      Value* const row = &p(i, 0);
      const int count = Order == 1 || i == 0 ? i + 1 + 2 * Order : 6;  // of those that change
      if (i < 4) math::add_scaled(Value(c.first), row + 12, row, count);
      if (Order == 2 && i < 2) math::add_scaled(Value(c.second), row + 24, row, count);
      advance(row, i + 1, c);
    }
    add_noise(p, dt);
    advance(belief.x.data(), 6, c);  // [AUKF 4]
  }

  /// P_xx + P_yy after dt seconds, without forming the rest of P.
  Scalar position_variance(const Belief<Scalar, 6>& belief, Scalar dt) const {
    const Covariance& p = belief.P;
    const Coefficients c(dt);
    Scalar sum = Scalar(0);
    for (int i = 0; i < 2; ++i) {
      Scalar value = column(p, i, i, c) + c.first * column(p, i, i + 2, c);
      if (Order == 2) value = value + c.second * column(p, i, i + 4, c);
      sum = sum + value;
    }
    return sum + Scalar(2) * position_noise(dt);
  }

  Status check() const {
    return math::is_nonnegative(params.position) && math::is_nonnegative(params.velocity) &&
                   math::is_nonnegative(params.acceleration)
               ? Status::kOk
               : Status::kBadParameter;
  }

  /// Adds Q(dt) to a lower triangle.
  template <class Value>
  AUVEST_INLINE void add_noise(Matrix<Value, 6, 6>& p, Scalar dt) const {
    const Scalar q_v = params.velocity;
    const Scalar q_a = params.acceleration;
    const Scalar dt2 = dt * dt;
    const Scalar pp = position_noise(dt);
    const Scalar vv = Order == 1 ? q_v * dt : dt * (q_v + dt2 * (q_a / Scalar(3)));
    const Scalar aa = q_a * dt;
    add_to_pair(&p(0, 0), pp);
    add_to_pair(&p(2, 2), vv);
    add_to_pair(&p(4, 4), aa);
    if (Order == 2) {
      AUVEST_UNROLL
      for (int i = 0; i < 2; ++i) {
        p(i + 2, i) = p(i + 2, i) + dt2 * (q_v / Scalar(2) + dt2 * (q_a / Scalar(8)));
        p(i + 4, i) = p(i + 4, i) + dt2 * dt * (q_a / Scalar(6));
        p(i + 4, i + 2) = p(i + 4, i + 2) + dt2 * (q_a / Scalar(2));
      }
    }
  }

 private:
  struct Coefficients {
    Scalar first;   // dt
    Scalar second;  // dt^2 / 2
    explicit Coefficients(Scalar dt) : first(dt), second(Scalar(0.5) * dt * dt) {}
  };

  /// The first `count` components of v <- Phi v: each needs those behind it, which still hold their
  /// old values.
  template <class Value>
  static AUVEST_INLINE void advance(Value* v, int count, const Coefficients& c) {
    math::add_scaled(Value(c.first), v + 2, v, count < 4 ? count : 4);
    if (Order == 2) math::add_scaled(Value(c.second), v + 4, v, count < 2 ? count : 2);
  }

  /// Element (i, j) of Phi P, from the lower triangle of P.
  template <class Value>
  static AUVEST_INLINE Value column(const Matrix<Value, 6, 6>& p, int i, int j,
                                    const Coefficients& c) {
    Value value = at(p, i, j);
    if (i + 2 < 6) value = value + c.first * at(p, i + 2, j);
    if (Order == 2 && i + 4 < 6) value = value + c.second * at(p, i + 4, j);
    return value;
  }

  template <class Value>
  static AUVEST_INLINE const Value& at(const Matrix<Value, 6, 6>& p, int i, int j) {
    return i >= j ? p(i, j) : p(j, i);
  }

  AUVEST_INLINE Scalar position_noise(Scalar dt) const {
    if (Order == 1) return params.position * dt;
    const Scalar dt2 = dt * dt;
    return dt * (params.position +
                 dt2 * (params.velocity / Scalar(3) + dt2 * (params.acceleration / Scalar(20))));
  }

  /// Adds a variance to an element of the diagonal and to the next one: x and y.
  template <class Value>
  static AUVEST_OUTLINE AUVEST_INLINE void add_to_pair(Value* diagonal, Scalar variance) {
    diagonal[0] = diagonal[0] + variance;
    diagonal[7] = diagonal[7] + variance;
  }
};

/// The paper's model, exactly [AUKF 4].
template <class Scalar>
using EulerAcceleration = ConstantAcceleration<Scalar, 1>;

/// The exact discretisation of constant acceleration driven by white noise.
template <class Scalar>
using ExactAcceleration = ConstantAcceleration<Scalar, 2>;

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
