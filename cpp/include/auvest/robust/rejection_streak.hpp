// The way out of lock-out: after n rejections the belief, not the sensor, is taken to be wrong.
//
// A kernel that rejects beyond k1 sigma keeps rejecting when the prior itself is off by more than
// that: P does not know, and nothing tells it. The M-estimation EKF paper does not treat the case.
// Here a counter goes up with each rejection and down with each acceptance. At n, and at every
// further rejection while it stands there, the position variance grows by
//
//     q = max over the rejected components of (r^2 - S) / |h|^2
//
// with h the position part of that component's row of H, so that the same innovation would now
// stand at one sigma. The measurement that completes the streak stays rejected: where the streak
// was n outliers by chance, the next good measurement finds a wide belief and puts it right, and
// nothing but the prior's knowledge is lost. The counter goes down by steps, not to zero, so that
// an update that lands between two leaders is followed by another widening at once if it must.
#pragma once

#include <cstdint>

#include "auvest/robust/robust_correction.hpp"

namespace auvest {

template <class Scalar_>
struct RejectionStreak {
  using Scalar = Scalar_;

  struct Params {
    std::uint8_t rejections = 4;  ///< n >= 1
  };

  Params params;
  std::uint8_t count;  ///< 0..n

  explicit RejectionStreak(const Params& p = Params()) : params(p), count(0) {}

  void restart() { count = 0; }

  /// The first two states (or the only one seen) are the position.
  template <int M, int O, int N>
  bool after(const RobustCorrection<Scalar, M>& correction, const Matrix<Scalar, M, O>& a,
             const Matrix<Scalar, O, O>& root, Belief<Scalar, N>& belief) {
    bool rejected = false;
    for (int m = 0; m < M; ++m) rejected = rejected || !(correction.weight(m) > Scalar(0));
    if (!rejected) {
      if (count > 0) --count;
      return false;
    }
    if (count < params.rejections) ++count;
    if (count < params.rejections) return false;

    constexpr int kPosition = O < 2 ? O : 2;
    Scalar q = Scalar(0);
    for (int m = 0; m < M; ++m) {
      if (correction.weight(m) > Scalar(0)) continue;
      Vector<Scalar, O> h;  // h L = a
      for (int k = O - 1; k >= 0; --k) {
        Scalar value = a(m, k);
        for (int i = k + 1; i < O; ++i) value = value - h(i) * root(i, k);
        h(k) = value / root(k, k);
      }
      const Scalar missing =
          correction.innovation(m) * correction.innovation(m) - correction.S(m, m);
      const Scalar needed = missing / math::dot(h.data(), h.data(), kPosition);
      if (math::is_finite(needed) && needed > q) q = needed;
    }
    for (int i = 0; i < kPosition; ++i) belief.P(i, i) = belief.P(i, i) + q;
    return q > Scalar(0);
  }

  Status check() const {
    return params.rejections > 0 && count <= params.rejections ? Status::kOk
                                                               : Status::kBadParameter;
  }
};

}  // namespace auvest
