// The degrees of freedom that a hull keeps: six, or a projection of the same parameters.
//
// A projection fixes the velocities of the axes that it drops to zero and keeps the rows and
// columns of the others: M_s = E M E', forces E tau(E' nu_s). The dropped rows are carried by
// constraint forces. What each is good for: docs/algorithms/vehicle.md.
//
//     SixDof     u v w p q r, x y z phi theta psi
//     FiveDof    u v w q r,   x y z theta psi       a torpedo whose roll is stiff
//     FourDof    u v p r,     x y phi psi           constant depth: the paper's, with a keel
//     ThreeDof   u v r,       x y psi               the plane
//
// A projection offers kSize, axis(i) (the axis of kept number i) and keeps(axis).
#pragma once

#include <cstdint>

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Body axes: x forward, y to starboard, z down, and the rotations about them.
enum Axis : std::uint8_t { kSurge, kSway, kHeave, kRoll, kPitch, kYaw };

struct SixDof {
  static constexpr int kSize = 6;
  static constexpr int axis(int i) { return i; }
  static constexpr bool keeps(int) { return true; }
};

struct FiveDof {
  static constexpr int kSize = 5;
  static constexpr int axis(int i) { return i < 3 ? i : i + 1; }
  static constexpr bool keeps(int axis) { return axis != kRoll; }
};

struct FourDof {
  static constexpr int kSize = 4;
  static constexpr int axis(int i) { return i < 2 ? i : 2 * i - 1; }
  static constexpr bool keeps(int axis) { return axis != kHeave && axis != kPitch; }
};

struct ThreeDof {
  static constexpr int kSize = 3;
  static constexpr int axis(int i) { return i < 2 ? i : 5; }
  static constexpr bool keeps(int axis) { return axis < kHeave || axis == kYaw; }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
