// What an operation reports. Failure is a value: on anything but kOk the object is unchanged.
#pragma once

#include <cstdint>

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

enum class Status : std::uint8_t {
  kOk = 0,
  kNotInitialised,       ///< no belief yet: reset(x0, P0) was not called or was refused
  kNotFinite,            ///< an argument is NaN or infinite
  kTimeBackwards,        ///< dt < 0
  kBadParameter,         ///< a parameter lies outside its stated range
  kNotPositiveDefinite,  ///< P, R or a hull's M is not symmetric positive definite
  kAlphaTooSmall,        ///< alpha cancels all digits of a model without closed-form deviations
  kOverflow,             ///< the result would not be finite
  kUnstableStep,         ///< the time step is longer than the hull's largest stable one
  kSteepPitch,           ///< pitch is beyond 80 degrees, where Euler angles fail
  kStepTooLong,          ///< dt is longer than the filter's longest_step_s: a clock that jumped?
  kImpossibleRange,      ///< a range is negative or outside of what the sensor can measure
  kFarFromOrigin,        ///< coordinates so large that the format is coarse against the sigmas
  kRecoveriesRepeat,     ///< the recovery has widened the belief too often: the model is wrong
  kImplausible           ///< a number that the instrument cannot have measured, or beyond the gate
};

/// One line of English for each status, without a full stop. Short: a chip holds all of them in
/// RAM.
inline const char* describe(Status status) {
  switch (status) {
    case Status::kOk:
      return "ok";
    case Status::kNotInitialised:
      return "no belief yet; call reset(x0, P0) first";
    case Status::kNotFinite:
      return "an argument is NaN or infinite";
    case Status::kTimeBackwards:
      return "dt is negative: time cannot go backwards";
    case Status::kBadParameter:
      return "a parameter lies outside its stated range";
    case Status::kNotPositiveDefinite:
      return "not symmetric positive definite";
    case Status::kAlphaTooSmall:
      return "alpha is too small here";
    case Status::kOverflow:
      return "the result would not be finite";
    case Status::kUnstableStep:
      return "the time step is unstable";
    case Status::kSteepPitch:
      return "pitch is beyond 80 degrees";
    case Status::kStepTooLong:
      return "dt exceeds longest_step_s";
    case Status::kImpossibleRange:
      return "an impossible range";
    case Status::kFarFromOrigin:
      return "too far from the origin";
    case Status::kRecoveriesRepeat:
      return "recoveries repeat";
    case Status::kImplausible:
      return "implausible";
  }
  return "unknown status";
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
