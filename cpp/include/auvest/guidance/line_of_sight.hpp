// Line-of-sight guidance with look-ahead, [GUIDE 6]: aim at the point of the path Delta ahead,
//
//     chi_d = pi_h - atan(e / Delta).
//
// What it gives is a *course*. Steered as a heading, it leaves a constant error in a current:
// Delta tan(crab angle). The other laws of this folder take the crab angle out.
#pragma once

#include "auvest/guidance/guidance_law.hpp"
#include "auvest/math/trigonometry.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class LineOfSight : public GuidanceLaw<LineOfSight<Scalar_>, Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = GuidanceLaw<LineOfSight<Scalar_>, Scalar_>;

  struct Params {
    Scalar lookahead_m = Scalar(10);  ///< Delta, > 0: six lengths of a torpedo

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("lookahead_m", lookahead_m);
    }
  };

  explicit LineOfSight(const Params& params = Params())
      : Base(math::is_positive(params.lookahead_m)), params_(params) {}

  Scalar heading(const PathPoint<Scalar>& point, Scalar) const {
    return point.direction_rad - math::atan2(point.cross_m, params_.lookahead_m);  // [GUIDE 6]
  }

  const Params& params() const { return params_; }

 private:
  friend Base;
  Params params_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
