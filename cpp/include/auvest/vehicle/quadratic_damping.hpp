// Damping proportional to the velocity's square, one coefficient per axis: d |v| v.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/flow.hpp"

namespace auvest {

template <class Scalar_>
struct QuadraticDamping {
  using Scalar = Scalar_;

  struct Params {
    Scalar surge_kg_m = Scalar(0);   ///< -X_u|u|
    Scalar sway_kg_m = Scalar(0);    ///< -Y_v|v|
    Scalar heave_kg_m = Scalar(0);   ///< -Z_w|w|
    Scalar roll_kg_m2 = Scalar(0);   ///< -K_p|p|
    Scalar pitch_kg_m2 = Scalar(0);  ///< -M_q|q|
    Scalar yaw_kg_m2 = Scalar(0);    ///< -N_r|r|

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("surge_kg_m", surge_kg_m);
      v("sway_kg_m", sway_kg_m);
      v("heave_kg_m", heave_kg_m);
      v("roll_kg_m2", roll_kg_m2);
      v("pitch_kg_m2", pitch_kg_m2);
      v("yaw_kg_m2", yaw_kg_m2);
    }
  };

  Params params;

  explicit QuadraticDamping(const Params& p) : params(p) {}

  template <class Freedom, class Value>
  AUVEST_OUTLINE void add_to(Value* tau, const Flow<Value>& flow, Freedom) const {
    const Scalar d[6] = {params.surge_kg_m, params.sway_kg_m,   params.heave_kg_m,
                         params.roll_kg_m2, params.pitch_kg_m2, params.yaw_kg_m2};
    AUVEST_UNROLL
    for (int i = 0; i < 6; ++i) {
      if (!Freedom::keeps(i) || d[i] == Scalar(0)) continue;
      // [HULL D2]
      tau[i] = tau[i] - Value(d[i]) * math::absolute(flow.nu[i]) * flow.nu[i];
    }
  }

  Status check() const {
    const bool valid =
        math::is_nonnegative(params.surge_kg_m) && math::is_nonnegative(params.sway_kg_m) &&
        math::is_nonnegative(params.heave_kg_m) && math::is_nonnegative(params.roll_kg_m2) &&
        math::is_nonnegative(params.pitch_kg_m2) && math::is_nonnegative(params.yaw_kg_m2);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace auvest
