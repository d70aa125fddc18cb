// A hull in the water: [AUKF 1] to [AUKF 3] of the AUKF paper, in six degrees of freedom or fewer.
//
//     d(eta)/dt  = J(eta) nu_r + [V_c; 0]                                [AUKF 2]
//     M d(nu_r)/dt = tau - C(nu_r) nu_r - D(nu_r) nu_r - g(eta)          [AUKF 1]
//
// Differs from [AUKF 1], which prints no time derivative, D as a negative definite force and the
// weight twice; and from [AUKF 3], whose sign of the forces does not follow from [AUKF 1]. The
// state holds the velocity nu_r through the water, of which every force is a function: so a steady
// current V_c (north, east, down) only moves the hull, exactly. (The rigid-body part may be written
// in nu or in nu_r: for a current that does not turn it is the same.)
//
//     x = [pose, velocities through the water, actuators]
//
// A vehicle says what acts on the hull (torpedo.hpp, rov.hpp; your own is one struct). It offers
//
//     Scalar, Params                  Params: HullParams and the vehicle's own
//     kActuators
//     kNeedsSpeed                     whether a load reads the speed of the flow
//     kAddedCoriolis                  whether C_A is left to the hull; false: a load has it
//     demands(command, demand)        saturation and curves of the command, once per step
//     actuator_rates(state, demand, rate)
//     limit_actuators(state)          after a step
//     add_loads(tau, flow, actuators, freedom)
//     check()
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "auvest/vehicle/added_mass.hpp"
#include "auvest/vehicle/flow.hpp"
#include "auvest/vehicle/frames.hpp"
#include "auvest/vehicle/freedom.hpp"
#include "auvest/vehicle/restoring.hpp"
#include "auvest/vehicle/rigid_body.hpp"

namespace auvest {

/// What every vehicle has. A group of parameters is visited by its name and has a visit of its own.
template <class Scalar>
struct HullParams {
  typename RigidBody<Scalar>::Params body;
  typename AddedMass<Scalar>::Params added_mass;
  typename Restoring<Scalar>::Params restoring;

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("body", body);
    v("added_mass", added_mass);
    v("restoring", restoring);
  }
};

template <class Vehicle_, class Freedom_ = SixDof>
class Hull {
 public:
  using Vehicle = Vehicle_;
  using Freedom = Freedom_;
  using Scalar = typename Vehicle::Scalar;
  using Params = typename Vehicle::Params;

  static constexpr int kVelocities = Freedom::kSize;  // and as many components of the pose
  static constexpr int kActuators = Vehicle::kActuators;
  static constexpr int kStates = 2 * kVelocities + kActuators;

  using State = Vector<Scalar, kStates>;
  using Velocity = Vector<Scalar, kVelocities>;
  using Command = Vector<Scalar, kActuators>;
  using Current = Vector<Scalar, 3>;

  explicit Hull(const Params& p)
      : vehicle_(p), added_(p.added_mass), restoring_(p.restoring, p.body) {
    math::set_zero(coriolis_);
    RigidBody<Scalar>(p.body).add_to(coriolis_);
    math::copy(coriolis_, mass_);
    added_.add_to(mass_);
    if (Vehicle::kAddedCoriolis && p.added_mass.munk) math::copy(mass_, coriolis_);
    invert();
  }

  const Vehicle& vehicle() const { return vehicle_; }
  const Params& params() const { return vehicle_.params; }

  /// M = M_RB + M_A of all six axes.
  const Matrix<Scalar, 6, 6>& mass_matrix() const { return mass_; }

  /// kBadParameter: a parameter out of its range, as a mass that is not positive.
  /// kNotPositiveDefinite: M is none, as where an added mass has the wrong sign.
  Status check() const {
    const Params& p = vehicle_.params;
    const Status parts[] = {RigidBody<Scalar>(p.body).check(), added_.check(), restoring_.check(),
                            vehicle_.check()};
    for (const Status part : parts) {
      if (part != Status::kOk) return part;
    }
    return math::is_positive_definite(mass_) ? Status::kOk : Status::kNotPositiveDefinite;
  }

  // ---- The state -------------------------------------------------------------------------------

  /// At the origin, level, heading north, at rest over ground, actuators at 0.
  State at_rest(const Current& current) const {
    State x;
    math::set_zero(x);
    Velocity still;
    math::set_zero(still);
    set_ground_velocity(x, still, current);
    return x;
  }

  /// The velocities over ground, in the body's frame: nu = nu_r + [R' V_c, 0].
  Velocity ground_velocity(const State& x, const Current& current) const {
    Velocity stream = current_in_body(x, current);
    for (int i = 0; i < kVelocities; ++i) stream(i) = x(kVelocities + i) + stream(i);
    return stream;
  }

  /// Sets the velocities through the water from those over ground.
  void set_ground_velocity(State& x, const Velocity& ground, const Current& current) const {
    const Velocity stream = current_in_body(x, current);
    for (int i = 0; i < kVelocities; ++i) x(kVelocities + i) = ground(i) - stream(i);
  }

  // ---- Rates, for a number or for a batch of them ----------------------------------------------

  template <class Value>
  static Attitude<Value> attitude(const Vector<Value, kStates>& x) {
    return Attitude<Value>::of(x.data(), Freedom());
  }

