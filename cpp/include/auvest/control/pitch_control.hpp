// Pitch by stern planes: PID, [CONTROL 10],
//
//     ds = Kp (theta - theta_d) + Kd q + Ki int (theta - theta_d),   |ds| <= ds_max,
//
// a positive stern plane turns the nose down. The derivative acts on the pitch rate.
#pragma once

#include "auvest/control/integrating_control.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class PitchControl : public IntegratingControl<Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = IntegratingControl<Scalar>;
  using typename Base::Step;

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

  explicit PitchControl(const Params& params = Params()) : Base(valid(params)), params_(params) {}

  /// The stern plane [rad] for the wanted pitch, from pitch [rad] and pitch rate [rad/s]. On
  /// anything but kOk nothing has changed, the plane neither.
  Status update(Scalar wanted_rad, Scalar pitch_rad, Scalar rate_rad_s, Scalar dt,
                Scalar& plane_rad) {
    Step step;
    return this->take(propose(wanted_rad, pitch_rad, rate_rad_s, dt, step), step, plane_rad);
  }

  /// The same step without taking it: accept(step) does.
  Status propose(Scalar wanted_rad, Scalar pitch_rad, Scalar rate_rad_s, Scalar dt,
                 Step& step) const {
    const Status status = this->admit(dt, wanted_rad, pitch_rad, rate_rad_s);
    if (status != Status::kOk) return status;
    const Scalar error = math::wrap(pitch_rad - wanted_rad);
    // [CONTROL 10]
    const Scalar wished = params_.proportional * error + params_.derivative * rate_rad_s +
                          params_.integral * this->integral();
    return this->limit(wished, -params_.max_plane_rad, params_.max_plane_rad, error, true, dt,
                       step);
  }

  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return math::is_nonnegative(p.proportional) && math::is_nonnegative(p.derivative) &&
           math::is_nonnegative(p.integral) && math::is_positive(p.max_plane_rad);
  }

  Params params_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
