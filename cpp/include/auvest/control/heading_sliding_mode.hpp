// Heading by rudder: integral sliding mode, [CONTROL 6] and [CONTROL 7]. With e = ssa(psi - psi_d),
// e_r = r - r_d,
//
//     s = e_r + 2 l e + l^2 int e,   r_r = r_d - 2 l e - l^2 int e,
//     delta = (T dr_r/dt + r_r - K_d s - K_s sat(s / phi_b)) / K.
//
// On Nomoto's model T ds/dt = -(1 + K_d) s - K_s sat(s / phi_b) + d: from any start s falls into
// the boundary layer |s| < phi_b, and a disturbance |d| < K_s cannot drive it out. On s = 0 the
// error has (d/dt + l)^2 int e = 0; within the layer it has the polynomial
//
//     (T s + 1 + K_d + K_s / phi_b) (s + l)^2.
#pragma once

#include "auvest/control/integrating_control.hpp"
#include "auvest/control/reference.hpp"
#include "auvest/control/steering.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {

template <class Scalar_>
class HeadingSlidingMode : public IntegratingControl<Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = IntegratingControl<Scalar>;
  using typename Base::Step;

  struct Params : Steering<Scalar> {
    Scalar bandwidth_rad_s = Scalar(0.3);   ///< l, > 0
    Scalar damping = Scalar(0.5);           ///< K_d, >= 0
    Scalar switching_rad_s = Scalar(0.05);  ///< K_s, >= 0
    Scalar boundary_rad_s = Scalar(0.1);    ///< phi_b, > 0: half the layer without chattering

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      Steering<Scalar>::visit(v);
      v("bandwidth_rad_s", bandwidth_rad_s);
      v("damping", damping);
      v("switching_rad_s", switching_rad_s);
      v("boundary_rad_s", boundary_rad_s);
    }
  };

  explicit HeadingSlidingMode(const Params& params = Params())
      : Base(valid(params)), params_(params) {}

  /// As HeadingControl::update.
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
    const Scalar one = Scalar(1);
    const Scalar l = params_.bandwidth_rad_s;
    const Scalar error = math::wrap(heading_rad - wanted.value);
    const Scalar slip = rate_rad_s - wanted.rate;
    const Scalar pull = Scalar(2) * l * error + l * l * this->integral();
    const Scalar surface = slip + pull;  // [CONTROL 6]
    const Scalar rate = wanted.rate - pull;
    const Scalar acceleration = wanted.acceleration - Scalar(2) * l * slip - l * l * error;
    const Scalar layer = math::clamp(surface / params_.boundary_rad_s, -one, one);
    // [CONTROL 7]
    const Scalar wished = (params_.time_constant_s * acceleration + rate -
                           params_.damping * surface - params_.switching_rad_s * layer) /
                          params_.gain_at(speed_m_s);
    return this->limit(wished, -params_.max_rudder_rad, params_.max_rudder_rad, error, false, dt,
                       step);
  }

  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return p.valid() && math::is_positive(p.bandwidth_rad_s) && math::is_nonnegative(p.damping) &&
           math::is_nonnegative(p.switching_rad_s) && math::is_positive(p.boundary_rad_s);
  }

  Params params_;
};

}  // namespace auvest
