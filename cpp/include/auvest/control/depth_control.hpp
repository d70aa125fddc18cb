// Depth by pitch: the outer loop of a torpedo, [CONTROL 9],
//
//     theta_d = Kp (z - z_d) + Ki int (z - z_d),   |theta_d| <= theta_max,
//
// z down: deeper than wanted gives nose up. PitchControl flies theta_d.
#pragma once

#include "auvest/control/integrating_control.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class DepthControl : public IntegratingControl<Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = IntegratingControl<Scalar>;
  using typename Base::Step;

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

  explicit DepthControl(const Params& params = Params()) : Base(valid(params)), params_(params) {}

  /// The pitch [rad] for the wanted depth from the measured one [m, down]. On anything but kOk
  /// nothing has changed, the pitch neither.
  Status update(Scalar wanted_m, Scalar depth_m, Scalar dt, Scalar& pitch_rad) {
    Step step;
    return this->take(propose(wanted_m, depth_m, dt, step), step, pitch_rad);
  }

  /// The same step without taking it: accept(step) does.
  Status propose(Scalar wanted_m, Scalar depth_m, Scalar dt, Step& step) const {
    const Status status = this->admit(dt, wanted_m, depth_m);
    if (status != Status::kOk) return status;
    const Scalar error = depth_m - wanted_m;
    // [CONTROL 9]
    const Scalar wished = params_.proportional * error + params_.integral * this->integral();
    return this->limit(wished, -params_.max_pitch_rad, params_.max_pitch_rad, error, true, dt,
                       step);
  }

  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return math::is_nonnegative(p.proportional) && math::is_nonnegative(p.integral) &&
           math::is_positive(p.max_pitch_rad);
  }

  Params params_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
