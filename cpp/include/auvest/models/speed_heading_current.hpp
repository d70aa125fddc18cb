// Dead reckoning through the water with the current in the state, [GUIDE 15]: state [x, y, Vx, Vy]
// (m, m/s), driven by log, sway log and compass. The model-aided filter of a vehicle: the vehicle
// tells its own motion, fixes of the position (USBL, ranges) tell the current.
//
//     x += dt (u cos psi - v sin psi + Vx)        u, v  velocity through the water, ahead and to
//     y += dt (u sin psi + v cos psi + Vy)              starboard; psi  heading
//
// x is north, y east, psi from north to east; other axes as in speed_heading.hpp. As a guidance
// law, CrabFeedForward takes Vx and Vy.
//
// Noise: white on the position, q, and a random walk of the current, q_c, exact for any dt. The log
// alone is less than the default q: 0.05 m/s at 10 Hz are 2.5e-4 m^2/s. What it is for is what is
// in no state: a compass that is off by 1 deg makes 0.026 m/s across the track at 1.5 m/s, and
// turns with the vehicle. q = 0.004 m^2/s covers that over a leg of a minute or two; with a compass
// known better take less.
#pragma once

#include "auvest/math/trigonometry.hpp"
#include "auvest/models/process_model.hpp"
#include "auvest/models/white_acceleration.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct SpeedHeadingCurrent : ProcessModel<SpeedHeadingCurrent<Scalar_>, Scalar_, 4> {
  using Base = ProcessModel<SpeedHeadingCurrent<Scalar_>, Scalar_, 4>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;
  using Input = Vector<Scalar, 3>;  ///< speed ahead, to starboard (m/s), heading (rad)
  static constexpr bool kLinear = true;

  struct Params {
    Scalar position = Scalar(0.004);  ///< q [m^2/s]
    Scalar current = Scalar(1e-5);    ///< q_c [m^2/s^3]: 0.02 m/s in 40 s

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("position_psd", position);
      v("current_psd", current);
    }
  };

  Params params;
  Input input;

  explicit SpeedHeadingCurrent(const Params& p = Params()) : params(p) { math::set_zero(input); }

  State f(const State& x, Scalar dt) const {
    State next = x;
    move(next, dt);
    return next;
  }

  Covariance Phi(const State&, Scalar dt) const {
    Covariance phi;
    math::set_zero(phi);
    for (int i = 0; i < 4; ++i) phi(i, i) = Scalar(1);
    phi(0, 2) = phi(1, 3) = dt;
    return phi;
  }

  /// x <- f(x), P <- Phi P Phi' + Q in place.
  template <class Value>
  AUVEST_INLINE void propagate(Belief<Value, 4>& belief, Scalar dt) const {
    WhiteAcceleration<Scalar, 2>::spread(belief.P, dt);
    add_noise(belief.P, dt);
    move(belief.x, dt);
  }

  /// P_xx + P_yy after dt seconds, without forming the rest of P.
  Scalar position_variance(const Belief<Scalar, 4>& belief, Scalar dt) const {
    const Covariance& p = belief.P;
    Scalar sum = Scalar(0);
    for (int i = 0; i < 2; ++i) {
      const Scalar crossed = p(i + 2, i);
      sum = sum + (p(i, i) + dt * (crossed + (crossed + dt * p(i + 2, i + 2))));
    }
    return sum + Scalar(2) * position_noise(dt);
  }

  Status check() const {
    return math::is_nonnegative(params.position) && math::is_nonnegative(params.current)
               ? Status::kOk
               : Status::kBadParameter;
  }

  /// Adds Q(dt) to a lower triangle.
  template <class Value>
  AUVEST_INLINE void add_noise(Matrix<Value, 4, 4>& p, Scalar dt) const {
    const Scalar walk = params.current * dt;
    AUVEST_UNROLL
    for (int i = 0; i < 2; ++i) {
      p(i, i) = p(i, i) + Value(position_noise(dt));
      p(i + 2, i) = p(i + 2, i) + Value(walk * dt / Scalar(2));
      p(i + 2, i + 2) = p(i + 2, i + 2) + Value(walk);
    }
  }

 private:
  template <class Value>
  AUVEST_INLINE void move(Vector<Value, 4>& x, Scalar dt) const {
    Scalar sine, cosine;
    math::sincos(input(2), sine, cosine);
    // [GUIDE 15]
    x(0) = x(0) + Value(dt) * (x(2) + Value(input(0) * cosine - input(1) * sine));
    x(1) = x(1) + Value(dt) * (x(3) + Value(input(0) * sine + input(1) * cosine));
  }

  Scalar position_noise(Scalar dt) const {
    return dt * (params.position + params.current * dt * dt / Scalar(3));
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
