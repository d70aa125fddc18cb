// Pitch by stern planes: PID, [CONTROL 10],
//
//     ds = Kp (theta - theta_d) + Kd q + Ki int (theta - theta_d),   |ds| <= ds_max,
//
// a positive stern plane turns the nose down. The derivative acts on the pitch rate.
#pragma once

#include "auvest/control/integrator.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {

template <class Scalar_>
class PitchControl {
 public:
  using Scalar = Scalar_;

  struct Params {
    Scalar proportional = Scalar(1.5);                  ///< Kp, >= 0
    Scalar derivative = Scalar(1);                      ///< Kd [s], >= 0
    Scalar integral = Scalar(0.2);                      ///< Ki [1/s], >= 0
    Scalar max_plane_rad = Scalar(0.2617993877991494);  ///< ds_max, > 0; 15 deg

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("proportional", proportional);
      v("derivative", derivative);
      v("integral", integral);
      v("max_plane_rad", max_plane_rad);
    }
  };

  explicit PitchControl(const Params& params = Params())
      : params_(params),
        check_(valid(params) ? Status::kOk : Status::kBadParameter),
        saturated_(false) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// The stern plane [rad] for the wanted pitch, from pitch [rad] and pitch rate [rad/s]. On
  /// anything but kOk nothing has changed, the plane neither.
  Status update(Scalar wanted_rad, Scalar pitch_rad, Scalar rate_rad_s, Scalar dt,
                Scalar& plane_rad) {
    if (check_ != Status::kOk) return check_;
    if (!math::is_finite(wanted_rad) || !math::is_finite(pitch_rad) ||
        !math::is_finite(rate_rad_s) || !math::is_finite(dt)) {
      return Status::kNotFinite;
    }
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const Scalar error = math::wrap(pitch_rad - wanted_rad);
    // [CONTROL 10]
    const Scalar wished = params_.proportional * error + params_.derivative * rate_rad_s +
                          params_.integral * integral_.value();
    if (!math::is_finite(wished)) return Status::kOverflow;
    plane_rad = math::clamp(wished, -params_.max_plane_rad, params_.max_plane_rad);
    const Scalar excess = wished - plane_rad;
    saturated_ = excess < Scalar(0) || excess > Scalar(0);
    integral_.add(error, dt, excess);
    return Status::kOk;
  }

  bool saturated() const { return saturated_; }          ///< in the last update
  Scalar integral() const { return integral_.value(); }  ///< int (theta - theta_d) [rad s]
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
    return math::is_nonnegative(p.proportional) && math::is_nonnegative(p.derivative) &&
           math::is_nonnegative(p.integral) && math::is_positive(p.max_plane_rad);
  }

  Params params_;
  Status check_;
  Integrator<Scalar> integral_;
  bool saturated_;
};

}  // namespace auvest
