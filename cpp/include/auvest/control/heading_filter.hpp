// The heading from gyro and compass: a complementary filter, [CONTROL 12],
//
//     psi_f <- psi_f + dt r_m,   psi_f <- psi_f + share ssa(psi_m - psi_f).
//
// The gyro gives the quick part and the compass the slow one: with share 0.05 every 0.1 s the
// crossover is at 0.5 rad/s. A rudder that follows it travels less, at the same error. Without a
// compass the gyro carries it on.
//
//     auvest::HeadingFilter<float> heading;
//     heading.restart(compass);                        // once
//     heading.predict(gyro, 0.1f);                     // each period
//     heading.update(compass);                         // where there is a reading
#pragma once

#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class HeadingFilter {
 public:
  using Scalar = Scalar_;

  struct Params {
    Scalar share = Scalar(0.05);  ///< of the compass per reading, within 0 and 1

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("share", share);
    }
  };

  explicit HeadingFilter(const Params& params = Params())
      : params_(params),
        check_(valid(params) ? Status::kOk : Status::kBadParameter),
        heading_(Scalar(0)),
        initialised_(false) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// Begins at this heading [rad].
  Status restart(Scalar heading_rad) {
    if (check_ != Status::kOk) return check_;
    if (!math::is_finite(heading_rad)) return Status::kNotFinite;
    heading_ = math::wrap(heading_rad);
    initialised_ = true;
    return Status::kOk;
  }

  /// Turns on for dt seconds at the gyro's rate [rad/s].
  Status predict(Scalar rate_rad_s, Scalar dt) {
    if (!initialised_) return Status::kNotInitialised;
    if (!math::is_finite(rate_rad_s) || !math::is_finite(dt)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const Scalar turned = math::wrap(heading_ + dt * rate_rad_s);  // [CONTROL 12]
    if (!math::is_finite(turned)) return Status::kOverflow;
    heading_ = turned;
    return Status::kOk;
  }

  /// Corrects by a reading of the compass [rad].
  Status update(Scalar compass_rad) {
    if (!initialised_) return Status::kNotInitialised;
    if (!math::is_finite(compass_rad)) return Status::kNotFinite;
    // [CONTROL 12]
    heading_ = math::wrap(heading_ + params_.share * math::wrap(compass_rad - heading_));
    return Status::kOk;
  }

  Scalar heading_rad() const { return heading_; }  ///< psi_f, in (-pi, pi]
  bool initialised() const { return initialised_; }
  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) { return math::within(p.share, Scalar(0), Scalar(1)); }

  Params params_;
  Status check_;
  Scalar heading_;
  bool initialised_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
