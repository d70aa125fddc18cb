// What the filters of this folder are given: echoes, and what the masters planned.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The master of an echo of which nobody knows whose it is.
constexpr int kUnknownMaster = -1;

/// One measurement of the sonar: range [m] and bearing [rad], and the master that it belongs to.
template <class Scalar>
struct Echo {
  Vector<Scalar, 2> z;
  int master;
};

/// kOk if an update by `count` echoes of `masters` masters is possible: finite, of ranges that the
/// sonar can measure, each master at most once, no more echoes than masters, and no sigma so large
/// that its square leaves no room for sums.
template <class Scalar>
inline Status check_echoes(const Echo<Scalar>* echoes, int count, int masters,
                           const Sonar<Scalar>& sonar, int pose_states) {
  if (count < 0 || count > masters || sonar.check(pose_states) != Status::kOk)
    return Status::kBadParameter;
  if (sonar.params.sigma_range_m > Scalar(1e15) || sonar.params.sigma_bearing_rad > Scalar(1e6)) {
    return Status::kOverflow;
  }
  for (int s = 0; s < count; ++s) {
    if (!math::all_finite(echoes[s].z)) return Status::kNotFinite;
    const int master = echoes[s].master;
    const bool unknown = master == kUnknownMaster;
    if (!unknown && (master < 0 || master >= masters)) return Status::kBadParameter;
    for (int earlier = 0; earlier < s; ++earlier) {
      if (!unknown && echoes[earlier].master == master) return Status::kBadParameter;
    }
    for (int k = 0; k < 2; ++k) {
      const Scalar z = echoes[s].z(k);
      if (z > Scalar(1e9) || z < Scalar(-1e9)) return Status::kOverflow;
    }
    const Status admitted = sonar.params.admits(echoes[s].z(0));
    if (admitted != Status::kOk) return admitted;
  }
  return Status::kOk;
}

/// True if the masters' planned velocity changes are finite, or none are given.
template <class Scalar>
inline bool plan_finite(const Vector<Scalar, 2>* changes, int masters) {
  for (int n = 0; changes != nullptr && n < masters; ++n) {
    if (!math::all_finite(changes[n])) return false;
  }
  return true;
}

/// E u of [SLATF 4]: the velocity change [m/s], spread evenly over dt, on [x, y, vx, vy, ...].
template <class Value, class Scalar>
AUVEST_INLINE void add_planned_change(const Vector<Scalar, 2>& change, Scalar dt,
                                      Vector<Value, 6>& x) {
  AUVEST_UNROLL
  for (int axis = 0; axis < 2; ++axis) {
    // [SLATF 4]
    x(axis) = x(axis) + Scalar(0.5) * dt * change(axis);
    x(2 + axis) = x(2 + axis) + change(axis);
  }
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
