// Weighted means over particles, in the order of ordered_sum.hpp.
#pragma once

#include "auvest/config.hpp"
#include "auvest/particles/lanes.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/ordered_sum.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

namespace detail {

constexpr int log2_of(int power_of_two) {
  return power_of_two == 1 ? 0 : 1 + log2_of(power_of_two / 2);
}

/// The number whose `bits` lowest bits are those of n in reverse.
inline int reversed(int n, int bits) {
  int result = 0;
  for (int i = 0; i < bits; ++i) result = 2 * result + (n >> i & 1);
  return result;
}

}  // namespace detail

/// mean[k] = sum w q_k / sum w. `quantity(i, q)` gives the K values of the particles from i on.
/// Give it deviations from a reference where the values are large against their spread.
///
/// The order of the sums is that of ordered_sum.hpp. But K times kBlock partial sums are 1.3 KB for
/// a master's covariance, more than a small chip has. So the partial sums are made in the order in
/// which they are folded: each is folded at once into those that wait for it, one at each level.
template <class Lanes, int K, class Set, class Quantity>
AUVEST_OUTLINE void weighted_means(const Set& set, const Quantity& quantity,
                                   typename Lanes::Scalar (&mean)[K]) {
  using Scalar = typename Lanes::Scalar;
  using Value = typename Lanes::Value;
  constexpr int kGroups = kBlock / Lanes::kWidth;
  constexpr int kLevels = detail::log2_of(kGroups);
  Value waiting[kLevels > 0 ? kLevels : 1][K + 1];
  Value sum[K + 1];  // [K]: of the weights
  for (int group = 0; group < kGroups; ++group) {
    for (int k = 0; k <= K; ++k) sum[k] = Value(0);
    const int first = detail::reversed(group, kLevels) * Lanes::kWidth;
    for (int i = first; i < set.size(); i += kBlock) {
      const Value w = weight_of(Lanes::load(set.log_weights() + i));
      Value q[K];
      quantity(i, q);
      for (int k = 0; k < K; ++k) sum[k] = sum[k] + w * q[k];
      sum[K] = sum[K] + w;
    }
    int level = 0;
    for (int pairs = group; pairs % 2 != 0; pairs /= 2, ++level) {
      for (int k = 0; k <= K; ++k) sum[k] = waiting[level][k] + sum[k];
    }
    for (int k = 0; k <= K && level < kLevels; ++k) waiting[level][k] = sum[k];
  }
  Scalar lanes[Lanes::kWidth];
  Lanes::store(lanes, sum[K]);
  const Scalar total = fold(lanes, Lanes::kWidth);
  for (int k = 0; k < K; ++k) {
    Lanes::store(lanes, sum[k]);
    mean[k] = fold(lanes, Lanes::kWidth) / total;
  }
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
