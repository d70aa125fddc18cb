// A pair of fins at the stern that turns the hull: a rudder (in yaw) or stern planes (in pitch).
// The force is linear in the fin's angle and follows the axial flow, so that astern it changes its
// sign; the flow across the hull and its rotation give no angle of attack.
//
// A positive rudder turns to starboard, a positive stern plane takes the nose down.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/flow.hpp"
#include "auvest/vehicle/lag.hpp"

namespace auvest {

/// `Force` is the axis of the fins' force: kSway of a rudder, kHeave of stern planes.
template <class Scalar_, int Force>
struct Fin {
  static_assert(Force == kSway || Force == kHeave, "a rudder or stern planes");
  using Scalar = Scalar_;

  struct Params {
    Scalar area_m2 = Scalar(0);          ///< A_f, of the pair
    Scalar lift_slope = Scalar(0);       ///< force coefficient per radian
    Scalar x_m = Scalar(0);              ///< x_f, forward of the origin: negative at the stern
    typename Lag<Scalar>::Params servo;  ///< of the angle [rad]

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("area_m2", area_m2);
      v("lift_slope", lift_slope);
      v("x_m", x_m);
      v("servo", servo);
    }
  };

  Params params;
  Lag<Scalar> servo;

  Fin(const Params& p, Scalar density)
      : params(p), servo(p.servo), scale_(Scalar(0.5) * density * p.area_m2 * p.lift_slope) {}

  template <class Freedom, class Value>
  AUVEST_OUTLINE void add_to(Value* tau, const Flow<Value>& flow, const Value& angle,
                             Freedom) const {
    const Value u = flow.nu[kSurge];
    const Value slope = Value(scale_) * (u * math::absolute(u));
    // [HULL F1]
    const Value force = -(slope * angle);
    tau[kSurge] = tau[kSurge] - math::absolute(slope) * (angle * angle);
    if (!Freedom::keeps(Force)) return;
    tau[Force] = tau[Force] + force;
    if (Force == kSway) tau[kYaw] = tau[kYaw] + Value(params.x_m) * force;
    if (Force == kHeave) tau[kPitch] = tau[kPitch] - Value(params.x_m) * force;
  }

  Status check() const {
    const bool valid = math::is_nonnegative(params.area_m2) &&
                       math::is_nonnegative(params.lift_slope) && math::is_finite(params.x_m);
    return valid ? servo.check() : Status::kBadParameter;
  }

 private:
  Scalar scale_;  // 1/2 rho A_f times the slope
};

}  // namespace auvest
