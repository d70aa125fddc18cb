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

#include "auvest/control/heading_controller.hpp"
#include "auvest/control/reference.hpp"
#include "auvest/control/steering.hpp"
#include "auvest/math/basic.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class HeadingControl : public HeadingController<HeadingControl<Scalar_>, Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = HeadingController<HeadingControl<Scalar_>, Scalar_>;

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

  /// The rudder [rad] before its limit; see HeadingController.
  Scalar wished(const Reference<Scalar>& wanted, Scalar error, Scalar slip,
                Scalar speed_m_s) const {
    const Scalar acceleration = wanted.acceleration - rate_gain_ * slip - error_gain_ * error -
                                integral_gain_ * this->integral();
    const Scalar rate = wanted.rate + params_.share * slip;
    // [CONTROL 5]
    return (params_.time_constant_s * acceleration + rate) / params_.gain_at(speed_m_s);
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

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
