// A fixed foil below the hull, the "tau_F" of [AUKF 1]: the keel of the yacht that the paper takes
// its hull from. Its centre of pressure (x, 0, z) meets the water at (u + q z, v + r x - p z); the
// force there is that of a foil (lift_drag.hpp), and turns the hull with the arms x and z.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/flow.hpp"
#include "auvest/vehicle/lift_drag.hpp"

namespace auvest {

template <class Scalar_>
struct Keel {
  using Scalar = Scalar_;

  struct Params {
    typename LiftDrag<Scalar>::Params foil;  ///< of area 0: no keel
    Scalar x_m = Scalar(0);                  ///< x_k, forward of the origin
    Scalar z_m = Scalar(0);                  ///< z_k, below it

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("foil", foil);
      v("x_m", x_m);
      v("z_m", z_m);
    }
  };

  Params params;

  Keel(const Params& p, Scalar density) : params(p), foil_(p.foil, density) {}

  template <class Freedom, class Value>
  AUVEST_OUTLINE void add_to(Value* tau, const Flow<Value>& flow, Freedom) const {
    if (params.foil.area_m2 == Scalar(0)) return;
    const Value x = Value(params.x_m);
    const Value z = Value(params.z_m);
    Value u = flow.nu[kSurge];
    Value v = flow.nu[kSway] + flow.nu[kYaw] * x;
    if (Freedom::keeps(kPitch)) u = u + flow.nu[kPitch] * z;
    if (Freedom::keeps(kRoll)) v = v - flow.nu[kRoll] * z;
    const Value vv = v * v;
    Value along, across;
    foil_.forces(u, vv, Value(math::sqrt(u * u + vv)), along, across);
    // [HULL D6]
    const Value side = across * v;
    tau[kSurge] = tau[kSurge] + along;
    tau[kSway] = tau[kSway] + side;
    if (Freedom::keeps(kRoll)) tau[kRoll] = tau[kRoll] - z * side;
    if (Freedom::keeps(kPitch)) tau[kPitch] = tau[kPitch] + z * along;
    tau[kYaw] = tau[kYaw] + x * side;
  }

  Status check() const {
    const bool valid =
        params.foil.valid() && math::is_finite(params.x_m) && math::is_finite(params.z_m);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  LiftDrag<Scalar> foil_;
};

/// A hull without a keel, at no cost.
template <class Scalar_>
struct NoKeel {
  using Scalar = Scalar_;
  struct Params {
    template <class Visitor>
    void visit(Visitor&&) {}
  };

  NoKeel(const Params&, Scalar) {}

  template <class Freedom, class Value>
  void add_to(Value*, const Flow<Value>&, Freedom) const {}

  Status check() const { return Status::kOk; }
};

}  // namespace auvest
