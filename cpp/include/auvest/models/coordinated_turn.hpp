// Planar coordinated turn on the states [x, y, vx, vy, ax, ay]: the turn rate is that of the state,
//
//     omega = (v x a) / (|v|^2 + v_0^2),
//
// which for v_0 = 0 is exact on a circle, where a = omega J v (J turns by 90 degrees). There the
// jerk is -omega^2 v, so each axis on its own follows p''' = -omega^2 p'. With u = omega^2:
//
//     p <- p + A v + B a      A = sin(omega dt) / omega          = dt S cos(h)
//     v <-     C v + A a      B = (1 - cos(omega dt)) / omega^2  = dt^2 S^2 / 2
//     a <-     D v + C a      C = cos(omega dt) = 1 - u B,   D = -u A
//
// with S = sin(h) / h at half the angle, h = omega dt / 2. All are functions of u: the sign of
// omega is in a, and as omega -> 0 the model turns into constant acceleration. v_0 is a speed at
// which a direction of motion can hardly be told: far below it omega -> 0, too. White noise drives
// the rates as in ExactAcceleration. Differs from the usual model, which has omega as a seventh
// state: these are the six states of the other models of an Imm. (Rate from the state: Li and
// Jilkov, "Survey of maneuvering target tracking, part I", IEEE Trans. AES 39(4), 2003.)
//
// Phi is the Jacobian of f, with the change of omega:
//
//     Phi = [I, A I, B I; 0, C I, A I; 0, D I, C I] + (df/du) (du/dx)'.
#pragma once

