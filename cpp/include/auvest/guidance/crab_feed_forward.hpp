// Line of sight with the crab angle fed forward from a known current, [GUIDE 13],
//
//     psi_d = pi_h - asin(Vc_n / U) - atan(e / Delta),   Vc_n = -Vc_x sin pi_h + Vc_y cos pi_h,
//
// Vc_n the current across the path, the ratio limited. The best law on curves and after corners,
// because it adapts nothing: a filter with the current in its state (SpeedHeadingCurrent) feeds it.
#pragma once

#include "auvest/guidance/guidance_law.hpp"
#include "auvest/math/trigonometry.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class CrabFeedForward : public GuidanceLaw<CrabFeedForward<Scalar_>, Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = GuidanceLaw<CrabFeedForward<Scalar_>, Scalar_>;

  struct Params {
    Scalar lookahead_m = Scalar(10);  ///< Delta, > 0
    Scalar limit = Scalar(0.9);       ///< of |Vc_n / U|, within 0 and 1: beyond, the path is lost

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("lookahead_m", lookahead_m);
      v("limit", limit);
    }
  };

  explicit CrabFeedForward(const Params& params = Params())
      : Base(math::is_positive(params.lookahead_m) &&
             math::within(params.limit, Scalar(0), Scalar(1))),
        params_(params),
        current_x_(Scalar(0)),
        current_y_(Scalar(0)) {}

  /// The current as it is known now, north and east [m/s]. What is not a number is refused, and the
  /// one before stays.
  Status set_current(Scalar x_m_s, Scalar y_m_s) {
    if (!math::is_finite(x_m_s) || !math::is_finite(y_m_s)) return Status::kNotFinite;
    current_x_ = x_m_s;
    current_y_ = y_m_s;
    return Status::kOk;
  }

  Scalar heading(const PathPoint<Scalar>& point, Scalar speed_m_s) const {
    const Scalar across = current_y_ * point.cosine - current_x_ * point.sine;
    const Scalar sine = ratio(across, speed_m_s);
    const Scalar crab = math::atan2(sine, math::sqrt(Scalar(1) - sine * sine));
    // [GUIDE 13]
    return point.direction_rad - crab - math::atan2(point.cross_m, params_.lookahead_m);
  }

  const Params& params() const { return params_; }

 private:
  friend Base;

  /// across / speed within the limit; without any speed, the limit or 0.
  Scalar ratio(Scalar across, Scalar speed) const {
    const Scalar size = math::absolute(across);
    if (size < params_.limit * speed) return across / speed;
    return size > Scalar(0) ? math::copy_sign(params_.limit, across) : Scalar(0);
  }

  Params params_;
  Scalar current_x_, current_y_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
