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

#include "auvest/control/integrating_control.hpp"
#include "auvest/control/reference.hpp"
#include "auvest/control/steering.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {

template <class Scalar_>
class HeadingControl : public IntegratingControl<Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = IntegratingControl<Scalar>;
  using typename Base::Step;

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

  explicit HeadingControl(const Params& params = Params()) : Base(valid(params)), params_(params) {
    const Scalar w = params.frequency_rad_s;
    rate_gain_ = Scalar(2) * params.damping * w;
    error_gain_ = w * w;
    integral_gain_ = Scalar(0.1) * (w * w * w);
  }

  /// The rudder [rad], positive for a positive yaw rate, from heading [rad], yaw rate [rad/s] and
  /// speed through the water [m/s]. On anything but kOk nothing has changed, the rudder neither.
  Status update(const Reference<Scalar>& wanted, Scalar heading_rad, Scalar rate_rad_s,
                Scalar speed_m_s, Scalar dt, Scalar& rudder_rad) {
    Step step;
    const Status status = propose(wanted, heading_rad, rate_rad_s, speed_m_s, dt, step);
    if (status != Status::kOk) return status;
    this->accept(step);
    rudder_rad = step.command;
    return Status::kOk;
  }

  /// The same step without taking it: accept(step) does.
  Status propose(const Reference<Scalar>& wanted, Scalar heading_rad, Scalar rate_rad_s,
                 Scalar speed_m_s, Scalar dt, Step& step) const {
    if (this->check() != Status::kOk) return this->check();
    if (!math::is_finite(wanted.value) || !math::is_finite(wanted.rate) ||
        !math::is_finite(wanted.acceleration) || !math::is_finite(heading_rad) ||
        !math::is_finite(rate_rad_s) || !math::is_finite(speed_m_s) || !math::is_finite(dt)) {
      return Status::kNotFinite;
    }
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const Scalar error = math::wrap(heading_rad - wanted.value);
    const Scalar slip = rate_rad_s - wanted.rate;
    const Scalar acceleration = wanted.acceleration - rate_gain_ * slip - error_gain_ * error -
                                integral_gain_ * this->integral();
    const Scalar rate = wanted.rate + params_.share * slip;
    // [CONTROL 5]
    const Scalar wished =
        (params_.time_constant_s * acceleration + rate) / params_.gain_at(speed_m_s);
    return this->limit(wished, -params_.max_rudder_rad, params_.max_rudder_rad, error, false, dt,
                       step);
  }

  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return p.valid() && math::is_positive(p.frequency_rad_s) && math::is_positive(p.damping) &&
           math::within(p.share, Scalar(0), Scalar(1));
  }

  Params params_;
  Scalar rate_gain_, error_gain_, integral_gain_;
};

}  // namespace auvest
