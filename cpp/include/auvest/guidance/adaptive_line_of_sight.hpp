// Adaptive line of sight, ALOS (Fossen 2023): the crab angle b is estimated and taken off,
// [GUIDE 9] and [GUIDE 10],
//
//     psi_d = pi_h - b - atan(e / Delta),   db/dt = gamma Delta e / sqrt(Delta^2 + e^2).
//
// Near the line at ground speed U this is of second order: frequency w = sqrt(U gamma), damping
// zeta = (U / Delta) / (2 w). Choose zeta within 0.6 and 1: the defaults give 0.68 at 1.5 m/s.
// After a corner, and along a curve, the crab angle is another one and has to be found again: where
// the current is known, CrabFeedForward has nothing to find.
#pragma once

#include "auvest/guidance/guidance_law.hpp"
#include "auvest/math/trigonometry.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class AdaptiveLineOfSight : public GuidanceLaw<AdaptiveLineOfSight<Scalar_>, Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = GuidanceLaw<AdaptiveLineOfSight<Scalar_>, Scalar_>;

  struct Params {
    Scalar lookahead_m = Scalar(10);    ///< Delta, > 0
    Scalar adaptation = Scalar(0.008);  ///< gamma [rad/(m s)], >= 0
    Scalar limit_rad = Scalar(0.5);     ///< of |b|, >= 0: a current of half the vehicle's speed

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("lookahead_m", lookahead_m);
      v("adaptation", adaptation);
      v("limit_rad", limit_rad);
    }
  };

  explicit AdaptiveLineOfSight(const Params& params = Params())
      : Base(math::is_positive(params.lookahead_m) && math::is_nonnegative(params.adaptation) &&
             math::is_nonnegative(params.limit_rad)),
        params_(params),
        crab_(Scalar(0)) {}

  Scalar heading(const PathPoint<Scalar>& point, Scalar) const {
    // [GUIDE 9]
    return point.direction_rad - crab_ - math::atan2(point.cross_m, params_.lookahead_m);
  }

  /// b: how far the course lies to starboard of the heading [rad].
  Scalar crab_rad() const { return crab_; }
  /// Goes on with this crab angle, limited; what is not a number is refused.
  Status restart(Scalar crab_rad = Scalar(0)) {
    if (!math::is_finite(crab_rad)) return Status::kNotFinite;
    crab_ = limited(crab_rad);
    return Status::kOk;
  }
  const Params& params() const { return params_; }

 private:
  friend Base;

  void adapt(const PathPoint<Scalar>& point, Scalar dt) {
    const Scalar delta = params_.lookahead_m;
    const Scalar distance = math::sqrt(delta * delta + point.cross_m * point.cross_m);
    // [GUIDE 10]
    crab_ = limited(crab_ + dt * (params_.adaptation * delta * (point.cross_m / distance)));
  }

  Scalar limited(Scalar crab) const {
    return math::clamp(crab, -params_.limit_rad, params_.limit_rad);
  }

  Params params_;
  Scalar crab_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
