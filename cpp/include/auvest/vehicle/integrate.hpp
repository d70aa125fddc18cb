// Steps of a hull in time, with the command held over the step.
//
//     Rk4           fourth order; four evaluations of the forces
//     SemiImplicit  first order: velocities and actuators from the old state, then the pose with
//     the
//                   new velocities; one evaluation
//
// Both take a number or a batch of numbers. How long a step may be: stable_step.hpp.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "auvest/vehicle/frames.hpp"
#include "auvest/vehicle/freedom.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

struct Rk4 {
  template <class Hull, class Value>
  static void step(const Hull& hull, Vector<Value, Hull::kStates>& x,
                   const Vector<Value, Hull::kActuators>& command, const Vector<Value, 3>& current,
                   typename Hull::Scalar h) {
    constexpr int n = Hull::kStates;
    const Vector<Value, Hull::kActuators> demand = hull.demands(command);
    Vector<Value, n> slope, sum, stage;
    math::set_zero(sum);
    math::copy(x, stage);
    for (int k = 0; k < 4; ++k) {
      hull.rate(stage, demand, current, slope);
      const Value weight = Value(k == 0 || k == 3 ? 1 : 2);
      math::add_scaled(weight, slope.data(), sum.data(), n);
      if (k == 3) break;
      math::copy(x, stage);
      const Value part = Value(k == 2 ? h : typename Hull::Scalar(0.5) * h);
      math::add_scaled(part, slope.data(), stage.data(), n);
    }
    math::add_scaled(Value(h / typename Hull::Scalar(6)), sum.data(), x.data(), n);  // [HULL I1]
    hull.limit(x);
  }
};

struct SemiImplicit {
  template <class Hull, class Value>
  static void step(const Hull& hull, Vector<Value, Hull::kStates>& x,
                   const Vector<Value, Hull::kActuators>& command, const Vector<Value, 3>& current,
                   typename Hull::Scalar h) {
    constexpr int poses = Hull::kVelocities;
    const Attitude<Value> attitude = hull.attitude(x);
    Vector<Value, Hull::kStates> slope;
    hull.motion_rate(attitude, x, hull.demands(command), slope);
    // [HULL I2]
    math::add_scaled(Value(h), slope.data() + poses, x.data() + poses, Hull::kStates - poses);
    hull.pose_rate(attitude, x, current, slope);
    math::add_scaled(Value(h), slope.data(), x.data(), poses);
    hull.limit(x);
  }
};

/// One checked step of `h` >= 0 seconds. On anything but kOk `x` is unchanged: kNotFinite (an
/// argument), kTimeBackwards, kOverflow (the result is not finite) or kSteepPitch (pitch beyond 80
/// degrees).
template <class Method, class Hull>
Status advance(const Hull& hull, typename Hull::State& x, const typename Hull::Command& command,
               const typename Hull::Current& current, typename Hull::Scalar h) {
  using Scalar = typename Hull::Scalar;
  if (!math::all_finite(x) || !math::all_finite(command) || !math::all_finite(current) ||
      !math::is_finite(h)) {
    return Status::kNotFinite;
  }
  if (h < Scalar(0)) return Status::kTimeBackwards;
  typename Hull::State next;
  math::copy(x, next);
  Method::step(hull, next, command, current, h);
  if (!math::all_finite(next)) return Status::kOverflow;
  for (int i = 0; i < Hull::kVelocities; ++i) {
    const bool pitch = Hull::Freedom::axis(i) == kPitch;
    if (pitch && math::absolute(next(i)) > Scalar(1.3962634015954636)) return Status::kSteepPitch;
  }
  math::copy(next, x);
  return Status::kOk;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
