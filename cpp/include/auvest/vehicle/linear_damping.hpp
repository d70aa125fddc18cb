// Damping proportional to the velocity, one coefficient per axis. On the translations it fades with
// the speed through the water, exp(-k U_r): what is left of skin friction at low speed, where the
// quadratic terms have vanished (MSS `remus100`).
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/select.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/flow.hpp"

namespace auvest {

/// `Fading` false: k is 0, and needs neither speed nor exponential.
template <class Scalar_, bool Fading>
struct LinearDamping {
  using Scalar = Scalar_;

  struct Params {
    Scalar surge_kg_s = Scalar(0);     ///< D11 = -X_u
    Scalar sway_kg_s = Scalar(0);      ///< D22 = -Y_v
    Scalar heave_kg_s = Scalar(0);     ///< D33 = -Z_w
    Scalar roll_kg_m2_s = Scalar(0);   ///< D44 = -K_p
    Scalar pitch_kg_m2_s = Scalar(0);  ///< D55 = -M_q
    Scalar yaw_kg_m2_s = Scalar(0);    ///< D66 = -N_r
    Scalar fading_s_m = Scalar(0);     ///< k, only with Fading

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("surge_kg_s", surge_kg_s);
      v("sway_kg_s", sway_kg_s);
      v("heave_kg_s", heave_kg_s);
      v("roll_kg_m2_s", roll_kg_m2_s);
      v("pitch_kg_m2_s", pitch_kg_m2_s);
      v("yaw_kg_m2_s", yaw_kg_m2_s);
      if (Fading) v("fading_s_m", fading_s_m);
    }
  };

  Params params;

  explicit LinearDamping(const Params& p) : params(p) {}

  template <class Freedom, class Value>
  AUVEST_OUTLINE void add_to(Value* tau, const Flow<Value>& flow, Freedom) const {
    const Scalar d[6] = {params.surge_kg_s,   params.sway_kg_s,     params.heave_kg_s,
                         params.roll_kg_m2_s, params.pitch_kg_m2_s, params.yaw_kg_m2_s};
    Value fading = Value(1);
    if (Fading) {
      // Not below e^-80, so that the product is a normal number.
      fading = math::exp_normal(math::larger(-(Value(params.fading_s_m) * flow.speed), Value(-80)));
    }
    AUVEST_UNROLL
    for (int i = 0; i < 6; ++i) {
      if (!Freedom::keeps(i) || d[i] == Scalar(0)) continue;
      const Value force = Value(d[i]) * flow.nu[i];
      tau[i] = tau[i] - (Fading && i < 3 ? force * fading : force);  // [HULL D1]
    }
  }

  Status check() const {
    const bool valid =
        math::is_nonnegative(params.surge_kg_s) && math::is_nonnegative(params.sway_kg_s) &&
        math::is_nonnegative(params.heave_kg_s) && math::is_nonnegative(params.roll_kg_m2_s) &&
        math::is_nonnegative(params.pitch_kg_m2_s) && math::is_nonnegative(params.yaw_kg_m2_s) &&
        math::is_nonnegative(params.fading_s_m);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace auvest
