// What a path says of a plan before it flies it.
#pragma once

#include <cstdint>

#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// What is wrong with a plan, or deserves a warning.
enum class PlanProblem : std::uint8_t {
  kNone,
  kTooFew,     ///< refused: fewer than two waypoints
  kNotFinite,  ///< refused: a waypoint is NaN or infinite
  kTooClose,   ///< refused: two waypoints coincide, or lie within switch_m
  kNoRoom,     ///< refused: the leg is too short for the arcs at its ends
  kTightLeg    ///< warned of: the leg turns, or asks to turn, on less than the hull's circle
};

/// One line of English for each, without a full stop.
inline const char* describe(PlanProblem problem) {
  switch (problem) {
    case PlanProblem::kNone:
      return "the plan can be flown";
    case PlanProblem::kTooFew:
      return "a plan needs at least two waypoints";
    case PlanProblem::kNotFinite:
      return "a waypoint is NaN or infinite";
    case PlanProblem::kTooClose:
      return "two waypoints coincide or are closer than the switching distance";
    case PlanProblem::kNoRoom:
      return "a leg is too short for the arcs at its ends";
    case PlanProblem::kTightLeg:
      return "a leg or an arc is shorter than the hull's turning circle";
  }
  return "unknown problem";
}

/// The first refusal, or else the first warning, and the leg (from 0) that has it.
struct PlanReport {
  PlanProblem problem;
  std::uint16_t leg;

  /// kOk for a plan that can be used, warnings included.
  Status status() const {
    if (problem == PlanProblem::kNone || problem == PlanProblem::kTightLeg) return Status::kOk;
    return problem == PlanProblem::kNotFinite ? Status::kNotFinite : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
