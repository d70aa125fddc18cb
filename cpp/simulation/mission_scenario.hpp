// What a mission is made of, and the rows of the closed-loop table of docs/algorithms/guidance.md
// as such scenarios. How it is flown: mission.hpp.
#pragma once

#include <cstdint>
#include <limits>

#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/speed_heading_current.hpp"
#include "auvest/runtime/any_interval.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "auvest/runtime/any_recovery.hpp"
#include "simulation/vehicle_sensors.hpp"

namespace auvest {

/// Where the vehicle is to go.
enum class MissionTrack : std::uint8_t {
  kLawnmower,  ///< four lanes of 120 m, 40 m apart, with corners
  kCircle      ///< radius 40 m, clockwise, for 340 s
};

/// What leads from lane to lane of the lawnmower.
enum class MissionLegs : std::uint8_t {
  kWaypoints,  ///< corners, or arcs of `arc_m`
  kDubins,     ///< the shortest curves that turn on `arc_m`
  kSpline      ///< a spline through points of the lanes and of half circles between them
};

/// Where the position comes from that guidance runs on.
enum class MissionEstimate : std::uint8_t {
  kTruth,      ///< the true state; no sensor has noise
  kFixes,      ///< the last fix, as it is
  kUkf,        ///< UKF of constant acceleration on range and bearing
  kModelAided  ///< EKF of dead reckoning with the current in the state
};

/// What guidance makes of it.
enum class MissionGuidance : std::uint8_t {
  kAdaptive,     ///< AdaptiveLineOfSight
  kCrab,         ///< CrabFeedForward, with the current of the estimate (or the true one)
  kLineOfSight,  ///< LineOfSight
  kIntegral,     ///< IntegralLineOfSight
  kVectorField   ///< VectorField
};

/// What a run is made of, beside seed and number.
struct MissionScenario {
  MissionTrack track = MissionTrack::kLawnmower;
  MissionLegs legs = MissionLegs::kWaypoints;
  MissionEstimate estimate = MissionEstimate::kTruth;
  MissionGuidance guidance = MissionGuidance::kAdaptive;

  double period_s = 0.1;
  double speed_m_s = 1.5;  ///< through the water
  double depth_m = 5;
  double current_m_s = 0.3;
  double current_rad = std::numeric_limits<double>::quiet_NaN();  ///< towards; NaN: drawn per run
  /// Random walk of the current in the world [m^2/s^3]; 0: it is constant, of the magnitude above
  double current_walk = 0;
  /// With a walk: the current at the start is drawn with this deviation per axis [m/s]
  double current_sigma_m_s = 0.3;
  double initial_error_m = 1;  ///< of the estimate, per axis

  CompassDevice compass;
  GyroDevice gyro;
  DepthDevice depth;
  LogDevice log;
  UsblDevice usbl;
  SensorTiming usbl_timing;  ///< its period is that of `interval`

  AnyInterval<double> interval;  ///< when to ask for the next fix; rounded to the period
  AnyKernel<double> kernel;
  AnyRecovery<double> recovery;
  double acceleration_psd = 3e-4;  ///< of the UKF [m^2/s^5]: a turn at 6 deg/s has so much jerk
  SpeedHeadingCurrent<double>::Params model;

  double lookahead_m = 10;
  double switch_m = 12;
  double end_m = 2;  ///< the lawnmower is over this much before its last waypoint
  double arc_m = 0;  ///< radius of the turns between its legs; 0: corners
  double circle_s = 340;
  double most_s = 1200;          ///< a lawnmower that is not over by then has failed
  double settled_leg_m = 50;     ///< "settled": from so far into a leg
  double settled_circle_s = 60;  ///< and after so long on the circle, and on curves
};

/// The rows of the closed-loop table.
enum class MissionSource : std::uint8_t {
  kTruth,
  kTruthCrab,
  kFixes,
  kUkf,
  kUkfOutliers,
  kUkfDefaultPsd,
  kAukfLaw,
  kAukfBudget,
  kModelAided,
  kModelAidedCrab,
  kModelAidedOutliers,
  kRobustModelAided,
  kRobustModelAidedOutliers
};
const int kMissionSources = 13;

/// The name of a row.
inline const char* name_of(MissionSource source) {
  static const char* const kNames[kMissionSources] = {"truth",
                                                      "truth_crab",
                                                      "fixes",
                                                      "ukf",
                                                      "ukf_outliers",
                                                      "ukf_default_psd",
                                                      "aukf_law",
                                                      "aukf_budget",
                                                      "model_aided",
                                                      "model_aided_crab",
                                                      "model_aided_outliers",
                                                      "robust_model_aided",
                                                      "robust_model_aided_outliers"};
  return kNames[static_cast<int>(source)];
}

/// The scenario of a row, at this mean interval between fixes where it is fixed.
inline MissionScenario mission_source(MissionSource source, MissionTrack track,
                                      double interval_s = 0.5) {
  using Source = MissionSource;
  MissionScenario s;
  s.track = track;
  s.interval.fixed.params.interval_s = interval_s;
  if (source == Source::kFixes) s.estimate = MissionEstimate::kFixes;
  if (source >= Source::kUkf) s.estimate = MissionEstimate::kUkf;
  if (source >= Source::kModelAided) s.estimate = MissionEstimate::kModelAided;
  if (source == Source::kTruthCrab || source >= Source::kModelAidedCrab) {
    s.guidance = MissionGuidance::kCrab;
  }
  if (source == Source::kUkfOutliers || source == Source::kModelAidedOutliers ||
      source == Source::kRobustModelAidedOutliers) {
    s.usbl.outliers = 0.05;
  }
  // The rows of the prototype's own filter have the prototype's noise; the robust ones the default.
  if (source >= Source::kModelAided && source <= Source::kModelAidedOutliers) {
    s.model.position = 0.02;
  }
  if (source == Source::kUkfDefaultPsd) {
    s.acceleration_psd = AccelerationNoise<double>().acceleration;
  }
  const bool lawnmower = track == MissionTrack::kLawnmower;
  if (source == Source::kAukfLaw) {
    s.interval.kind = AnyInterval<double>::Kind::kMahalanobis;
    auto& p = s.interval.mahalanobis.params;
    p.initial_s = 0.5;
    p.min_s = 0.1;
    p.max_s = lawnmower ? 1.18 : 1.105;
  }
  if (source == Source::kAukfBudget) {
    s.interval.kind = AnyInterval<double>::Kind::kCovarianceBudget;
    auto& p = s.interval.budget.params;
    p.initial_s = 0.5;
    p.min_s = 0.1;
    p.max_s = 2;
    p.position_sigma_m = lawnmower ? 1.155 : 1.09;
  }
  if (source >= Source::kRobustModelAided) {
    s.kernel = AnyKernel<double>(Igg<double>());
    s.recovery.enabled = true;
  }
  return s;
}

}  // namespace auvest
