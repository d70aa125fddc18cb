// What the robust update asks of a kernel, and what every kernel inherits.
//
// A kernel says how a residual t, in multiples of its standard deviation, counts in the sum of
// rho(t) that the update minimises, [MEKF 9] to [MEKF 19] of the M-estimation EKF paper (Li, Du,
// Fan, Chen, Mao, Luo 2020). It is a plain struct that derives from Kernel<Itself, Scalar> and
// offers
//
//     Scalar weight(t) const   psi(t) / t: 1 at t = 0, never negative
//     Scalar rho(t) const      the loss, 0 at t = 0 and t^2 / 2 near it
//     Status check() const     kOk, or kBadParameter if a threshold is out of range
//
// All are even functions of t (psi is odd). Thresholds are in multiples of sigma; infinity is
// allowed and means that the segment beyond it does not exist.
#pragma once

#include <limits>

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Derived, class Scalar_>
struct Kernel {
  using Scalar = Scalar_;

  /// rho'(t), the influence of a residual.
  Scalar psi(Scalar t) const { return static_cast<const Derived*>(this)->weight(t) * t; }

 protected:
  static Scalar magnitude(Scalar t) { return t < Scalar(0) ? -t : t; }

  /// True if `threshold` is at least `lower` and positive, not subnormal; false for a NaN.
  static bool is_threshold(Scalar threshold, Scalar lower = Scalar(0)) {
    return threshold >= lower && threshold >= (std::numeric_limits<Scalar>::min)();
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
