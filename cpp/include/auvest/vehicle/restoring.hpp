// Weight and buoyancy: g(eta) of [AUKF 1], all of it, in roll and in pitch. (The paper has them a
// second time, in tau_G: one of the two must be zero.)
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/frames.hpp"
#include "auvest/vehicle/rigid_body.hpp"

namespace auvest {

template <class Scalar_>
struct Restoring {
  using Scalar = Scalar_;

  struct Params {
    Scalar weight_n = Scalar(0);    ///< W = m g
    Scalar buoyancy_n = Scalar(0);  ///< B = rho g V
    Scalar xb_m = Scalar(0);        ///< r_b, the centre of buoyancy: forward
    Scalar yb_m = Scalar(0);        ///< to starboard
    Scalar zb_m = Scalar(0);        ///< down

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("weight_n", weight_n);
      v("buoyancy_n", buoyancy_n);
      v("xb_m", xb_m);
      v("yb_m", yb_m);
      v("zb_m", zb_m);
    }
  };

  Params params;

  Restoring(const Params& p, const typename RigidBody<Scalar>::Params& body) : params(p) {
    excess_ = p.weight_n - p.buoyancy_n;
    arm_[0] = body.xg_m * p.weight_n - p.xb_m * p.buoyancy_n;
    arm_[1] = body.yg_m * p.weight_n - p.yb_m * p.buoyancy_n;
    arm_[2] = body.zg_m * p.weight_n - p.zb_m * p.buoyancy_n;
  }

  /// tau <- tau - g(eta).
  template <class Freedom, class Value>
  AUVEST_OUTLINE void subtract_from(Value* tau, const Attitude<Value>& a, Freedom) const {
    const bool tilts = Freedom::keeps(kRoll) || Freedom::keeps(kPitch);
    if (!tilts && !Freedom::keeps(kHeave)) return;
    // Down, in the body's frame.
    const Value down[3] = {-a.sin_pitch, a.cos_pitch * a.sin_roll, a.cos_pitch * a.cos_roll};
    // [HULL G1]: the force (W - B) down, the moment arm x down
    if (excess_ != Scalar(0)) {
      AUVEST_UNROLL
      for (int i = 0; i < 3; ++i) {
        if (Freedom::keeps(i)) tau[i] = tau[i] + Value(excess_) * down[i];
      }
    }
    AUVEST_UNROLL
    for (int i = 0; i < 3; ++i) {
      if (!Freedom::keeps(3 + i)) continue;
      const int j = i < 2 ? i + 1 : 0;
      const int k = i > 0 ? i - 1 : 2;
      if (arm_[j] != Scalar(0)) tau[3 + i] = tau[3 + i] + Value(arm_[j]) * down[k];
      if (arm_[k] != Scalar(0)) tau[3 + i] = tau[3 + i] - Value(arm_[k]) * down[j];
    }
  }

  Status check() const {
    const bool valid = math::is_nonnegative(params.weight_n) &&
                       math::is_nonnegative(params.buoyancy_n) && math::is_finite(params.xb_m) &&
                       math::is_finite(params.yb_m) && math::is_finite(params.zb_m);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  Scalar excess_;  // W - B [N]
  Scalar arm_[3];  // r_g W - r_b B [N m]
};

}  // namespace auvest
