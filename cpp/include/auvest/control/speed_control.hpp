// Speed through the water by propeller: PI with feed-forward, [CONTROL 8],
//
//     n = U / c + Kp (U - u) + Ki int (U - u),   within 0 and n_max,
//
// c the advance per revolution where thrust equals drag.
#pragma once

#include "auvest/control/integrator.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {

template <class Scalar_>
class SpeedControl {
 public:
  using Scalar = Scalar_;

  struct Params {
    /// c [m/rev], > 0; of the torpedo `remus100`, 0.09994 rounded: the integral takes the rest
    Scalar advance_m = Scalar(0.1);
    Scalar proportional = Scalar(5);                ///< Kp [rev/s per m/s], >= 0
    Scalar integral = Scalar(1);                    ///< Ki [rev/s per m], >= 0
    Scalar max_rev_s = Scalar(25.416666666666668);  ///< n_max, > 0; 1525 rpm

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("advance_m", advance_m);
      v("proportional", proportional);
      v("integral", integral);
      v("max_rev_s", max_rev_s);
    }
  };

  explicit SpeedControl(const Params& params = Params())
      : params_(params),
        check_(valid(params) ? Status::kOk : Status::kBadParameter),
        saturated_(false) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// Revolutions per second for the wanted speed from the measured one, both through the water
  /// [m/s]. On anything but kOk nothing has changed, the command neither.
  Status update(Scalar wanted_m_s, Scalar speed_m_s, Scalar dt, Scalar& rev_s) {
    if (check_ != Status::kOk) return check_;
    if (!math::is_finite(wanted_m_s) || !math::is_finite(speed_m_s) || !math::is_finite(dt)) {
      return Status::kNotFinite;
    }
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const Scalar error = wanted_m_s - speed_m_s;
    // [CONTROL 8]
    const Scalar wished = wanted_m_s / params_.advance_m + params_.proportional * error +
                          params_.integral * integral_.value();
    if (!math::is_finite(wished)) return Status::kOverflow;
    rev_s = math::clamp(wished, Scalar(0), params_.max_rev_s);
    const Scalar excess = wished - rev_s;
    saturated_ = excess < Scalar(0) || excess > Scalar(0);
    integral_.add(error, dt, excess);
    return Status::kOk;
  }

  bool saturated() const { return saturated_; }          ///< in the last update
  Scalar integral() const { return integral_.value(); }  ///< int (U - u) [m]
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
    return math::is_positive(p.advance_m) && math::is_nonnegative(p.proportional) &&
           math::is_nonnegative(p.integral) && math::is_positive(p.max_rev_s);
  }

  Params params_;
  Status check_;
  Integrator<Scalar> integral_;
  bool saturated_;
};

}  // namespace auvest
