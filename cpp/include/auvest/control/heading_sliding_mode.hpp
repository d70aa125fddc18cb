// Heading by rudder: integral sliding mode, [CONTROL 6] and [CONTROL 7]. With e = ssa(psi - psi_d),
// e_r = r - r_d,
//
//     s = e_r + 2 l e + l^2 int e,   r_r = r_d - 2 l e - l^2 int e,
//     delta = (T dr_r/dt + r_r - K_d s - K_s sat(s / phi_b)) / K.
//
// On Nomoto's model T ds/dt = -(1 + K_d) s - K_s sat(s / phi_b) + d: from any start s falls into
// the boundary layer |s| < phi_b, and a disturbance |d| < K_s cannot drive it out. On s = 0 the
// error has (d/dt + l)^2 int e = 0; within the layer it has the polynomial
//
//     (T s + 1 + K_d + K_s / phi_b) (s + l)^2.
#pragma once

#include "auvest/control/heading_controller.hpp"
#include "auvest/control/reference.hpp"
#include "auvest/control/steering.hpp"
#include "auvest/math/basic.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class HeadingSlidingMode : public HeadingController<HeadingSlidingMode<Scalar_>, Scalar_> {
 public:
  using Scalar = Scalar_;
  using Base = HeadingController<HeadingSlidingMode<Scalar_>, Scalar_>;

  struct Params : Steering<Scalar> {
    Scalar bandwidth_rad_s = Scalar(0.3);   ///< l, > 0
    Scalar damping = Scalar(0.5);           ///< K_d, >= 0
    Scalar switching_rad_s = Scalar(0.05);  ///< K_s, >= 0
    Scalar boundary_rad_s = Scalar(0.1);    ///< phi_b, > 0: half the layer without chattering

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      Steering<Scalar>::visit(v);
      v("bandwidth_rad_s", bandwidth_rad_s);
      v("damping", damping);
      v("switching_rad_s", switching_rad_s);
      v("boundary_rad_s", boundary_rad_s);
    }
  };

  explicit HeadingSlidingMode(const Params& params = Params())
      : Base(valid(params)), params_(params) {}

  /// The rudder [rad] before its limit; see HeadingController.
  Scalar wished(const Reference<Scalar>& wanted, Scalar error, Scalar slip,
                Scalar speed_m_s) const {
    const Scalar one = Scalar(1);
    const Scalar l = params_.bandwidth_rad_s;
    const Scalar pull = Scalar(2) * l * error + l * l * this->integral();
    const Scalar surface = slip + pull;  // [CONTROL 6]
    const Scalar rate = wanted.rate - pull;
    const Scalar acceleration = wanted.acceleration - Scalar(2) * l * slip - l * l * error;
    const Scalar layer = math::clamp(surface / params_.boundary_rad_s, -one, one);
    // [CONTROL 7]
    return (params_.time_constant_s * acceleration + rate - params_.damping * surface -
            params_.switching_rad_s * layer) /
           params_.gain_at(speed_m_s);
  }

  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return p.valid() && math::is_positive(p.bandwidth_rad_s) && math::is_nonnegative(p.damping) &&
           math::is_nonnegative(p.switching_rad_s) && math::is_positive(p.boundary_rad_s);
  }

  Params params_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
