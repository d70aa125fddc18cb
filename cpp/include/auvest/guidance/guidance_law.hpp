// What every guidance law offers: from where the vehicle is beside its path, the heading to steer.
//
// A law derives from GuidanceLaw<Itself, Scalar> and offers
//
//     Scalar heading(point, speed) const   the heading wanted [rad], any turns
//     void adapt(point, dt)                its memory dt seconds on; it may be empty
//
// The base refuses what is not a number before anything has changed. The order in a step is: the
// heading with the memory as it is, then the memory.
//
//     auvest::Waypoints<float> path;                   // plan and law, once
//     auvest::AdaptiveLineOfSight<float> law;
//     auvest::PathPoint<float> point;                  // each period of 0.1 s:
//     auvest::GuidanceCommand<float> command;
//     if (path.locate(x, y, point) == auvest::Status::kOk) {
//       law.update(point, 1.5f, 0.1f, command);        // steer command.heading_rad
//     }
#pragma once

#include "auvest/guidance/path_point.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// What to steer.
template <class Scalar>
struct GuidanceCommand {
  Scalar heading_rad = Scalar(0);  ///< psi_ref, in (-pi, pi]; a course where the law says so
  Scalar rate_rad_s = Scalar(0);  ///< feed-forward kappa U: the yaw rate that follows a curved path
};

template <class Derived, class Scalar_>
class GuidanceLaw {
 public:
  using Scalar = Scalar_;

  /// What to steer at this point of the path. `speed_m_s` is U >= 0, the wanted speed through the
  /// water; dt the time to the next call [s]. On anything but kOk nothing has changed, the command
  /// neither.
  Status update(const PathPoint<Scalar>& point, Scalar speed_m_s, Scalar dt,
                GuidanceCommand<Scalar>& command) {
    if (check_ != Status::kOk) return check_;
    if (!math::is_finite(point.cross_m) || !math::is_finite(point.direction_rad) ||
        !math::is_finite(point.curvature) || !math::is_finite(speed_m_s) || !math::is_finite(dt)) {
      return Status::kNotFinite;
    }
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    if (speed_m_s < Scalar(0)) return Status::kBadParameter;
    const Scalar heading = math::wrap(derived().heading(point, speed_m_s));
    const Scalar rate = point.curvature * speed_m_s;  // [GUIDE 5]
    if (!math::is_finite(heading) || !math::is_finite(rate)) return Status::kOverflow;
    derived().adapt(point, dt);
    command.heading_rad = heading;
    command.rate_rad_s = rate;
    return Status::kOk;
  }

  /// kBadParameter if a parameter is out of range: no update then.
  Status check() const { return check_; }

 protected:
  explicit GuidanceLaw(bool valid) : check_(valid ? Status::kOk : Status::kBadParameter) {}

  void adapt(const PathPoint<Scalar>&, Scalar) {}

 private:
  Derived& derived() { return static_cast<Derived&>(*this); }

  Status check_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
