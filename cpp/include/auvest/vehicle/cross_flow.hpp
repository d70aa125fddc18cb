// Cross-flow drag: each slice of the hull meets the water across it at s(x) = v + x r and feels
// 1/2 rho d C s|s| dx. The integral over the length L, exactly, instead of over strips. With
// a = |v| and b = |r| L/2, the speed of the bow relative to the middle,
//
//     a >= b   I0 = sgn(v) L (a^2 + b^2/3)       I1 = sgn(r) L^2/3 a b
//     a < b    I0 = sgn(v) L a b (1 + q^2/3)     I1 = sgn(r) L^2 b^2 (1/8 + q^2/4 - q^4/24), q =
//     a/b
//
// where I0 is the integral of s|s| and I1 that of x s|s|. Both meet at a = b.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/select.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/flow.hpp"

namespace auvest {

/// I0 [m^3/s^2] and I1 [m^4/s^2] of a hull of `length` [m] in the flow v + x r.
template <class Scalar, class Value>
AUVEST_OUTLINE void cross_flow_integrals(Scalar length, const Value& v, const Value& r, Value& i0,
                                         Value& i1) {
  const Scalar third = Scalar(1) / Scalar(3);
  const Value a = math::absolute(v);
  const Value b = math::absolute(r) * Value(Scalar(0.5) * length);
  const Value ab = a * b;
  // [HULL D4]
  i0 = a * a + b * b * Value(third);
  i1 = ab * Value(third);
  const math::Mask<Value> turning = a < b;
  using math::any;  // or that of a batch's mask
  if (any(turning)) {
    const Value q = a / math::select(turning, b, Value(1));
    const Value qq = q * q;
    const Value bent = Value(0.125) + qq * (Value(0.25) - qq * Value(Scalar(1) / Scalar(24)));
    // [HULL D5]
    i0 = math::select(turning, Value(ab * (Value(1) + qq * Value(third))), i0);
    i1 = math::select(turning, Value(b * b * bent), i1);
  }
  i0 = math::copy_sign(Value(Value(length) * i0), v);
  i1 = math::copy_sign(Value(Value(length * length) * i1), r);
}

template <class Scalar_>
struct CrossFlow {
  using Scalar = Scalar_;

  struct Params {
    Scalar length_m = Scalar(0);    ///< L
    Scalar diameter_m = Scalar(0);  ///< d
    Scalar drag = Scalar(0);        ///< C of a slice (Hoerner's curve)

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("length_m", length_m);
      v("diameter_m", diameter_m);
      v("drag", drag);
    }
  };

  Params params;

  CrossFlow(const Params& p, Scalar density)
      : params(p), scale_(Scalar(0.5) * density * p.diameter_m * p.drag) {}

  template <class Freedom, class Value>
  void add_to(Value* tau, const Flow<Value>& flow, Freedom) const {
    Value i0, i1;
    cross_flow_integrals(params.length_m, flow.nu[kSway], flow.nu[kYaw], i0, i1);
    tau[kSway] = tau[kSway] - Value(scale_) * i0;
    tau[kYaw] = tau[kYaw] - Value(scale_) * i1;
    if (!Freedom::keeps(kHeave)) return;
    cross_flow_integrals(params.length_m, flow.nu[kHeave], Value(-flow.nu[kPitch]), i0, i1);
    tau[kHeave] = tau[kHeave] - Value(scale_) * i0;
    tau[kPitch] = tau[kPitch] + Value(scale_) * i1;
  }

  Status check() const {
    const bool valid = math::is_positive(params.length_m) &&
                       math::is_nonnegative(params.diameter_m) && math::is_nonnegative(params.drag);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  Scalar scale_;  // 1/2 rho d C [kg/m^2]
};

}  // namespace auvest
