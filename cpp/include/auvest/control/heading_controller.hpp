// What the controllers of a heading by rudder have in common: what they read, what they refuse, and
// the limits of the rudder. Each derives from HeadingController<Itself, Scalar> and offers
//
//     Scalar wished(wanted, error, slip, speed) const   rudder [rad], before its limit
//
// with error = ssa(psi - psi_d) [rad], slip = r - r_d [rad/s] and the speed through the water
// [m/s]; its Params are a Steering with more.
#pragma once

#include "auvest/control/integrating_control.hpp"
#include "auvest/control/reference.hpp"
#include "auvest/control/steering.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Derived, class Scalar_>
class HeadingController : public IntegratingControl<Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = IntegratingControl<Scalar>;
  using typename Base::Step;

  /// The rudder [rad], positive for a positive yaw rate, from heading [rad], yaw rate [rad/s] and
  /// speed through the water [m/s]. On anything but kOk nothing has changed, the rudder neither.
  Status update(const Reference<Scalar>& wanted, Scalar heading_rad, Scalar rate_rad_s,
                Scalar speed_m_s, Scalar dt, Scalar& rudder_rad) {
    Step step;
    return this->take(propose(wanted, heading_rad, rate_rad_s, speed_m_s, dt, step), step,
                      rudder_rad);
  }

  /// The same step without taking it: accept(step) does.
  Status propose(const Reference<Scalar>& wanted, Scalar heading_rad, Scalar rate_rad_s,
                 Scalar speed_m_s, Scalar dt, Step& step) const {
    const Status status = this->admit(dt, wanted.value, wanted.rate, wanted.acceleration,
                                      heading_rad, rate_rad_s, speed_m_s);
    if (status != Status::kOk) return status;
    const Derived& derived = static_cast<const Derived&>(*this);
    const Scalar error = math::wrap(heading_rad - wanted.value);
    const Scalar wished = derived.wished(wanted, error, rate_rad_s - wanted.rate, speed_m_s);
    const Scalar most = derived.params().max_rudder_rad;
    return this->limit(wished, -most, most, error, false, dt, step);
  }

 protected:
  explicit HeadingController(bool valid) : Base(valid) {}
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
