// Depth by pitch: the outer loop of a torpedo, [CONTROL 9],
//
//     theta_d = Kp (z - z_d) + Ki int (z - z_d),   |theta_d| <= theta_max,
//
// z down: deeper than wanted gives nose up. PitchControl flies theta_d.
#pragma once

#include "auvest/control/integrator.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {

template <class Scalar_>
class DepthControl {
 public:
  using Scalar = Scalar_;

  struct Params {
    Scalar proportional = Scalar(0.1);                  ///< Kp [rad/m], >= 0
    Scalar integral = Scalar(0.005);                    ///< Ki [rad/(m s)], >= 0
    Scalar max_pitch_rad = Scalar(0.3490658503988659);  ///< theta_max, > 0; 20 deg

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("proportional", proportional);
      v("integral", integral);
      v("max_pitch_rad", max_pitch_rad);
    }
  };

  explicit DepthControl(const Params& params = Params())
      : params_(params),
        check_(valid(params) ? Status::kOk : Status::kBadParameter),
        saturated_(false) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// The pitch [rad] for the wanted depth from the measured one [m, down]. On anything but kOk
  /// nothing has changed, the pitch neither.
  Status update(Scalar wanted_m, Scalar depth_m, Scalar dt, Scalar& pitch_rad) {
    if (check_ != Status::kOk) return check_;
    if (!math::is_finite(wanted_m) || !math::is_finite(depth_m) || !math::is_finite(dt)) {
      return Status::kNotFinite;
    }
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const Scalar error = depth_m - wanted_m;
    // [CONTROL 9]
    const Scalar wished = params_.proportional * error + params_.integral * integral_.value();
    if (!math::is_finite(wished)) return Status::kOverflow;
    pitch_rad = math::clamp(wished, -params_.max_pitch_rad, params_.max_pitch_rad);
    const Scalar excess = wished - pitch_rad;
    saturated_ = excess < Scalar(0) || excess > Scalar(0);
    integral_.add(error, dt, excess);
    return Status::kOk;
  }

  bool saturated() const { return saturated_; }          ///< in the last update
  Scalar integral() const { return integral_.value(); }  ///< int (z - z_d) [m s]
  /// Goes on with this integral; what is not a number is refused.
  Status restart(Scalar integral = Scalar(0)) {
    if (!math::is_finite(integral)) return Status::kNotFinite;
    integral_.restart(integral);
    saturated_ = false;
    return Status::kOk;
  }
  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return math::is_nonnegative(p.proportional) && math::is_nonnegative(p.integral) &&
           math::is_positive(p.max_pitch_rad);
  }

  Params params_;
  Status check_;
  Integrator<Scalar> integral_;
  bool saturated_;
};

}  // namespace auvest
