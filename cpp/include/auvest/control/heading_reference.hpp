// From the heading that guidance asks for to one that the vehicle can follow: of first order, with
// a limited rate, [CONTROL 2],
//
//     r_d = clip(kappa U + k ssa(psi_ref - psi_d), +- r_max),   d psi_d/dt = r_d,
//
// ssa the smallest signed angle: from 350 to 10 degrees it turns by 20. psi_d is moved first and
// r_d formed again from where it then is.
#pragma once

#include "auvest/control/reference.hpp"
#include "auvest/guidance/guidance_law.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {

template <class Scalar_>
class HeadingReference {
 public:
  using Scalar = Scalar_;

  struct Params {
    Scalar gain = Scalar(1);  ///< k [1/s], > 0
    Scalar max_rate_rad_s =
        Scalar(0.10471975511965978);  ///< r_max, > 0; 6 deg/s: what a torpedo can turn

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("gain", gain);
      v("max_rate_rad_s", max_rate_rad_s);
    }
  };

  explicit HeadingReference(const Params& params = Params())
      : params_(params),
        check_(valid(params) ? Status::kOk : Status::kBadParameter),
        heading_(Scalar(0)) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// Begins at this heading [rad], the vehicle's own.
  Status restart(Scalar heading_rad) {
    if (!math::is_finite(heading_rad)) return Status::kNotFinite;
    heading_ = math::wrap(heading_rad);
    return Status::kOk;
  }

  /// The reference dt seconds on. On anything but kOk nothing has changed.
  Status update(const GuidanceCommand<Scalar>& wanted, Scalar dt, Reference<Scalar>& reference) {
    const Status status = propose(wanted, dt, reference);
    if (status == Status::kOk) accept(reference);
    return status;
  }

  /// The same without going there: accept(reference) does.
  Status propose(const GuidanceCommand<Scalar>& wanted, Scalar dt,
                 Reference<Scalar>& reference) const {
    if (check_ != Status::kOk) return check_;
    if (!math::is_finite(wanted.heading_rad) || !math::is_finite(wanted.rate_rad_s) ||
        !math::is_finite(dt)) {
      return Status::kNotFinite;
    }
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const Scalar heading = math::wrap(heading_ + dt * rate(wanted, heading_));
    if (!math::is_finite(heading)) return Status::kOverflow;
    reference.value = heading;
    reference.rate = rate(wanted, heading);
    reference.acceleration = Scalar(0);  // jumps with r_d: of no use to a rudder
    return Status::kOk;
  }
  void accept(const Reference<Scalar>& reference) { heading_ = reference.value; }

  Scalar heading_rad() const { return heading_; }  ///< psi_d
  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return math::is_positive(p.gain) && math::is_positive(p.max_rate_rad_s);
  }

  Scalar rate(const GuidanceCommand<Scalar>& wanted, Scalar from) const {
    const Scalar error = math::wrap(wanted.heading_rad - from);
    const Scalar most = params_.max_rate_rad_s;
    return math::clamp(wanted.rate_rad_s + params_.gain * error, -most, most);  // [CONTROL 2]
  }

  Params params_;
  Status check_;
  Scalar heading_;
};

}  // namespace auvest
