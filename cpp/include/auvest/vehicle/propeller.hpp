// A propeller at the stern: thrust and torque, linear in the advance ratio J = V_a / (n D),
//
//     T = rho D^4 n|n| (KT0 + (KT1 - KT0) J / J1),  V_a = (1 - w) max(u_r, 0)
//
// and Q alike with D^5 and KQ. V_a is the speed through the *water*; with the speed over ground a
// hull would fly differently in a current that it cannot feel. Ahead of J = 1.09 the propeller
// brakes: T < 0. Backwards (n <= 0) there is no term in J.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/select.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/flow.hpp"
#include "auvest/vehicle/lag.hpp"

namespace auvest {

template <class Scalar_>
struct Propeller {
  using Scalar = Scalar_;

  struct Params {
    Scalar diameter_m = Scalar(0);        ///< D
    Scalar thrust_0 = Scalar(0);          ///< KT0, thrust coefficient at J = 0
    Scalar thrust_1 = Scalar(0);          ///< KT1, at J1
    Scalar torque_0 = Scalar(0);          ///< KQ0, torque coefficient at J = 0
    Scalar torque_1 = Scalar(0);          ///< KQ1, at J1
    Scalar advance_1 = Scalar(1);         ///< J1
    Scalar thrust_deduction = Scalar(1);  ///< 1 - t: what of T pushes the hull
    Scalar wake = Scalar(1);              ///< 1 - w: V_a per u_r
    Scalar roll_torque = Scalar(0);       ///< what of Q rolls the hull
    typename Lag<Scalar>::Params shaft;   ///< of the speed n [rev/s]

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("diameter_m", diameter_m);
      v("thrust_0", thrust_0);
      v("thrust_1", thrust_1);
      v("torque_0", torque_0);
      v("torque_1", torque_1);
      v("advance_1", advance_1);
      v("thrust_deduction", thrust_deduction);
      v("wake", wake);
      v("roll_torque", roll_torque);
      v("shaft", shaft);
    }
  };

  Params params;
  Lag<Scalar> shaft;

  Propeller(const Params& p, Scalar density) : params(p), shaft(p.shaft) {
    const Scalar d2 = p.diameter_m * p.diameter_m;
    const Scalar d3 = d2 * p.diameter_m;
    thrust_n_ = density * d2 * d2 * p.thrust_0;
    thrust_va_ = density * d3 * ((p.thrust_1 - p.thrust_0) / p.advance_1);
    torque_n_ = density * d2 * d3 * p.torque_0;
    torque_va_ = density * d2 * d2 * ((p.torque_1 - p.torque_0) / p.advance_1);
  }

  /// T [N] of the propeller itself at `n` rev/s and `u` m/s through the water.
  template <class Value>
  AUVEST_INLINE Value thrust(const Value& n, const Value& u) const {
    return math::absolute(n) *
           (Value(thrust_n_) * n + Value(thrust_va_) * advance(n, u));  // [HULL P1]
  }

  /// Q [N m].
  template <class Value>
  AUVEST_INLINE Value torque(const Value& n, const Value& u) const {
    return math::absolute(n) *
           (Value(torque_n_) * n + Value(torque_va_) * advance(n, u));  // [HULL P2]
  }

  /// The force on the hull, thrust_deduction T, and the torque that rolls it.
  template <class Freedom, class Value>
  AUVEST_OUTLINE void add_to(Value* tau, const Flow<Value>& flow, const Value& n, Freedom) const {
    tau[kSurge] = tau[kSurge] + Value(params.thrust_deduction) * thrust(n, flow.nu[kSurge]);
    if (!Freedom::keeps(kRoll) || params.roll_torque == Scalar(0)) return;
    tau[kRoll] = tau[kRoll] + Value(params.roll_torque) * torque(n, flow.nu[kSurge]);
  }

  /// The speed [rev/s] that gives the hull a force [N] at `u` m/s through the water: the inverse of
  /// the curve, up to the limits of the shaft. Of the two speeds that brake, the negative one.
  Scalar speed_for(Scalar force, Scalar u) const {
    const Scalar wanted = force / params.thrust_deduction;
    if (wanted <= Scalar(0)) return shaft.limited(-math::sqrt(-wanted / thrust_n_));
    const Scalar half = Scalar(0.5) * thrust_va_ * advance(Scalar(1), u);
    const Scalar root = math::sqrt(half * half + thrust_n_ * wanted);
    return shaft.limited((root - half) / thrust_n_);  // [HULL P3]
  }

  Status check() const {
    const bool valid = math::is_positive(params.diameter_m) && math::is_positive(params.thrust_0) &&
                       math::is_finite(params.thrust_1) && math::is_finite(params.torque_0) &&
                       math::is_finite(params.torque_1) && math::is_positive(params.advance_1) &&
                       math::is_positive(params.thrust_deduction) &&
                       math::is_nonnegative(params.wake) && math::is_finite(params.roll_torque);
    return valid ? shaft.check() : Status::kBadParameter;
  }

 private:
  /// V_a, and 0 backwards.
  template <class Value>
  AUVEST_INLINE Value advance(const Value& n, const Value& u) const {
    const math::Mask<Value> ahead = n > Value(0) && u > Value(0);
    return math::select(ahead, Value(Value(params.wake) * u), Value(0));
  }

  Scalar thrust_n_, thrust_va_, torque_n_, torque_va_;  // of n|n| and of |n| V_a
};

}  // namespace auvest
