// The way out of lock-out: after n rejections the belief, not the sensor, is taken to be wrong.
//
// A kernel that rejects beyond k1 sigma keeps rejecting when the prior itself is off by more than
// that: P does not know, and nothing tells it. The M-estimation EKF paper does not treat the case.
// Here a count goes up by 2 with each rejection and down by 1 with each acceptance, so that it also
// gets there where every second leader happens to agree with the wrong prior. At 2 n, and at every
// further rejection while it stands there, the position variance grows by
//
//     q = max over what was rejected since the last time of (r^2 - S) / |h|^2
//
// with h the position part of that component's row of H, so that the same innovation would now
// stand at one sigma. The measurement that completes the streak stays rejected: where the streak
// was n outliers by chance, the next good measurement finds a wide belief and puts it right, and
// nothing but the prior's knowledge is lost.
#pragma once

#include <cstdint>

#include "auvest/robust/robust_correction.hpp"

namespace auvest {

template <class Scalar_>
struct RejectionStreak {
  using Scalar = Scalar_;

  struct Params {
    std::uint8_t rejections = 6;  ///< n, 1..100
  };

  Params params;
  std::uint8_t count;  ///< 0..2 n
  Scalar variance;     ///< q as the rejections so far ask for it [m^2], 0 if count is

  explicit RejectionStreak(const Params& p = Params()) : params(p), count(0), variance(Scalar(0)) {}

  void restart() {
    count = 0;
    variance = Scalar(0);
  }

  /// The first two states (or the only one seen) are the position.
  template <int M, int O, int N>
  bool after(const RobustCorrection<Scalar, M>& correction, const Matrix<Scalar, M, O>& a,
             const Matrix<Scalar, O, O>& root, Belief<Scalar, N>& belief) {
    bool rejected = false;
    for (int m = 0; m < M; ++m) rejected = rejected || !(correction.weight(m) > Scalar(0));
    if (!rejected) {
      if (count > 0) --count;
      if (count == 0) variance = Scalar(0);
      return false;
    }
    constexpr int kPosition = O < 2 ? O : 2;
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
      if (math::is_finite(needed) && needed > variance) variance = needed;
    }
    const int full = 2 * params.rejections;
    count = static_cast<std::uint8_t>(count + 2 < full ? count + 2 : full);
    if (count < full) return false;
    for (int i = 0; i < kPosition; ++i) belief.P(i, i) = belief.P(i, i) + variance;
    variance = Scalar(0);
    return true;
  }

  Status check() const {
    const bool valid = params.rejections >= 1 && params.rejections <= 100 &&
                       count <= 2 * params.rejections && math::is_nonnegative(variance);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace auvest
