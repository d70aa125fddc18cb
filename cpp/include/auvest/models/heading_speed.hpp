// What compass, log and sway log say together: psi, u, v of a state that begins with [x, y, psi, u,
// v], the velocities through the water in the vehicle's axes.
//
//     z = (psi, u, v) + e,   var e = sigma^2 each,   the difference of the headings wrapped
//
// An instrument that is not there has a sigma so large that nothing is believed of it. A bias of
// the compass is no noise: what it is known to is part of sigma.
#pragma once

#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/models/measurement_model.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Whatever the number of states.
template <class Scalar>
struct HeadingSpeedParams {
  Scalar sigma_heading_rad = Scalar(0.0174533);  ///< 1 deg
  Scalar sigma_forward_m_s = Scalar(0.05);
  Scalar sigma_starboard_m_s = Scalar(0.05);

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("sigma_heading_rad", sigma_heading_rad);
    v("sigma_forward_m_s", sigma_forward_m_s);
    v("sigma_starboard_m_s", sigma_starboard_m_s);
  }
};

template <class Scalar_, int N>
struct HeadingSpeed : MeasurementModel<HeadingSpeed<Scalar_, N>, Scalar_, N, 3, 5> {
  using Base = MeasurementModel<HeadingSpeed<Scalar_, N>, Scalar_, N, 3, 5>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;
  static constexpr bool kClosedForm = true;

  using Params = HeadingSpeedParams<Scalar>;

  Params params;

  explicit HeadingSpeed(const Params& p = Params()) : params(p) {}

  struct Expansion {
    Measurement centre;

    const Measurement& value() const { return centre; }

    Jacobian H() const {
      Jacobian jacobian;
      math::set_zero(jacobian);
      for (int i = 0; i < 3; ++i) jacobian(i, i + 2) = Scalar(1);
      return jacobian;
    }

    AUVEST_INLINE void deviations(const ObservedState& e, Measurement& sum,
                                  Measurement& difference) const {
      for (int i = 0; i < 3; ++i) {
        sum(i) = Scalar(0);
        difference(i) = e(i + 2) + e(i + 2);
      }
    }
  };

  AUVEST_INLINE Expansion about(const State& x) const {
    Expansion point;
    for (int i = 0; i < 3; ++i) point.centre(i) = x(i + 2);
    return point;
  }

  Measurement h(const State& x) const { return about(x).centre; }
  Jacobian H(const State& x) const { return about(x).H(); }

  Measurement residual(const Measurement& z, const Measurement& predicted) const {
    Measurement difference = Base::residual(z, predicted);
    difference(0) = math::wrap(difference(0));
    return difference;
  }

  Noise R() const {
    const Scalar sigmas[] = {params.sigma_heading_rad, params.sigma_forward_m_s,
                             params.sigma_starboard_m_s};
    Noise noise;
    math::set_zero(noise);
    for (int i = 0; i < 3; ++i) noise(i, i) = sigmas[i] * sigmas[i];
    return noise;
  }

  Status check() const {
    const bool valid = math::is_positive(params.sigma_heading_rad) &&
                       math::is_positive(params.sigma_forward_m_s) &&
                       math::is_positive(params.sigma_starboard_m_s);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
