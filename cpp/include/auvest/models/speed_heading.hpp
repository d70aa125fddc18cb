// Dead reckoning by speed and heading, [MEKF 1] to [MEKF 3] of the M-estimation EKF paper (Li, Du,
// Fan, Chen, Mao, Luo 2020). State [x, y] (m), then what of the instruments is estimated with it:
// the heading bias (rad) and the relative speed error, if the template arguments say so.
//
//     x += dt (v_f cos th - v_s sin th)        th  = measured heading + bias
//     y += dt (v_f sin th + v_s cos th)        v_f, v_s = (1 + scale) measured velocities
//
// Axes. The paper says east-north and a magnetic compass, which contradicts itself. Here x is
// north, y is east, th the compass heading (clockwise from north), v_f the paper's forward v_y and
// v_s its lateral v_x, to starboard. The formula is as good for x east, y north, th from east
// anticlockwise and v_s to port; nothing else may be mixed.
//
// Noise: errors of the forward speed and of the heading, through the Jacobian of [MEKF 1], so that
// Q is in metres. Differs from [MEKF 3]: a variance per second and not per step, so that Q does not
// depend on how often the input is read; for dt = 1 s the two agree. The paper has one speed noise;
// that of the lateral speed is 0 unless it is set. Q takes the heading as measured: its bias turns
// the noise by a small angle only.
#pragma once

#include "auvest/math/trigonometry.hpp"
#include "auvest/models/process_model.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Of the model in all its sizes.
template <class Scalar>
struct SpeedHeadingParams {
  Scalar sigma_forward = Scalar(0.1);        ///< s_v of [MEKF 3] [m/s/sqrt(Hz)]
  Scalar sigma_starboard = Scalar(0);        ///< [m/s/sqrt(Hz)]
  Scalar sigma_heading = Scalar(0.0174533);  ///< s_th of [MEKF 3] [rad/sqrt(Hz)]; 1 deg
  Scalar bias_walk = Scalar(1e-4);           ///< of the heading bias [rad/sqrt(s)]
  Scalar scale_walk = Scalar(1e-4);          ///< of the speed scale [1/sqrt(s)]

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("sigma_forward", sigma_forward);
    v("sigma_starboard", sigma_starboard);
    v("sigma_heading", sigma_heading);
    v("bias_walk", bias_walk);
    v("scale_walk", scale_walk);
  }
};

template <class Scalar_, bool HeadingBias = false, bool SpeedScale = false>
struct SpeedHeading : ProcessModel<SpeedHeading<Scalar_, HeadingBias, SpeedScale>, Scalar_,
                                   2 + int(HeadingBias) + int(SpeedScale)> {
  using Base = ProcessModel<SpeedHeading<Scalar_, HeadingBias, SpeedScale>, Scalar_,
                            2 + int(HeadingBias) + int(SpeedScale)>;
  using Scalar = Scalar_;
  using Base::kStates;
  using typename Base::Covariance;
  using typename Base::State;
  using Input = Vector<Scalar, 3>;  ///< forward speed, starboard speed (m/s), heading (rad)
  static constexpr bool kLinear = kStates == 2;
  static constexpr bool kTranslation = kStates == 2;

  using Params = SpeedHeadingParams<Scalar>;

  Params params;
  Input input;

  explicit SpeedHeading(const Params& p = Params()) : params(p) { math::set_zero(input); }

  State f(const State& x, Scalar dt) const {
    const Motion motion(*this, bias(x), scale(x));
    State next = x;
    // [MEKF 1]
    next(0) = x(0) + dt * motion.vx;
    next(1) = x(1) + dt * motion.vy;
    return next;
  }

  Covariance Phi(const State& x, Scalar dt) const {
    Covariance phi;
    for (int i = 0; i < kStates; ++i) {
      for (int j = 0; j < kStates; ++j) phi(i, j) = Scalar(i == j ? 1 : 0);
    }
    if (HeadingBias) {
      const Motion motion(*this, bias(x), scale(x));
      phi(0, kBias) = -(dt * motion.vy);
      phi(1, kBias) = dt * motion.vx;
    }
    if (SpeedScale) {
      const Motion motion(*this, bias(x), Scalar(0));
      phi(0, kScale) = dt * motion.vx;
      phi(1, kScale) = dt * motion.vy;
    }
    return phi;
  }

  Covariance Q(Scalar dt) const {
    const Motion motion(*this, Scalar(0), Scalar(0));
    // [MEKF 3]
    const Scalar forward = dt * params.sigma_forward * params.sigma_forward;
    const Scalar starboard = dt * params.sigma_starboard * params.sigma_starboard;
    const Scalar heading = dt * params.sigma_heading * params.sigma_heading;
    const Scalar c = motion.cosine;
    const Scalar s = motion.sine;
    Covariance q;
    math::set_zero(q);
    // [MEKF 2]: Gamma diag(forward, heading) Gamma'
    q(0, 0) = forward * c * c + starboard * s * s + heading * motion.vy * motion.vy;
    q(1, 1) = forward * s * s + starboard * c * c + heading * motion.vx * motion.vx;
    q(1, 0) = (forward - starboard) * c * s - heading * motion.vx * motion.vy;
    q(0, 1) = q(1, 0);
    if (HeadingBias) q(kBias, kBias) = dt * params.bias_walk * params.bias_walk;
    if (SpeedScale) q(kScale, kScale) = dt * params.scale_walk * params.scale_walk;
    return q;
  }

  Status check() const {
    const bool valid = math::is_nonnegative(params.sigma_forward) &&
                       math::is_nonnegative(params.sigma_starboard) &&
                       math::is_nonnegative(params.sigma_heading) &&
                       math::is_nonnegative(params.bias_walk) &&
                       math::is_nonnegative(params.scale_walk);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  // Where the optional states are; 0 if they are not.
  static constexpr int kBias = HeadingBias ? 2 : 0;
  static constexpr int kScale = SpeedScale ? kStates - 1 : 0;

  static Scalar bias(const State& x) { return HeadingBias ? x(kBias) : Scalar(0); }
  static Scalar scale(const State& x) { return SpeedScale ? x(kScale) : Scalar(0); }

  /// The velocity over ground.
  struct Motion {
    Scalar sine, cosine;
    Scalar vx, vy;  // [m/s]

    Motion(const SpeedHeading& model, Scalar heading_bias, Scalar speed_scale) {
      math::sincos(model.input(2) + heading_bias, sine, cosine);
      const Scalar factor = Scalar(1) + speed_scale;
      const Scalar forward = factor * model.input(0);
      const Scalar starboard = factor * model.input(1);
      // [MEKF 1]
      vx = forward * cosine - starboard * sine;
      vy = forward * sine + starboard * cosine;
    }
  };
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
