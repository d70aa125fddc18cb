// Weighted means over particles, in the order of ordered_sum.hpp.
#pragma once

#include "auvest/config.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/ordered_sum.hpp"

namespace auvest {

/// mean[k] = sum w q_k / sum w. `quantity(i, q)` gives the K values of the particles from i on.
/// Give it deviations from a reference where the values are large against their spread.
template <class Lanes, int K, class Set, class Quantity>
inline void weighted_means(const Set& set, const Quantity& quantity,
                           typename Lanes::Scalar (&mean)[K]) {
  using Value = typename Lanes::Value;
  OrderedSum<Lanes> weights;
  OrderedSum<Lanes> sums[K];
  for (int i = 0; i < set.size(); i += Lanes::kWidth) {
    const Value w = weight_of(Lanes::load(&set.log_weight(i)));
    Value q[K];
    quantity(i, q);
    weights.add(i, w);
    for (int k = 0; k < K; ++k) sums[k].add(i, w * q[k]);
  }
  for (int k = 0; k < K; ++k) mean[k] = sums[k].total() / weights.total();
}

}  // namespace auvest
