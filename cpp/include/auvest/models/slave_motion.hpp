// How the slave moves, [SLATF 1] to [SLATF 3]: dead reckoning from readings u that carry noise.
//
//     CompassMotion    u = (speed, heading)   state [x, y]           the paper's [SLATF 2]
//     UnicycleMotion   u = (speed, yaw rate)  state [x, y, heading]
//
// The paper writes V_k = V_mk + w; we read: measured = true + noise. Differs from [SLATF 2]: there
// the position uses the measured heading, while the pose's own heading integrates increments and
// feeds nothing. CompassMotion leaves it out.
//
// Bias of the heading noise. E[cos(phi + w)] = exp(-sigma^2 / 2) cos(phi): with sigma = 0.3 rad
// every displacement computed from a noisy heading is 4.4 % short on average, and 8.6 % where
// particles add the noise a second time. `compensate_bias` divides by these factors: exp(sigma^2/2)
// in means, exp(sigma^2) in samples. The paper does not. (A heading in the state has no such bias:
// its error is estimated.)
//
// A motion model offers, for a reading u and the dt seconds it holds for,
//
//     Step step(u, dt)              what is the same for all particles
//     sample(step, a, b, pose)      the pose moved with the noise deviates a, b ~ N(0, 1)
//     propagate(step, belief)       mean and covariance: x <- f1(x, u), P <- Phi P Phi' + G Q G'
//     transition(step, pose)        Phi
//     noise(step, pose)             G Q G'
//     check()                       kOk, or kBadParameter
//
// of which sample and propagate take batches of particles. With n states, state 2, if there is one,
// is the heading.
#pragma once

