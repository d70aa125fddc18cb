// Velocity over ground in the axes of the vehicle: a Doppler log (DVL) as a measurement, for states
// [position, velocity, ...] with both in the plane (Axes = 2) or in space (Axes = 3).
//
//     forward  =  cos(th) vx + sin(th) vy + e_f
//     sideways = -sin(th) vx + cos(th) vy + e_s        th: heading, from +x towards +y
//     vertical =  vz + e_v                             (Axes = 3)
//
// Sideways is 90 degrees from forward, from +x towards +y: left (port) where y is to the left of x
// (east and north), starboard where y is to the right of x (north and east). Vertical is counted as
// the state counts z. The measurement must be level, with pitch and roll taken out, as DVLs do it
// on demand ("ship" axes), and that of the point which the state describes: where the vehicle
// turns, a DVL ahead of that point moves sideways.
//
// The heading comes with the measurement, from the compass or gyro that every DVL is mounted with:
// there is one model per message. It is not a state because no process of auvest has both: those
// with a velocity (ConstantAcceleration, WhiteAcceleration and the like) have no heading, and those
// that use a heading (SpeedHeading, Odometry) have the velocity as their input, where a DVL is the
// input, not a measurement. With the heading given, h is linear and the deviations are exact. An
// error of the heading turns the velocity: at speed v, v sigma_heading to the side, to be added in
// squares to sigma_sideways.
#pragma once

#include "auvest/math/trigonometry.hpp"
#include "auvest/models/measurement_model.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Whatever the number of states and axes.
template <class Scalar>
struct BodyVelocityParams {
  Scalar heading_rad = Scalar(0);  ///< from +x towards +y, at the time of the measurement
  Scalar sigma_forward_m_s = Scalar(0.02);
  Scalar sigma_sideways_m_s = Scalar(0.02);
  Scalar sigma_vertical_m_s = Scalar(0.02);

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("heading_rad", heading_rad);
    v("sigma_forward_m_s", sigma_forward_m_s);
    v("sigma_sideways_m_s", sigma_sideways_m_s);
    v("sigma_vertical_m_s", sigma_vertical_m_s);
  }
};

template <class Scalar_, int N, int Axes>
struct BodyVelocity : MeasurementModel<BodyVelocity<Scalar_, N, Axes>, Scalar_, N, Axes, 2 * Axes> {
  static_assert(Axes == 2 || Axes == 3, "in the plane or in space");
  using Base = MeasurementModel<BodyVelocity<Scalar_, N, Axes>, Scalar_, N, Axes, 2 * Axes>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;
  static constexpr bool kClosedForm = true;
  static constexpr int kPlace = 1;

  using Params = BodyVelocityParams<Scalar>;

  Params params;

  explicit BodyVelocity(const Params& p = Params()) : params(p) {}

  /// Sets the heading of the measurement to p[0] [rad].
  void place(const Scalar* p) { params.heading_rad = p[0]; }

  struct Expansion {
    Scalar sine, cosine;
    Measurement centre;

    const Measurement& value() const { return centre; }

    Jacobian H() const {
      Jacobian jacobian;
      math::set_zero(jacobian);
      jacobian(0, Axes) = jacobian(1, Axes + 1) = cosine;
      jacobian(0, Axes + 1) = sine;
      jacobian(1, Axes) = -sine;
      if (Axes == 3) jacobian(Axes - 1, 2 * Axes - 1) = Scalar(1);
      return jacobian;
    }

    AUVEST_INLINE void deviations(const ObservedState& e, Measurement& sum,
                                  Measurement& difference) const {
      math::set_zero(sum);
      turn(e.data() + Axes, difference);
      AUVEST_UNROLL
      for (int i = 0; i < Axes; ++i) difference(i) = difference(i) + difference(i);
    }

    /// From the state's axes to the vehicle's.
    AUVEST_INLINE void turn(const Scalar* v, Measurement& body) const {
      body(0) = cosine * v[0] + sine * v[1];
      body(1) = cosine * v[1] - sine * v[0];
      if (Axes == 3) body(Axes - 1) = v[Axes - 1];
    }
  };

  AUVEST_INLINE Expansion about(const State& x) const {
    using math::sincos;
    Expansion point;
    sincos(params.heading_rad, point.sine, point.cosine);
    point.turn(x.data() + Axes, point.centre);
    return point;
  }

  Measurement h(const State& x) const { return about(x).centre; }
  Jacobian H(const State& x) const { return about(x).H(); }

  Noise R() const {
    Noise noise;
    math::set_zero(noise);
    noise(0, 0) = params.sigma_forward_m_s * params.sigma_forward_m_s;
    noise(1, 1) = params.sigma_sideways_m_s * params.sigma_sideways_m_s;
    if (Axes == 3) {
      noise(Axes - 1, Axes - 1) = params.sigma_vertical_m_s * params.sigma_vertical_m_s;
    }
    return noise;
  }

  Status check() const {
    const bool valid = math::is_finite(params.heading_rad) &&
                       math::is_positive(params.sigma_forward_m_s) &&
                       math::is_positive(params.sigma_sideways_m_s) &&
                       math::is_positive(params.sigma_vertical_m_s);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
