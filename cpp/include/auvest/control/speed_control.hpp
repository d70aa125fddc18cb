// Speed through the water by propeller: PI with feed-forward, [CONTROL 8],
//
//     n = U / c + Kp (U - u) + Ki int (U - u),   within 0 and n_max,
//
// c the advance per revolution where thrust equals drag.
#pragma once

#include "auvest/control/integrating_control.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class SpeedControl : public IntegratingControl<Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = IntegratingControl<Scalar>;
  using typename Base::Step;

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
      : Base(valid(params)), params_(params), wanted_(Scalar(0)), feed_(Scalar(0)) {}

  /// Revolutions per second for the wanted speed from the measured one, both through the water
  /// [m/s]. On anything but kOk nothing has changed, the command neither.
  Status update(Scalar wanted_m_s, Scalar speed_m_s, Scalar dt, Scalar& rev_s) {
    Step step;
    return this->take(propose(wanted_m_s, speed_m_s, dt, step), step, rev_s);
  }

  /// The same step without taking it: accept(step) does.
  Status propose(Scalar wanted_m_s, Scalar speed_m_s, Scalar dt, Step& step) {
    const Status status = this->admit(dt, wanted_m_s, speed_m_s);
    if (status != Status::kOk) return status;
    const Scalar error = wanted_m_s - speed_m_s;
    if (wanted_m_s != wanted_) {
      feed_ = wanted_m_s / params_.advance_m;
      wanted_ = wanted_m_s;
    }
    // [CONTROL 8]
    const Scalar wished =
        feed_ + params_.proportional * error + params_.integral * this->integral();
    return this->limit(wished, Scalar(0), params_.max_rev_s, error, true, dt, step);
  }

  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return math::is_positive(p.advance_m) && math::is_nonnegative(p.proportional) &&
           math::is_nonnegative(p.integral) && math::is_positive(p.max_rev_s);
  }

  Params params_;
  Scalar wanted_;  // for which
  Scalar feed_;    // is U / c: it rarely changes, and a chip divides slowly
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
