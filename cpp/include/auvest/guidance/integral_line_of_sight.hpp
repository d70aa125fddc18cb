// Integral line of sight (Borhaug, Pavlov and Pettersen 2008): a heading that also cancels the
// drift by a constant current, [GUIDE 7] and [GUIDE 8],
//
//     psi_d = pi_h - atan((e + k ei) / Delta),   d ei/dt = Delta e / (Delta^2 + (e + k ei)^2).
//
// The integral cannot run away far from the path, where its rate falls with 1/e. In the steady
// state k ei = Delta tan(crab angle).
#pragma once

#include "auvest/guidance/guidance_law.hpp"
#include "auvest/math/trigonometry.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class IntegralLineOfSight : public GuidanceLaw<IntegralLineOfSight<Scalar_>, Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = GuidanceLaw<IntegralLineOfSight<Scalar_>, Scalar_>;

  struct Params {
    Scalar lookahead_m = Scalar(10);  ///< Delta, > 0
    Scalar gain_m_s = Scalar(0.5);    ///< k, > 0; below the ground speed, or the loop is not stable

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("lookahead_m", lookahead_m);
      v("gain_m_s", gain_m_s);
    }
  };

  explicit IntegralLineOfSight(const Params& params = Params())
      : Base(math::is_positive(params.lookahead_m) && math::is_positive(params.gain_m_s)),
        params_(params),
        integral_(Scalar(0)) {}

  Scalar heading(const PathPoint<Scalar>& point, Scalar) const {
    return point.direction_rad - math::atan2(shifted(point), params_.lookahead_m);  // [GUIDE 7]
  }

  /// ei [s]: k is a speed.
  Scalar integral() const { return integral_; }
  /// Goes on with this integral; what is not a number is refused.
  Status restart(Scalar integral = Scalar(0)) {
    if (!math::is_finite(integral)) return Status::kNotFinite;
    integral_ = integral;
    return Status::kOk;
  }
  const Params& params() const { return params_; }

 private:
  friend Base;

  Scalar shifted(const PathPoint<Scalar>& point) const {
    return point.cross_m + params_.gain_m_s * integral_;
  }

  void adapt(const PathPoint<Scalar>& point, Scalar dt) {
    const Scalar delta = params_.lookahead_m;
    const Scalar aim = shifted(point);
    const Scalar rate = delta * (point.cross_m / (delta * delta + aim * aim));  // [GUIDE 8]
    integral_ = integral_ + dt * rate;
  }

  Params params_;
  Scalar integral_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
