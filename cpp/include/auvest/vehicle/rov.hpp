// A remotely operated vehicle: a blunt frame with linear and quadratic damping on each axis, and
// thrusters. Its parameters: bluerov2_heavy.hpp.
#pragma once

#include "auvest/status.hpp"
#include "auvest/vehicle/hull.hpp"
#include "auvest/vehicle/linear_damping.hpp"
#include "auvest/vehicle/quadratic_damping.hpp"
#include "auvest/vehicle/thrust_curve.hpp"
#include "auvest/vehicle/thrusters.hpp"

namespace auvest {

/// The command is the normalised input of each thruster; the state, its thrust [N].
template <class Scalar_, int Count, class Curve = OddThrust<Scalar_>>
struct Rov {
  using Scalar = Scalar_;
  static constexpr int kActuators = Count;
  static constexpr bool kNeedsSpeed = false;
  static constexpr bool kAddedCoriolis = true;

  struct Params : HullParams<Scalar> {
    typename LinearDamping<Scalar, false>::Params linear_damping;
    typename QuadraticDamping<Scalar>::Params quadratic_damping;
    typename Thrusters<Scalar, Count, Curve>::Params thrusters;

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      HullParams<Scalar>::visit(v);
      v("linear_damping", linear_damping);
      v("quadratic_damping", quadratic_damping);
      v("thrusters", thrusters);
    }
  };

  Params params;
  LinearDamping<Scalar, false> linear_damping;
  QuadraticDamping<Scalar> quadratic_damping;
  Thrusters<Scalar, Count, Curve> thrusters;

  explicit Rov(const Params& p)
      : params(p),
        linear_damping(p.linear_damping),
        quadratic_damping(p.quadratic_damping),
        thrusters(p.thrusters) {}

  template <class Freedom, class Value>
  void add_loads(Value* tau, const Flow<Value>& flow, const Value* actuators,
                 Freedom freedom) const {
    linear_damping.add_to(tau, flow, freedom);
    quadratic_damping.add_to(tau, flow, freedom);
    thrusters.add_to(tau, actuators, freedom);
  }

  template <class Value>
  void demands(const Value* command, Value* demand) const {
    thrusters.demands(command, demand);
  }

  template <class Value>
  void actuator_rates(const Value* state, const Value* demand, Value* rate) const {
    for (int i = 0; i < Count; ++i) rate[i] = thrusters.lag.rate(state[i], demand[i]);
  }

  template <class Value>
  void limit_actuators(Value* state) const {
    for (int i = 0; i < Count; ++i) state[i] = thrusters.lag.limited(state[i]);
  }

  Status check() const {
    const Status parts[] = {linear_damping.check(), quadratic_damping.check(), thrusters.check()};
    for (const Status part : parts) {
      if (part != Status::kOk) return part;
    }
    return Status::kOk;
  }
};

}  // namespace auvest