#include "auvest/math/trigonometry.hpp"
#include "auvest/models/constant_acceleration.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct CoordinatedTurn : ProcessModel<CoordinatedTurn<Scalar_>, Scalar_, 6> {
  using Base = ProcessModel<CoordinatedTurn<Scalar_>, Scalar_, 6>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;

  struct Params {
    AccelerationNoise<Scalar> noise;
    Scalar slow_m_s = Scalar(0.01);  ///< v_0, > 0
  };

  Params params;

  explicit CoordinatedTurn(const Params& p = Params()) : params(p) {}

  State f(const State& x, Scalar dt) const { return moved(x, Turn<Scalar>(x, params, dt)); }

  Covariance Phi(const State& x, Scalar dt) const {
    return jacobian(x, Turn<Scalar>(x, params, dt));
  }

  Covariance Q(Scalar dt) const { return ExactAcceleration<Scalar>(params.noise).Q(dt); }

  template <class Value>
  AUVEST_INLINE void propagate(Belief<Value, 6>& belief, Scalar dt) const {
    const Turn<Value> turn(belief.x, params, dt);
    belief.P = math::symmetric_product(jacobian(belief.x, turn), belief.P);
    const Covariance q = Q(dt);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) belief.P(i, j) = belief.P(i, j) + Value(q(i, j));
    }
    belief.x = moved(belief.x, turn);
  }

  Status check() const {
    const Status noise = ExactAcceleration<Scalar>(params.noise).check();
    return math::is_positive(params.slow_m_s) ? noise : Status::kBadParameter;
  }

 private:
  /// The turn of a state, and how its coefficients change with u.
  template <class Value>
  struct Turn {
    Value inverse;  ///< 1 / (|v|^2 + v_0^2)
    Value omega;
    Value a, b, c, d;
    Value a_u, b_u, c_u, d_u;

    AUVEST_INLINE Turn(const Vector<Value, 6>& x, const Params& params, Scalar dt) {
      using math::select;
      using math::sincos;
      const Value t(dt);
      inverse = Value(1) / (x(2) * x(2) + x(3) * x(3) + Value(params.slow_m_s * params.slow_m_s));
      omega = (x(2) * x(5) - x(3) * x(4)) * inverse;
      const Value u = omega * omega;
      const Value half = Value(Scalar(0.5)) * (omega * t);
      const Value w = half * half;
      Value sine, cosine;
      sincos(half, sine, cosine);
      // S and its derivative with respect to w = h^2; near zero by their series.
      const math::Mask<Value> small = w < Value(Scalar(0.01));
      const Value h = select(small, Value(1), half);
      const Value s_near =
          Value(1) - w * (Value(Scalar(1.0 / 6)) -
                          w * (Value(Scalar(1.0 / 120)) - w * Value(Scalar(1.0 / 5040))));
      const Value s = select(small, s_near, sine / h);
      const Value slope_near =
          w * (Value(Scalar(1.0 / 60)) -
               w * (Value(Scalar(1.0 / 1680)) - w * Value(Scalar(1.0 / 90720)))) -
          Value(Scalar(1.0 / 6));
      const Value slope = select(small, slope_near, (cosine - s) / (Value(2) * (h * h)));

      a = t * (s * cosine);
      b = Value(Scalar(0.5)) * ((t * t) * (s * s));
      c = Value(1) - u * b;
      d = -(u * a);
      const Value w_u = Value(Scalar(0.25)) * (t * t);
      a_u = (t * w_u) * (slope * cosine - Value(Scalar(0.5)) * (s * s));
      b_u = ((t * t) * w_u) * (s * slope);
      c_u = -(Value(Scalar(0.5)) * (t * a));
      d_u = -(Value(Scalar(0.5)) * (a + t * c));
    }
  };

  template <class Value>
  static AUVEST_INLINE Vector<Value, 6> moved(const Vector<Value, 6>& x, const Turn<Value>& turn) {
    Vector<Value, 6> next;
    AUVEST_UNROLL
    for (int i = 0; i < 2; ++i) {
      next(i) = x(i) + (turn.a * x(i + 2) + turn.b * x(i + 4));
      next(i + 2) = turn.c * x(i + 2) + turn.a * x(i + 4);
      next(i + 4) = turn.d * x(i + 2) + turn.c * x(i + 4);
    }
    return next;
  }

  template <class Value>
  static AUVEST_INLINE Matrix<Value, 6, 6> jacobian(const Vector<Value, 6>& x,
                                                    const Turn<Value>& turn) {
    const Value outer = Value(2) * turn.omega * turn.inverse;  // du = 2 omega d(omega)
    const Value inner = Value(2) * turn.omega;
    Vector<Value, 6> by_state;  // du/dx
    by_state(0) = by_state(1) = Value(0);
    by_state(2) = outer * (x(5) - inner * x(2));
    by_state(3) = -(outer * (x(4) + inner * x(3)));
    by_state(4) = -(outer * x(3));
    by_state(5) = outer * x(2);
    Matrix<Value, 6, 6> phi;
    AUVEST_UNROLL
    for (int i = 0; i < 2; ++i) {
      const Value p_u = turn.a_u * x(i + 2) + turn.b_u * x(i + 4);
      const Value v_u = turn.c_u * x(i + 2) + turn.a_u * x(i + 4);
      const Value a_u = turn.d_u * x(i + 2) + turn.c_u * x(i + 4);
      AUVEST_UNROLL
      for (int j = 0; j < 6; ++j) {
        phi(i, j) = p_u * by_state(j);
        phi(i + 2, j) = v_u * by_state(j);
        phi(i + 4, j) = a_u * by_state(j);
      }
      phi(i, i) = Value(1);
      phi(i, i + 2) = phi(i, i + 2) + turn.a;
      phi(i, i + 4) = phi(i, i + 4) + turn.b;
      phi(i + 2, i + 2) = phi(i + 2, i + 2) + turn.c;
      phi(i + 2, i + 4) = phi(i + 2, i + 4) + turn.a;
      phi(i + 4, i + 2) = phi(i + 4, i + 2) + turn.d;
      phi(i + 4, i + 4) = phi(i + 4, i + 4) + turn.c;
    }
    return phi;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
