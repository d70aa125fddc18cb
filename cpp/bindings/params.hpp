// The names under which Python sees the members of each Params struct.
#pragma once

#include "auvest/filters/sigma_points.hpp"
#include "auvest/intervals/covariance_budget.hpp"
#include "auvest/intervals/fixed_interval.hpp"
#include "auvest/intervals/mahalanobis_interval.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/odometry.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/speed_heading.hpp"
#include "auvest/robust/hampel.hpp"
#include "auvest/robust/huber.hpp"
#include "auvest/robust/igg.hpp"
#include "auvest/robust/unit.hpp"

namespace auvest {

// In namespace auvest, where a visit(params, visitor) call finds them by its argument.
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

template <class Scalar>
using PlanarRangeBearing = RangeBearing<Scalar, 6>;

template <class Scalar>
using PlanarLeaderRange = LeaderRange<Scalar, 2>;

AUVEST_VISIT(SigmaPoints, v("alpha", p.alpha); v("beta", p.beta); v("kappa", p.kappa);)
AUVEST_VISIT(PlanarRangeBearing, v("station_x_m", p.station_x_m); v("station_y_m", p.station_y_m);
             v("sigma_range_m", p.sigma_range_m); v("sigma_bearing_rad", p.sigma_bearing_rad);
             v("near_field", p.near_field);)
AUVEST_VISIT(ExactAcceleration, v("position_psd", p.position); v("velocity_psd", p.velocity);
             v("acceleration_psd", p.acceleration);)
AUVEST_VISIT(PlanarLeaderRange, v("leader_x_m", p.leader_x_m); v("leader_y_m", p.leader_y_m);
             v("sigma_range_m", p.sigma_range_m); v("sigma_leader_m", p.sigma_leader_m);)
AUVEST_VISIT(SpeedHeading, v("sigma_forward", p.sigma_forward);
             v("sigma_starboard", p.sigma_starboard); v("sigma_heading", p.sigma_heading);
             v("bias_walk", p.bias_walk); v("scale_walk", p.scale_walk);)
AUVEST_VISIT(Odometry, v("sigma_distance", p.sigma_distance); v("sigma_drift", p.sigma_drift);
             v("sigma_turn", p.sigma_turn);)
AUVEST_VISIT(Unit, static_cast<void>(p); static_cast<void>(v);)
AUVEST_VISIT(Huber, v("k", p.k);)
AUVEST_VISIT(Hampel, v("a", p.a); v("b", p.b); v("c", p.c);)
AUVEST_VISIT(Igg, v("k0", p.k0); v("k1", p.k1);)
AUVEST_VISIT(FixedInterval, v("interval_s", p.interval_s);)
AUVEST_VISIT(CovarianceBudget, v("initial_s", p.initial_s); v("min_s", p.min_s);
             v("max_s", p.max_s); v("position_sigma_m", p.position_sigma_m);)
AUVEST_VISIT(MahalanobisInterval, v("initial_s", p.initial_s); v("min_s", p.min_s);
             v("max_s", p.max_s); v("tau0", p.tau0); v("scale", p.scale); v("epsilon", p.epsilon);
             v("gamma1_m2", p.gamma1_m2); v("gamma2", p.gamma2); v("ratio_max", p.ratio_max);
             v("tau_min", p.tau_min); v("tau_max", p.tau_max);)

#undef AUVEST_VISIT

}  // namespace auvest
