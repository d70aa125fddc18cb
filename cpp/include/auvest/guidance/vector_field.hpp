// Vector-field guidance (Nelson, Barber, McLain and Beard 2007), on lines and circles alike,
// [GUIDE 14],
//
//     chi_d = pi_h - chi_inf (2/pi) atan(k e):
//
// far away the course meets the path at the angle chi_inf, near it k sets how fast it falls in.
// What it gives is a course, as of LineOfSight.
#pragma once

#include "auvest/guidance/guidance_law.hpp"
#include "auvest/math/trigonometry.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class VectorField : public GuidanceLaw<VectorField<Scalar_>, Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = GuidanceLaw<VectorField<Scalar_>, Scalar_>;

  struct Params {
    Scalar approach_rad = Scalar(1.5707963267948966);  ///< chi_inf, in (0, pi/2]
    Scalar gain = Scalar(0.1);                         ///< k [1/m], > 0

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("approach_rad", approach_rad);
      v("gain", gain);
    }
  };

  explicit VectorField(const Params& params = Params())
      : Base(math::is_positive(params.approach_rad) &&
             !(params.approach_rad > math::half_pi<Scalar>()) && math::is_positive(params.gain)),
        params_(params) {}

  Scalar heading(const PathPoint<Scalar>& point, Scalar) const {
    const Scalar two_over_pi = Scalar(0.63661977236758134);
    const Scalar bend = math::atan2(params_.gain * point.cross_m, Scalar(1));
    return point.direction_rad - params_.approach_rad * (two_over_pi * bend);  // [GUIDE 14]
  }

  const Params& params() const { return params_; }

 private:
  friend Base;
  Params params_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