#include "auvest/math/angle.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct CompassMotion {
  using Scalar = Scalar_;
  static constexpr int kStates = 2;
  using Control = Vector<Scalar, 2>;  ///< speed [m/s], heading [rad]
  using State = Vector<Scalar, 2>;
  using Covariance = Matrix<Scalar, 2, 2>;

  struct Params {
    Scalar sigma_speed_m_s = Scalar(2);      ///< of one speed reading, section 7
    Scalar sigma_heading_rad = Scalar(0.3);  ///< of one compass reading, section 7
    bool compensate_bias = true;             ///< see above; the paper: false
  };

  Params params;

  explicit CompassMotion(const Params& p = Params()) : params(p) {}

  struct Step {
    Scalar speed, heading;
    Scalar reach;       ///< dt times the compensation of a sample
    Scalar dx, dy;      ///< the mean's displacement
    Scalar xx, xy, yy;  ///< G Q G'
  };

  Step step(const Control& u, Scalar dt) const {
    using math::exp;
    using math::sincos;
    const Scalar variance = params.sigma_heading_rad * params.sigma_heading_rad;
    const Scalar one = Scalar(1);
    Step s;
    s.speed = u(0);
    s.heading = u(1);
    s.reach = dt * (params.compensate_bias ? exp(variance) : one);
    const Scalar reach = dt * (params.compensate_bias ? exp(Scalar(0.5) * variance) : one);
    Scalar sine, cosine;
    sincos(s.heading, sine, cosine);
    // [SLATF 2]
    s.dx = reach * s.speed * cosine;
    s.dy = reach * s.speed * sine;
    // G = [c, -V s; s, V c] reach: `along` and `across` are its columns' lengths.
    const Scalar along = reach * params.sigma_speed_m_s;
    const Scalar across = reach * s.speed * params.sigma_heading_rad;
    s.xx = along * along * (cosine * cosine) + across * across * (sine * sine);
    s.yy = along * along * (sine * sine) + across * across * (cosine * cosine);
    s.xy = (along * along - across * across) * (cosine * sine);
    return s;
  }

  /// The motion at a speed and a heading drawn about the readings.
  template <class Value>
  AUVEST_INLINE void sample(const Step& s, const Value& a, const Value& b,
                            Vector<Value, 2>& pose) const {
    using math::sincos;
    const Value distance = s.reach * (s.speed + params.sigma_speed_m_s * a);
    Value sine, cosine;
    sincos(Value(s.heading + params.sigma_heading_rad * b), sine, cosine);
    // [SLATF 10], by [SLATF 2]
    pose(0) = pose(0) + distance * cosine;
    pose(1) = pose(1) + distance * sine;
  }

  /// Phi = I.
  template <class Value>
  AUVEST_INLINE void propagate(const Step& s, Belief<Value, 2>& pose) const {
    // [SLATF 11]
    pose.x(0) = pose.x(0) + s.dx;
    pose.x(1) = pose.x(1) + s.dy;
    // [SLATF 50]
    pose.P(0, 0) = pose.P(0, 0) + s.xx;
    pose.P(1, 0) = pose.P(1, 0) + s.xy;
    pose.P(1, 1) = pose.P(1, 1) + s.yy;
  }

  Covariance transition(const Step&, const State&) const {
    Covariance phi;
    phi(0, 0) = phi(1, 1) = Scalar(1);
    phi(0, 1) = phi(1, 0) = Scalar(0);
    return phi;
  }

  Covariance noise(const Step& s, const State&) const {
    Covariance q;
    q(0, 0) = s.xx;
    q(0, 1) = q(1, 0) = s.xy;
    q(1, 1) = s.yy;
    return q;
  }

  Status check() const {
    const bool valid = math::is_nonnegative(params.sigma_speed_m_s) &&
                       math::within(params.sigma_heading_rad, Scalar(0), Scalar(3));
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

template <class Scalar_>
struct UnicycleMotion {
  using Scalar = Scalar_;
  static constexpr int kStates = 3;
  using Control = Vector<Scalar, 2>;  ///< speed [m/s], yaw rate [rad/s]
  using State = Vector<Scalar, 3>;
  using Covariance = Matrix<Scalar, 3, 3>;

  struct Params {
    Scalar sigma_speed_m_s = Scalar(0.1);        ///< of one speed reading
    Scalar sigma_yaw_rate_rad_s = Scalar(0.01);  ///< of one yaw rate reading
  };

  Params params;

  explicit UnicycleMotion(const Params& p = Params()) : params(p) {}

  struct Step {
    Scalar dt, speed, yaw_rate;
  };

  Step step(const Control& u, Scalar dt) const {
    Step s;
    s.dt = dt;
    s.speed = u(0);
    s.yaw_rate = u(1);
    return s;
  }

  template <class Value>
  AUVEST_INLINE void sample(const Step& s, const Value& a, const Value& b,
                            Vector<Value, 3>& pose) const {
    using math::sincos;
    using math::wrap;
    const Value distance = s.dt * (s.speed + params.sigma_speed_m_s * a);
    Value sine, cosine;
    sincos(pose(2), sine, cosine);
    // [SLATF 10]
    pose(0) = pose(0) + distance * cosine;
    pose(1) = pose(1) + distance * sine;
    pose(2) = wrap(Value(pose(2) + s.dt * (s.yaw_rate + params.sigma_yaw_rate_rad_s * b)));
  }

  /// Phi = I + [0 0 p; 0 0 q; 0 0 0] with p = -dt V sin, q = dt V cos; G has the columns
  /// dt [cos, sin, 0]' and dt [0, 0, 1]': the noise of one step has rank 2 in three dimensions.
  template <class Value>
  AUVEST_INLINE void propagate(const Step& s, Belief<Value, 3>& pose) const {
    using math::sincos;
    using math::wrap;
    Value sine, cosine;
    sincos(pose.x(2), sine, cosine);
    const Scalar distance = s.dt * s.speed;
    const Value q = distance * cosine;
    const Value p = -(distance * sine);
    Matrix<Value, 3, 3>& c = pose.P;
    // [SLATF 50]
    const Value xh = c(2, 0) + p * c(2, 2);
    const Value yh = c(2, 1) + q * c(2, 2);
    c(0, 0) = c(0, 0) + p * (c(2, 0) + xh);
    c(1, 0) = c(1, 0) + (q * c(2, 0) + p * yh);
    c(1, 1) = c(1, 1) + q * (c(2, 1) + yh);
    c(2, 0) = xh;
    c(2, 1) = yh;
    const Scalar along = s.dt * params.sigma_speed_m_s;
    const Scalar turn = s.dt * params.sigma_yaw_rate_rad_s;
    const Value gx = along * cosine;
    const Value gy = along * sine;
    c(0, 0) = c(0, 0) + gx * gx;
    c(1, 0) = c(1, 0) + gx * gy;
    c(1, 1) = c(1, 1) + gy * gy;
    c(2, 2) = c(2, 2) + turn * turn;
    // [SLATF 11]
    pose.x(0) = pose.x(0) + q;
    pose.x(1) = pose.x(1) - p;
    pose.x(2) = wrap(Value(pose.x(2) + s.dt * s.yaw_rate));
  }

  Covariance transition(const Step& s, const State& pose) const {
    Scalar sine, cosine;
    math::sincos(pose(2), sine, cosine);
    Covariance phi;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) phi(i, j) = Scalar(i == j ? 1 : 0);
    }
    phi(0, 2) = -(s.dt * s.speed * sine);
    phi(1, 2) = s.dt * s.speed * cosine;
    return phi;
  }

  Covariance noise(const Step& s, const State& pose) const {
    Scalar sine, cosine;
    math::sincos(pose(2), sine, cosine);
    const Scalar along = s.dt * params.sigma_speed_m_s;
    const Scalar turn = s.dt * params.sigma_yaw_rate_rad_s;
    Covariance q;
    q(0, 0) = along * cosine * (along * cosine);
    q(0, 1) = q(1, 0) = along * cosine * (along * sine);
    q(1, 1) = along * sine * (along * sine);
    q(0, 2) = q(2, 0) = q(1, 2) = q(2, 1) = Scalar(0);
    q(2, 2) = turn * turn;
    return q;
  }

  Status check() const {
    const bool valid = math::is_nonnegative(params.sigma_speed_m_s) &&
                       math::is_nonnegative(params.sigma_yaw_rate_rad_s);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
