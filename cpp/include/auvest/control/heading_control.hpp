// Heading by rudder: a PID whose poles are placed, [CONTROL 5]. With e = ssa(psi - psi_d),
//
//     delta = (T (dr_d/dt - 2 zeta w (r - r_d) - w^2 e - w^3/10 int e) + r_f) / K,
//     r_f = r_d + share (r - r_d).
//
// On its own model, T dr/dt + r = K delta, the error has exactly the polynomial
//
//     s^3 + (2 zeta w + (1 - share) / T) s^2 + w^2 s + w^3/10:
//
// share = 1 takes the hull's own yaw damping out, share = 0 keeps it and brings less of the gyro's
// noise to the rudder. The derivative acts on the rate, never on differences of headings.
//
//     auvest::HeadingControl<float> control;           // once
//     float rudder;                                    // each period of 0.1 s:
//     control.update(reference, heading, yaw_rate, 1.5f, 0.1f, rudder);
#pragma once

#include "auvest/control/integrator.hpp"
#include "auvest/control/reference.hpp"
#include "auvest/control/steering.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {

template <class Scalar_>
class HeadingControl {
 public:
  using Scalar = Scalar_;

  struct Params : Steering<Scalar> {
    Scalar frequency_rad_s = Scalar(0.8);  ///< w, > 0
    Scalar damping = Scalar(1);            ///< zeta, > 0
    Scalar share = Scalar(0);              ///< of the measured rate in r_f, within 0 and 1

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      Steering<Scalar>::visit(v);
      v("frequency_rad_s", frequency_rad_s);
      v("damping", damping);
      v("share", share);
    }
  };

  explicit HeadingControl(const Params& params = Params())
      : params_(params),
        check_(valid(params) ? Status::kOk : Status::kBadParameter),
        saturated_(false) {
    const Scalar w = params.frequency_rad_s;
    rate_gain_ = Scalar(2) * params.damping * w;
    error_gain_ = w * w;
    integral_gain_ = Scalar(0.1) * (w * w * w);
  }

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// The rudder [rad], positive for a positive yaw rate, from heading [rad], yaw rate [rad/s] and
  /// speed through the water [m/s]. On anything but kOk nothing has changed, the rudder neither.
  Status update(const Reference<Scalar>& wanted, Scalar heading_rad, Scalar rate_rad_s,
                Scalar speed_m_s, Scalar dt, Scalar& rudder_rad) {
    if (check_ != Status::kOk) return check_;
    if (!math::is_finite(wanted.value) || !math::is_finite(wanted.rate) ||
        !math::is_finite(wanted.acceleration) || !math::is_finite(heading_rad) ||
        !math::is_finite(rate_rad_s) || !math::is_finite(speed_m_s) || !math::is_finite(dt)) {
      return Status::kNotFinite;
    }
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const Scalar error = math::wrap(heading_rad - wanted.value);
    const Scalar slip = rate_rad_s - wanted.rate;
    const Scalar acceleration = wanted.acceleration - rate_gain_ * slip - error_gain_ * error -
                                integral_gain_ * integral_.value();
    const Scalar rate = wanted.rate + params_.share * slip;
    // [CONTROL 5]
    const Scalar wished =
        (params_.time_constant_s * acceleration + rate) / params_.gain_at(speed_m_s);
    if (!math::is_finite(wished)) return Status::kOverflow;
    rudder_rad = math::clamp(wished, -params_.max_rudder_rad, params_.max_rudder_rad);
    const Scalar excess = rudder_rad - wished;  // a positive error lowers the rudder
    saturated_ = excess < Scalar(0) || excess > Scalar(0);
    integral_.add(error, dt, excess);
    return Status::kOk;
  }

  bool saturated() const { return saturated_; }          ///< in the last update
  Scalar integral() const { return integral_.value(); }  ///< int e [rad s]
  /// Goes on with this integral; what is not a number is refused.
  Status restart(Scalar integral = Scalar(0)) {
    if (!math::is_finite(integral)) return Status::kNotFinite;
    integral_.restart(integral);
    saturated_ = false;
    return Status::kOk;
  }
  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return p.valid() && math::is_positive(p.frequency_rad_s) && math::is_positive(p.damping) &&
           math::within(p.share, Scalar(0), Scalar(1));
  }

  Params params_;
  Status check_;
  Scalar rate_gain_, error_gain_, integral_gain_;
  Integrator<Scalar> integral_;
  bool saturated_;
};

}  // namespace auvest
