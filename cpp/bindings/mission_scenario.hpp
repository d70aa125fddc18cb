// A scenario of the closed loop as a dict: what the bindings of missions have in common.
#pragma once

#include <array>
#include <string>

#include "binders.hpp"
#include "simulation/mission.hpp"

namespace auvest {
namespace bindings {

/// Names every number of a scenario.
template <class Visitor>
void visit_numbers(MissionScenario& s, Visitor&& v) {
  v("period_s", s.period_s);
  v("speed_m_s", s.speed_m_s);
  v("depth_m", s.depth_m);
  v("current_m_s", s.current_m_s);
  v("current_rad", s.current_rad);
  v("current_walk", s.current_walk);
  v("current_sigma_m_s", s.current_sigma_m_s);
  v("initial_error_m", s.initial_error_m);
  v("compass_bias_rad", s.compass.bias_rad);
  v("compass_noise_rad", s.compass.noise_rad);
  v("gyro_noise_rad_s", s.gyro.noise_rad_s);
  v("gyro_walk_rad_s", s.gyro.walk_rad_s);
  v("depth_noise_m", s.depth.noise_m);
  v("log_noise_m_s", s.log.noise_m_s);
  v("log_scale", s.log.scale);
  v("usbl_noise_m", s.usbl.noise_m);
  v("usbl_noise_rad", s.usbl.noise_rad);
  v("usbl_outliers", s.usbl.outliers);
  v("usbl_outlier_m", s.usbl.outlier_m);
  v("usbl_sound_m_s", s.usbl.sound_m_s);
  v("usbl_latency_s", s.usbl_timing.latency_s);
  v("usbl_dropout", s.usbl_timing.dropout);
  v("acceleration_psd", s.acceleration_psd);
  v("model_position", s.model.position);
  v("model_current", s.model.current);
  v("lookahead_m", s.lookahead_m);
  v("switch_m", s.switch_m);
  v("end_m", s.end_m);
  v("arc_m", s.arc_m);
  v("circle_s", s.circle_s);
  v("most_s", s.most_s);
}

template <class Kind, std::size_t Count>
Kind kind_named(const std::string& given, const char* name,
                const std::array<const char*, Count>& names) {
  for (std::size_t i = 0; i < Count; ++i) {
    if (given == names[i]) return static_cast<Kind>(i);
  }
  throw py::value_error(std::string(name) + " is not one of its names");
}
template <class Kind, std::size_t Count>
Kind kind_named(const py::dict& values, const char* name,
                const std::array<const char*, Count>& names) {
  return kind_named<Kind>(values[name].cast<std::string>(), name, names);
}

// In the order of the enumerations.
const std::array<const char*, 2> kTracks = {"lawnmower", "circle"};
const std::array<const char*, 3> kLegs = {"waypoints", "dubins", "spline"};
const std::array<const char*, 4> kEstimates = {"truth", "fixes", "ukf", "model-aided"};
const std::array<const char*, 5> kLaws = {"adaptive", "crab", "line-of-sight", "integral",
                                          "vector-field"};

inline MissionScenario to_scenario(const py::dict& values) {
  MissionScenario s;
  s.track = kind_named<MissionTrack>(values, "track", kTracks);
  s.legs = kind_named<MissionLegs>(values, "path", kLegs);
  s.estimate = kind_named<MissionEstimate>(values, "estimate", kEstimates);
  s.guidance = kind_named<MissionGuidance>(values, "guidance", kLaws);
  visit_numbers(
      s, [&values](const char* name, double& value) { value = values[name].cast<double>(); });
  s.interval = values["interval"].cast<AnyInterval<double>>();
  s.kernel = values["kernel"].cast<AnyKernel<double>>();
  const auto rejections = values["rejections"].cast<std::uint8_t>();
  s.recovery.enabled = rejections > 0;
  if (rejections > 0) s.recovery.streak.params.rejections = rejections;
  return s;
}

}  // namespace bindings
}  // namespace auvest