  /// What the actuators make of a command.
  template <class Value>
  Vector<Value, kActuators> demands(const Vector<Value, kActuators>& command) const {
    Vector<Value, kActuators> demand;
    vehicle_.demands(command.data(), demand.data());
    return demand;
  }

  /// The rates of the pose, into dx.
  template <class Value>
  void pose_rate(const Attitude<Value>& a, const Vector<Value, kStates>& x,
                 const Vector<Value, 3>& current, Vector<Value, kStates>& dx) const {
    Flow<Value> flow;
    flow.set(x.data() + kVelocities, false, Freedom());
    pose_rates<Freedom>(a, flow.nu, current.data(), dx.data());
  }

  /// The rates of velocities and actuators, into dx.
  template <class Value>
  void motion_rate(const Attitude<Value>& a, const Vector<Value, kStates>& x,
                   const Vector<Value, kActuators>& demand, Vector<Value, kStates>& dx) const {
    const Value* const actuators = x.data() + 2 * kVelocities;
    acceleration(a, x.data() + kVelocities, actuators, dx.data() + kVelocities);
    vehicle_.actuator_rates(actuators, demand.data(), dx.data() + 2 * kVelocities);
  }

  /// dx = f(x), with the demands of a command.
  template <class Value>
  void rate(const Vector<Value, kStates>& x, const Vector<Value, kActuators>& demand,
            const Vector<Value, 3>& current, Vector<Value, kStates>& dx) const {
    const Attitude<Value> a = attitude(x);
    pose_rate(a, x, current, dx);
    motion_rate(a, x, demand, dx);
  }

  /// d(nu_r)/dt from the velocities through the water and the state of the actuators.
  template <class Value>
  AUVEST_OUTLINE void acceleration(const Attitude<Value>& a, const Value* velocities,
                                   const Value* actuators, Value* result) const {
    Value tau[6];
    forces(a, velocities, actuators, tau);
    AUVEST_UNROLL
    for (int i = 0; i < kVelocities; ++i) {
      Value sum = Value(0);
      AUVEST_UNROLL
      for (int j = 0; j < kVelocities; ++j) {
        if (inverse_(i, j) == Scalar(0)) continue;
        sum = sum + Value(inverse_(i, j)) * tau[Freedom::axis(j)];
      }
      result[i] = sum;  // [AUKF 3]
    }
  }

  /// tau - C nu_r - D nu_r - g, on the axes that are kept.
  template <class Value>
  AUVEST_OUTLINE void forces(const Attitude<Value>& a, const Value* velocities,
                             const Value* actuators, Value* tau) const {
    Flow<Value> flow;
    flow.set(velocities, Vehicle::kNeedsSpeed, Freedom());
    math::set_zero(tau, 6);
    vehicle_.add_loads(tau, flow, actuators, Freedom());  // [AUKF 1]
    subtract_coriolis(coriolis_, flow.nu, tau, Freedom());
    if (Vehicle::kAddedCoriolis && !vehicle_.params.added_mass.munk) {
      added_.subtract_reduced_coriolis(flow.nu, tau, Freedom());
    }
    restoring_.subtract_from(tau, a, Freedom());
  }

  /// The actuators within their limits: what rounding or a long step has carried beyond.
  template <class Value>
  AUVEST_INLINE void limit(Vector<Value, kStates>& x) const {
    vehicle_.limit_actuators(x.data() + 2 * kVelocities);
  }

 private:
  Velocity current_in_body(const State& x, const Current& current) const {
    Scalar stream[6];
    math::set_zero(stream, 6);
    for (int i = 0; i < 3; ++i) stream[i] = current(i);
    attitude(x).to_body(stream, Freedom());
    Velocity kept;
    for (int i = 0; i < kVelocities; ++i) kept(i) = stream[Freedom::axis(i)];
    return kept;
  }

  /// (E M E')^-1 from its factors L D L'.
  AUVEST_OUTLINE void invert() {
    constexpr int n = kVelocities;
    Matrix<Scalar, n, n> l;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) l(i, j) = mass_(Freedom::axis(i), Freedom::axis(j));
    }
    Vector<Scalar, n> pivots;
    math::ldlt(l.data(), n, Scalar(0), pivots.data());
    for (int column = 0; column < n; ++column) {
      Vector<Scalar, n> y;
      for (int i = 0; i < n; ++i) {
        y(i) = Scalar(i == column ? 1 : 0);
        for (int k = 0; k < i; ++k) y(i) = y(i) - l(i, k) * y(k);
      }
      for (int i = n - 1; i >= 0; --i) {
        y(i) = y(i) * pivots(i);
        for (int k = i + 1; k < n; ++k) y(i) = y(i) - l(k, i) * y(k);
        inverse_(i, column) = y(i);
      }
    }
    math::mirror_lower(inverse_);
  }

  Vehicle vehicle_;
  AddedMass<Scalar> added_;
  Restoring<Scalar> restoring_;
  Matrix<Scalar, 6, 6> mass_;      // M
  Matrix<Scalar, 6, 6> coriolis_;  // the M of C(nu): all of it, or M_RB
  Matrix<Scalar, kVelocities, kVelocities> inverse_;
};

}  // namespace auvest
