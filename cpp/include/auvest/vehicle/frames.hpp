// Between the body's frame and north-east-down: positions [m], velocities [m/s], Euler angles
// (yaw, then pitch, then roll) and their rates, [AUKF 2] of the AUKF paper.
//
// Vectors turn by three plane rotations, one per angle, so a projection pays only for the angles
// that it keeps. The rates have 1/cos(theta): advance() (integrate.hpp) refuses pitch
// beyond 80 degrees.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/vehicle/freedom.hpp"

namespace auvest {

/// Sine and cosine of roll, pitch and yaw; 0 and 1 of those that a projection drops.
template <class Value>
struct Attitude {
  Value sin_roll, cos_roll, sin_pitch, cos_pitch, sin_yaw, cos_yaw;

  Attitude() : sin_roll(0), cos_roll(1), sin_pitch(0), cos_pitch(1), sin_yaw(0), cos_yaw(1) {}

  /// Of the pose [positions, angles] of a projection.
  template <class Freedom>
  static Attitude of(const Value* pose, Freedom) {
    Attitude a;
    AUVEST_UNROLL
    for (int i = 0; i < Freedom::kSize; ++i) {
      if (Freedom::axis(i) == kRoll) math::sincos(pose[i], a.sin_roll, a.cos_roll);
      if (Freedom::axis(i) == kPitch) math::sincos(pose[i], a.sin_pitch, a.cos_pitch);
      if (Freedom::axis(i) == kYaw) math::sincos(pose[i], a.sin_yaw, a.cos_yaw);
    }
    return a;
  }

  /// v <- R v: from the body to north-east-down.
  template <class Freedom>
  AUVEST_INLINE void to_world(Value* v, Freedom) const {
    if (Freedom::keeps(kRoll)) turn(sin_roll, cos_roll, v[1], v[2]);
    if (Freedom::keeps(kPitch)) turn(sin_pitch, cos_pitch, v[2], v[0]);
    turn(sin_yaw, cos_yaw, v[0], v[1]);
  }

  /// v <- R' v: from north-east-down to the body.
  template <class Freedom>
  AUVEST_INLINE void to_body(Value* v, Freedom) const {
    turn(-sin_yaw, cos_yaw, v[0], v[1]);
    if (Freedom::keeps(kPitch)) turn(-sin_pitch, cos_pitch, v[2], v[0]);
    if (Freedom::keeps(kRoll)) turn(-sin_roll, cos_roll, v[1], v[2]);
  }

 private:
  /// The plane rotation by an angle, from a towards b.
  static AUVEST_INLINE void turn(const Value& s, const Value& c, Value& a, Value& b) {
    const Value turned = c * a - s * b;
    b = s * a + c * b;
    a = turned;
  }
};

/// The rates of the pose of a projection from the velocities `nu` through the water (all six, those
/// of dropped axes 0) in water that moves with `current` (north, east, down).
template <class Freedom, class Value>
AUVEST_OUTLINE void pose_rates(const Attitude<Value>& a, const Value* nu, const Value* current,
                               Value* rate) {
  Value velocity[3] = {nu[0], nu[1], nu[2]};
  a.to_world(velocity, Freedom());  // [AUKF 2] [HULL K1]
  Value across = nu[kYaw];          // the rate about the vertical, but for 1/cos(theta)
  Value pitch_rate = nu[kPitch];
  if (Freedom::keeps(kRoll)) {
    across = nu[kYaw] * a.cos_roll;
    if (Freedom::keeps(kPitch)) across = nu[kPitch] * a.sin_roll + across;
    pitch_rate = nu[kPitch] * a.cos_roll - nu[kYaw] * a.sin_roll;
  }
  // [AUKF 2] [HULL K2]
  const Value yaw_rate = Freedom::keeps(kPitch) ? across / a.cos_pitch : across;
  const Value roll_rate = Freedom::keeps(kPitch) ? nu[kRoll] + a.sin_pitch * yaw_rate : nu[kRoll];
  const Value all[6] = {velocity[0] + current[0],
                        velocity[1] + current[1],
                        velocity[2] + current[2],
                        roll_rate,
                        pitch_rate,
                        yaw_rate};
  AUVEST_UNROLL
  for (int i = 0; i < Freedom::kSize; ++i) rate[i] = all[Freedom::axis(i)];
}

}  // namespace auvest
