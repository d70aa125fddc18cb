// The vertical half of ALOS in space (Fossen 2023): the pitch that follows a line up or down,
// [GUIDE 11] and [GUIDE 12],
//
//     theta_d = pi_v + a + atan(z_e / Delta_v),   da/dt = gamma_v Delta_v z_e / sqrt(Delta_v^2 +
//     z_e^2),
//
// pi_v the line's angle upwards, z_e the distance below it, a the angle of attack that is found on
// the way.
#pragma once

#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class VerticalLineOfSight {
 public:
  using Scalar = Scalar_;

  struct Params {
    Scalar lookahead_m = Scalar(10);    ///< Delta_v, > 0
    Scalar adaptation = Scalar(0.008);  ///< gamma_v [rad/(m s)], >= 0
    Scalar limit_rad = Scalar(0.5);     ///< of |a|, >= 0

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("lookahead_m", lookahead_m);
      v("adaptation", adaptation);
      v("limit_rad", limit_rad);
    }
  };

  explicit VerticalLineOfSight(const Params& params = Params())
      : params_(params),
        check_(valid(params) ? Status::kOk : Status::kBadParameter),
        attack_(Scalar(0)) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// The pitch to steer [rad] on a line that climbs by `climb_rad`, `below_m` under it. On anything
  /// but kOk nothing has changed.
  Status update(Scalar climb_rad, Scalar below_m, Scalar dt, Scalar& pitch_rad) {
    if (check_ != Status::kOk) return check_;
    if (!math::is_finite(climb_rad) || !math::is_finite(below_m) || !math::is_finite(dt)) {
      return Status::kNotFinite;
    }
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const Scalar delta = params_.lookahead_m;
    pitch_rad = math::wrap(climb_rad + attack_ + math::atan2(below_m, delta));  // [GUIDE 11]
    const Scalar distance = math::sqrt(delta * delta + below_m * below_m);
    // [GUIDE 12]
    attack_ = limited(attack_ + dt * (params_.adaptation * delta * (below_m / distance)));
    return Status::kOk;
  }

  Scalar attack_rad() const { return attack_; }  ///< a
  /// Goes on with this angle, limited; what is not a number is refused.
  Status restart(Scalar attack_rad = Scalar(0)) {
    if (!math::is_finite(attack_rad)) return Status::kNotFinite;
    attack_ = limited(attack_rad);
    return Status::kOk;
  }
  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return math::is_positive(p.lookahead_m) && math::is_nonnegative(p.adaptation) &&
           math::is_nonnegative(p.limit_rad);
  }

  Scalar limited(Scalar attack) const {
    return math::clamp(attack, -params_.limit_rad, params_.limit_rad);
  }

  Params params_;
  Status check_;
  Scalar attack_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
