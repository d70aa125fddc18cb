// A torpedo-shaped vehicle: a slender body of revolution with a propeller, a rudder and stern
// planes. Its parameters: remus100.hpp.
#pragma once

#include <cstdint>

#include "auvest/status.hpp"
#include "auvest/vehicle/cross_flow.hpp"
#include "auvest/vehicle/fin.hpp"
#include "auvest/vehicle/hull.hpp"
#include "auvest/vehicle/keel.hpp"
#include "auvest/vehicle/lift_drag.hpp"
#include "auvest/vehicle/linear_damping.hpp"
#include "auvest/vehicle/propeller.hpp"

namespace auvest {

/// The actuators of a torpedo, in the order of command and state.
enum TorpedoActuator : std::uint8_t {
  kRudder,       ///< angle [rad], positive: to starboard
  kSternPlanes,  ///< angle [rad], positive: nose down
  kPropeller     ///< speed [rev/s]
};

/// `Keel_` is Keel<Scalar> for a hull with a fixed foil.
template <class Scalar_, class Keel_ = NoKeel<Scalar_>>
struct Torpedo {
  using Scalar = Scalar_;
  static constexpr int kActuators = 3;
  static constexpr bool kNeedsSpeed = true;
  static constexpr bool kAddedCoriolis = true;

  struct Params : HullParams<Scalar> {
    Scalar density_kg_m3 = Scalar(0);  ///< rho of the water
    typename LinearDamping<Scalar, true>::Params linear_damping;
    typename LiftDrag<Scalar>::Params lift_drag;
    typename CrossFlow<Scalar>::Params cross_flow;
    typename Keel_::Params keel;
    typename Propeller<Scalar>::Params propeller;
    typename Fin<Scalar, kSway>::Params rudder;
    typename Fin<Scalar, kHeave>::Params stern_planes;

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      HullParams<Scalar>::visit(v);
      v("density_kg_m3", density_kg_m3);
      v("linear_damping", linear_damping);
      v("lift_drag", lift_drag);
      v("cross_flow", cross_flow);
      v("keel", keel);
      v("propeller", propeller);
      v("rudder", rudder);
      v("stern_planes", stern_planes);
    }
  };

  Params params;
  LinearDamping<Scalar, true> linear_damping;
  LiftDrag<Scalar> lift_drag;
  CrossFlow<Scalar> cross_flow;
  Keel_ keel;
  Propeller<Scalar> propeller;
  Fin<Scalar, kSway> rudder;
  Fin<Scalar, kHeave> stern_planes;

  explicit Torpedo(const Params& p)
      : params(p),
        linear_damping(p.linear_damping),
        lift_drag(p.lift_drag, p.density_kg_m3),
        cross_flow(p.cross_flow, p.density_kg_m3),
        keel(p.keel, p.density_kg_m3),
        propeller(p.propeller, p.density_kg_m3),
        rudder(p.rudder, p.density_kg_m3),
        stern_planes(p.stern_planes, p.density_kg_m3) {}

  template <class Freedom, class Value>
  void add_loads(Value* tau, const Flow<Value>& flow, const Value* actuators,
                 Freedom freedom) const {
    linear_damping.add_to(tau, flow, freedom);
    lift_drag.add_to(tau, flow, freedom);
    cross_flow.add_to(tau, flow, freedom);
    keel.add_to(tau, flow, freedom);
    propeller.add_to(tau, flow, actuators[kPropeller], freedom);
    rudder.add_to(tau, flow, actuators[kRudder], freedom);
    stern_planes.add_to(tau, flow, actuators[kSternPlanes], freedom);
  }

  template <class Value>
  void demands(const Value* command, Value* demand) const {
    demand[kRudder] = rudder.servo.demand(command[kRudder]);
    demand[kSternPlanes] = stern_planes.servo.demand(command[kSternPlanes]);
    demand[kPropeller] = propeller.shaft.demand(command[kPropeller]);
  }

  template <class Value>
  void actuator_rates(const Value* state, const Value* demand, Value* rate) const {
    rate[kRudder] = rudder.servo.rate(state[kRudder], demand[kRudder]);
    rate[kSternPlanes] = stern_planes.servo.rate(state[kSternPlanes], demand[kSternPlanes]);
    rate[kPropeller] = propeller.shaft.rate(state[kPropeller], demand[kPropeller]);
  }

  template <class Value>
  void limit_actuators(Value* state) const {
    state[kRudder] = rudder.servo.limited(state[kRudder]);
    state[kSternPlanes] = stern_planes.servo.limited(state[kSternPlanes]);
    state[kPropeller] = propeller.shaft.limited(state[kPropeller]);
  }

  Status check() const {
    if (!math::is_positive(params.density_kg_m3)) return Status::kBadParameter;
    const Status parts[] = {linear_damping.check(), lift_drag.check(), cross_flow.check(),
                            keel.check(),           propeller.check(), rudder.check(),
                            stern_planes.check()};
    for (const Status part : parts) {
      if (part != Status::kOk) return part;
    }
    return Status::kOk;
  }
};

}  // namespace auvest
