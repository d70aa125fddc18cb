// The way out of lock-out: after enough rejections the belief, not the sensor, is taken to be
// wrong.
//
// A kernel that rejects beyond k1 sigma keeps rejecting when the prior itself is off by more than
// that: P does not know, and nothing tells it. The M-estimation EKF paper does not treat the case.
// Here a count weighs the two explanations against each other, as Page's test (1954) does: it adds
// up log likelihood ratios of "the prior is wrong" to "these are outliers", never falls below 0,
// and decides at a limit. Outliers are independent of each other; a wrong prior is wrong by the
// same amount until it moves, so that whoever looks along the same line sees the same innovation
// again:
//
//     rejected, along neither of the last two lines          log 1 / p          =  2.0 nats    + 4
//     rejected, the same innovation along the same line      log 1 / (p q)      =  3.5 nats    + 7
//     rejected, another innovation along the same line       log 1 / (1 - q)    =  0.2 nats    + 1
//     accepted                                                                                 - 2
//
// with p = 0.14 the share of rejections where every fifth range is an outlier of ten sigma, and
// q = 0.22 the probability that one of these repeats another. A count is half a nat, rounded up so
// that no geometry stays locked out. An acceptance takes back half a rejection only: it may come
// from a line along which the error does not show. The limit is that of n rejections, 4 n.
//
// At the limit, and at every further rejection while the count stands there, the position variance
// grows by
//
//     v = max over what was rejected since the last time of (r^2 - S) / |h|^2
//
// with h the position part of that component's row of H, so that the same innovation would now
// stand at one sigma. The measurement that completes the streak stays rejected: where the streak
// was outliers by chance, the next good measurement finds a wide belief and puts it right, and
// nothing but the prior's knowledge is lost.
//
// A belief that is wrong is put right by one widening, or a few. Where they repeat, the model is
// wrong and not the belief: a scale of the ranges, a leader that is not where it says. A belief
// that is widened again and again then follows every measurement, outliers too, and is worse than
// one without a kernel. So widenings are counted and, like water from a bucket, the count runs out:
// five at once, and then one in fifty measurements. Beyond that the belief stays as it is, and the
// status of the filter says kRecoveriesRepeat.
#pragma once

#include <cstdint>

#include "auvest/robust/robust_correction.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct RejectionStreak {
  using Scalar = Scalar_;

  struct Params {
    std::uint8_t rejections = 6;  ///< n, 1..60: so many in a row, if none repeats another
  };

  Params params;
  std::uint8_t count;           ///< 0..4 n
  std::uint8_t widened;         ///< what the widenings have added to the bucket, less what ran out
  Scalar variance;              ///< v as the rejections so far ask for it [m^2], 0 if count is
  Matrix<Scalar, 2, 3> recent;  ///< h and innovation of rejections along the last two lines

  explicit RejectionStreak(const Params& p = Params()) : params(p) { restart(); }

  /// What was rejected speaks against a belief that is gone.
  void forget() {
    count = 0;
    variance = Scalar(0);
    math::set_zero(recent);
  }

  void restart() {
    count = 0;
    widened = 0;
    variance = Scalar(0);
    math::set_zero(recent);
  }

  /// The first two states (or the only one seen) are the position.
  template <int M, int O, int N>
  bool after(const RobustCorrection<Scalar, M>& correction, const Matrix<Scalar, M, O>& a,
             const Matrix<Scalar, O, O>& root, Belief<Scalar, N>& belief) {
    if (widened > 0) --widened;
    int evidence = 0;
    int rejected = 0;
    for (int m = 0; m < M; ++m) {
      if (correction.weight(m) > Scalar(0)) continue;
      const int more =
          weigh(&a(m, 0), root, correction.innovation(m), correction.S(m, m), rejected);
      if (more > evidence) evidence = more;
      ++rejected;
    }
    if (evidence == 0) {
      count = static_cast<std::uint8_t>(count > kAccepted ? count - kAccepted : 0);
      if (count == 0) variance = Scalar(0);
      return false;
    }
    const int limit = kRejected * params.rejections;
    count = static_cast<std::uint8_t>(count + evidence < limit ? count + evidence : limit);
    if (count < limit || exhausted()) return false;
    widened = static_cast<std::uint8_t>(widened + kWidening);
    for (int i = 0; i < (O < 2 ? O : 2); ++i) belief.P(i, i) = belief.P(i, i) + variance;
    variance = Scalar(0);
    return true;
  }

  /// True while the belief has been widened so often that it is not any more.
  bool exhausted() const { return widened > 255 - kWidening; }

  Status check() const {
    const bool valid = params.rejections >= 1 && params.rejections <= 60 &&
                       count <= kRejected * params.rejections && math::is_nonnegative(variance) &&
                       math::all_finite(recent);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  // Evidence for a wrong prior, in halves of a nat.
  static constexpr int kRejected = 4;
  static constexpr int kRepeated = 7;
  static constexpr int kContradicted = 1;
  static constexpr int kAccepted = 2;  // against it

  static constexpr int kWidening = 50;  // measurements, of the 255 that the bucket holds

  /// What the rejection of a component says, and how far off it says the position is. `before`:
  /// components of the same measurement that were rejected before it; they cannot repeat each
  /// other.
  template <int O>
  int weigh(const Scalar* a, const Matrix<Scalar, O, O>& root, Scalar innovation, Scalar s,
            int before) {
    constexpr int kPosition = O < 2 ? O : 2;
    Vector<Scalar, O> h;  // h L = a
    for (int k = O - 1; k >= 0; --k) {
      Scalar value = a[k];
      for (int i = k + 1; i < O; ++i) value = value - h(i) * root(i, k);
      h(k) = value / root(k, k);
    }
    const Scalar square = innovation * innovation;
    const Scalar length2 = math::dot(h.data(), h.data(), kPosition);
    const Scalar needed = (square - s) / length2;
    if (!math::is_finite(needed) || !math::is_finite(length2)) return kRejected;
    if (O > kPosition) {
      // A velocity does not see the position, and a belief far wider than the range hardly: what is
      // left of h is rounding, and would ask for any variance.
      Scalar known = Scalar(0);
      for (int i = 0; i < kPosition; ++i) {
        known = known + math::dot(&root(i, 0), &root(i, 0), i + 1);
      }
      if (!(needed < Scalar(1e10) * known)) return kRejected;
    }
    if (needed > variance) variance = needed;

    // The same line: within 20 degrees. The same innovation: within three of its sigmas, and an
    // eighth for what a line turns between two looks along it.
    const Scalar near2 = Scalar(0.125) * length2;
    const Scalar alike2 = Scalar(9) * s + Scalar(0.015625) * square;
    int evidence = kRejected;
    int replaced = 1;
    const Scalar line[2] = {h(0), kPosition > 1 ? h(kPosition - 1) : Scalar(0)};
    for (int i = before; i < 2; ++i) {
      const Scalar apart[2] = {line[0] - recent(i, 0), line[1] - recent(i, 1)};
      if (!(math::dot(apart, apart, 2) < near2)) continue;
      const Scalar change = innovation - recent(i, 2);
      if (change * change < alike2) {
        evidence = kRepeated;
        replaced = i;
        break;
      }
      evidence = kContradicted;
    }
    if (replaced == 1) {
      for (int k = 0; k < 3; ++k) recent(1, k) = recent(0, k);
    }
    recent(0, 0) = line[0];
    recent(0, 1) = line[1];
    recent(0, 2) = innovation;
    return evidence;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
