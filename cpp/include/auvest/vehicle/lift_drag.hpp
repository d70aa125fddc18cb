// Lift and drag of a body or a foil that the water meets at the angle of attack a, without any
// angle: cos a = u/U, sin a = (v, w)/U.
//
//     C_L = C_La sin a cos a,   C_D = C_D0 + C_L^2 / (pi e A)
//     drag -1/2 rho S C_D U (u, v, w)
//     lift  1/2 rho S C_La (u/U) (v^2 + w^2, -u v, -u w)
//
// Lift does no work, and both hold ahead, astern and sideways: sin a cos a is 0 at 90 degrees,
// where a lift linear in the angle is not.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/select.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/flow.hpp"

namespace auvest {

template <class Scalar_>
struct LiftDrag {
  using Scalar = Scalar_;

  struct Params {
    Scalar area_m2 = Scalar(0);       ///< S
    Scalar aspect_ratio = Scalar(1);  ///< A
    Scalar drag = Scalar(0);          ///< C_D0, at zero angle
    Scalar lift_slope = Scalar(0);    ///< C_La [1/rad]
    Scalar oswald = Scalar(0.7);      ///< e, the efficiency of the span

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("area_m2", area_m2);
      v("aspect_ratio", aspect_ratio);
      v("drag", drag);
      v("lift_slope", lift_slope);
      v("oswald", oswald);
    }

    bool valid() const {
      return math::is_nonnegative(area_m2) && math::is_positive(aspect_ratio) &&
             math::is_nonnegative(drag) && math::is_nonnegative(lift_slope) &&
             math::is_positive(oswald);
    }
  };

  Params params;

  LiftDrag(const Params& p, Scalar density) : params(p) {
    const Scalar half = Scalar(0.5) * density * p.area_m2;
    const Scalar span = math::pi<Scalar>() * p.oswald * p.aspect_ratio;
    drag_ = half * p.drag;
    lift_ = half * p.lift_slope;
    induced_ = half * (p.lift_slope * p.lift_slope / span);
  }

  /// `along` is the force in x, `across` that in y or z per velocity there: (along, across v,
  /// across w). `cross_square` is v^2 + w^2, `speed` the root of u^2 + cross_square.
  template <class Value>
  AUVEST_OUTLINE void forces(const Value& u, const Value& cross_square, const Value& speed,
                             Value& along, Value& across) const {
    // Below a micrometre per second the forces are less than 1e-9 N whatever the angle.
    const Value inverse = Value(1) / math::larger(speed, Value(1e-6));
    const Value cosine = u * inverse;
    const Value sine_square = cross_square * inverse * inverse;
    // [HULL D3]
    const Value drag = speed * (Value(drag_) + Value(induced_) * sine_square * (cosine * cosine));
    const Value lift = Value(lift_) * cosine;
    along = lift * cross_square - drag * u;
    across = -(drag + lift * u);
  }

  /// Of the body as a whole.
  template <class Freedom, class Value>
  void add_to(Value* tau, const Flow<Value>& flow, Freedom) const {
    Value along, across;
    forces(flow.nu[kSurge], flow.cross_square, flow.speed, along, across);
    tau[kSurge] = tau[kSurge] + along;
    tau[kSway] = tau[kSway] + across * flow.nu[kSway];
    if (Freedom::keeps(kHeave)) tau[kHeave] = tau[kHeave] + across * flow.nu[kHeave];
  }

  Status check() const { return params.valid() ? Status::kOk : Status::kBadParameter; }

 private:
  Scalar drag_, lift_, induced_;  // 1/2 rho S times C_D0, C_La, C_La^2 / (pi e A) [kg/m]
};

/// C_La of a low-aspect-ratio wing: pi A / (1 + sqrt(1 + A^2/4)).
template <class Scalar>
Scalar low_aspect_lift_slope(Scalar aspect_ratio) {
  const Scalar half = Scalar(0.5) * aspect_ratio;
  return math::pi<Scalar>() * aspect_ratio / (Scalar(1) + math::sqrt(Scalar(1) + half * half));
}

}  // namespace auvest
