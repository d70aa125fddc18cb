// What a robust update reports: the plain report, and what the kernel made of each component.
#pragma once

#include <cstdint>

#include "auvest/filters/square_root_update.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// What became of a measurement.
enum class Decision : std::uint8_t {
  kAccepted,      ///< every component with full weight: the plain update
  kDownweighted,  ///< some components with less than full weight
  kRejected       ///< every component with weight 0: the belief was left alone
};

/// Innovation, S and NIS are those of the plain update, before any weight: what a consistency test
/// expects. On anything but kOk the numbers are zero.
template <class Scalar, int M>
struct RobustCorrection : Correction<Scalar, M> {
  Decision decision;
  std::uint8_t iterations;         ///< until the weights were final; innovations take 1
  bool recovered;                  ///< the recovery policy widened the belief after this update
  Vector<Scalar, M> standardised;  ///< the residuals that the weights belong to [sigma]
  Vector<Scalar, M> weight;        ///< of each component, 0..1

  RobustCorrection() {}  ///< to be filled by an update
  explicit RobustCorrection(Status s) { clear(s); }

  void clear(Status s) {
    Correction<Scalar, M>::clear(s);
    decision = Decision::kAccepted;
    iterations = 0;
    recovered = false;
    math::set_zero(standardised);
    math::set_zero(weight);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
