// The names under which Python sees the parameters of slat/ and of its scenario, as params.hpp.
#pragma once

#include "any_slat.hpp"
#include "auvest/models/constant_velocity.hpp"
#include "auvest/models/coordinated_turn.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/slatf.hpp"
#include "auvest/slat/slatf_joint.hpp"
#include "auvest/slat/slatf_shared.hpp"
#include "simulation/slat.hpp"

namespace auvest {

// Params are nested in class templates, from which C++ cannot deduce: one overload per precision.
#define AUVEST_VISIT(Type, ...)                    \
  template <class Visitor>                         \
  void visit(Type<float>::Params& p, Visitor v) {  \
    __VA_ARGS__                                    \
  }                                                \
  template <class Visitor>                         \
  void visit(Type<double>::Params& p, Visitor v) { \
    __VA_ARGS__                                    \
  }

AUVEST_VISIT(CompassMotion, v("sigma_speed_m_s", p.sigma_speed_m_s);
             v("sigma_heading_rad", p.sigma_heading_rad); v("compensate_bias", p.compensate_bias);)
AUVEST_VISIT(UnicycleMotion, v("sigma_speed_m_s", p.sigma_speed_m_s);
             v("sigma_yaw_rate_rad_s", p.sigma_yaw_rate_rad_s);)
AUVEST_VISIT(PiecewiseAcceleration, v("acceleration_m_s2", p.acceleration_m_s2);
             v("position_psd", p.position_psd);)
AUVEST_VISIT(ConstantVelocity, v("velocity_psd", p.velocity);
             v("sigma_acceleration_m_s2", p.sigma_acceleration_m_s2);)
AUVEST_VISIT(CoordinatedTurn, v("position_psd", p.noise.position);
             v("velocity_psd", p.noise.velocity); v("acceleration_psd", p.noise.acceleration);
             v("slow_m_s", p.slow_m_s);)
AUVEST_VISIT(Sonar, v("sigma_range_m", p.sigma_range_m);
             v("sigma_bearing_rad", p.sigma_bearing_rad); v("smallest_range_m", p.smallest_range_m);
             v("largest_range_m", p.largest_range_m);)

#undef AUVEST_VISIT

template <class Scalar, class Visitor>
void visit(EchoParams<Scalar>& p, Visitor v) {
  v("gate", p.gate);
  v("recover_after", p.recover_after);
  v("recover_of", p.recover_of);
  v("fastest_m_s", p.fastest_m_s);
  v("forget_after_s", p.forget_after_s);
  v("rebirth_velocity_m_s", p.rebirth_velocity_m_s);
  v("rebirth_acceleration_m_s2", p.rebirth_acceleration_m_s2);
  v("longest_step_s", p.longest_step_s);
}

template <class Scalar, class Visitor>
void visit(EkfSlatParams<Scalar>& p, Visitor v) {
  visit(static_cast<EchoParams<Scalar>&>(p), v);
  v("consider", p.consider);
}

template <class Scalar, class Visitor>
void visit(SlatfParams<Scalar>& p, Visitor v) {
  visit(static_cast<EchoParams<Scalar>&>(p), v);
  v("resample_below", p.resample_below);
  v("carry_covariance", p.carry_covariance);
  v("birth_velocity_m_s", p.birth_velocity_m_s);
  v("birth_acceleration_m_s2", p.birth_acceleration_m_s2);
  v("monte_carlo", p.monte_carlo);
}

template <class Scalar, class Visitor>
void visit(SlatfJointParams<Scalar>& p, Visitor v) {
  visit(static_cast<EchoParams<Scalar>&>(p), v);
  v("resample_below", p.resample_below);
  v("kept", p.kept);
}

template <class Scalar, class Visitor>
void visit(SlatfSharedParams<Scalar>& p, Visitor v) {
  visit(static_cast<EchoParams<Scalar>&>(p), v);
  v("resample_below", p.resample_below);
  v("kept", p.kept);
}

template <class Visitor>
void visit(SlatVehicle& p, Visitor v) {
  v("x_m", p.position[0]);
  v("y_m", p.position[1]);
  v("heading_rad", p.heading);
  v("speed_m_s", p.speed);
  v("turn_start_s", p.turn_start_s);
  v("turn_rate_rad_s", p.turn_rate);
}

template <class Visitor>
void visit(SlatScenario& p, Visitor v) {
  v("duration_s", p.duration_s);
  v("odometry_s", p.odometry_s);
  v("odometry_per_ping", p.odometry_per_ping);
  v("sigma_speed_m_s", p.sigma_speed_m_s);
  v("sigma_heading_rad", p.sigma_heading_rad);
  v("sigma_range_m", p.sigma_range_m);
  v("sigma_bearing_rad", p.sigma_bearing_rad);
  v("dropout", p.dropout);
  v("outlier", p.outlier);
  v("outlier_sigmas", p.outlier_sigmas);
  v("doubled", p.doubled);
  v("doubled_in_a_row", p.doubled_in_a_row);
  v("silent_from_s", p.silent_from_s);
  v("silent_to_s", p.silent_to_s);
  v("identified", p.identified);
  v("plan_known", p.plan_known);
  v("prior_position_m", p.prior_position_m);
  v("prior_velocity_m_s", p.prior_velocity_m_s);
  v("prior_acceleration_m_s2", p.prior_acceleration_m_s2);
}

}  // namespace auvest
