// A reference model of third order, for steps of a heading, pitch or depth, [CONTROL 3],
//
//     da_d/dt = w^3 (r - x_d) - (2 zeta + 1) w^2 v_d - (2 zeta + 1) w a_d,
//
// with a limited rate. Where the rate meets its limit the acceleration is cut too: cut alone, as
// published code does, v_d leaves an a_d that winds up and the reference overshoots. The difference
// r - x_d of angles is the smallest signed one.
//
// Stepped by semi-implicit Euler: a_d, then v_d with it, then x_d with that.
#pragma once

#include "auvest/control/reference.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// `Angle`: the value is an angle and is kept in (-pi, pi].
template <class Scalar_, bool Angle = true>
class ReferenceModel {
 public:
  using Scalar = Scalar_;

  struct Params {
    Scalar frequency_rad_s = Scalar(0.5);  ///< w, > 0; dt (2 zeta + 1) w must be well below 1
    Scalar damping = Scalar(1);            ///< zeta, > 0; 1: no overshoot
    Scalar max_rate = Scalar(0.10471975511965978);  ///< of |v_d| per s, > 0; 6 deg/s

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("frequency_rad_s", frequency_rad_s);
      v("damping", damping);
      v("max_rate", max_rate);
    }
  };

  explicit ReferenceModel(const Params& params = Params())
      : params_(params), check_(valid(params) ? Status::kOk : Status::kBadParameter) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// Begins at rest at this value, the vehicle's own.
  Status restart(Scalar value) {
    if (!math::is_finite(value)) return Status::kNotFinite;
    state_.value = Angle ? math::wrap(value) : value;
    state_.rate = state_.acceleration = Scalar(0);
    return Status::kOk;
  }

  /// The reference dt seconds on, on its way to `wanted`. On anything but kOk nothing has changed.
  Status update(Scalar wanted, Scalar dt, Reference<Scalar>& reference) {
    if (check_ != Status::kOk) return check_;
    if (!math::is_finite(wanted) || !math::is_finite(dt)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const Scalar w = params_.frequency_rad_s;
    const Scalar brake = Scalar(2) * params_.damping + Scalar(1);
    const Scalar difference = wanted - state_.value;
    const Scalar error = Angle ? math::wrap(difference) : difference;
    Reference<Scalar> next = state_;
    // [CONTROL 3]
    const Scalar jerk = w * (w * (w * error - brake * next.rate) - brake * next.acceleration);
    next.acceleration = next.acceleration + dt * jerk;
    const Scalar rate = next.rate + dt * next.acceleration;
    const Scalar limited = math::clamp(rate, -params_.max_rate, params_.max_rate);
    if (limited < rate || limited > rate) next.acceleration = (limited - next.rate) / dt;
    next.rate = limited;
    next.value = next.value + dt * next.rate;
    if (Angle) next.value = math::wrap(next.value);
    if (!math::is_finite(next.value) || !math::is_finite(next.acceleration)) {
      return Status::kOverflow;
    }
    state_ = next;
    reference = next;
    return Status::kOk;
  }

  const Reference<Scalar>& state() const { return state_; }
  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return math::is_positive(p.frequency_rad_s) && math::is_positive(p.damping) &&
           math::is_positive(p.max_rate);
  }

  Params params_;
  Status check_;
  Reference<Scalar> state_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
