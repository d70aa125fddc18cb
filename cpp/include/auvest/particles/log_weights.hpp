// Weights of particles as logarithms: normalised without underflow, and what they say.
#pragma once

#include "auvest/config.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/select.hpp"
#include "auvest/particles/lanes.hpp"
#include "auvest/particles/ordered_sum.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The logarithm that stands for a weight of zero: finite, so that differences stay numbers.
template <class Scalar>
constexpr Scalar no_log_weight() {
  return Scalar(-1e30);
}

/// The weight of a logarithm <= 0. Below e^-80, and for a NaN, 0: no subnormal number arises.
template <class Value>
AUVEST_INLINE Value weight_of(const Value& log_weight) {
  using math::exp_normal;
  using math::select;
  const Value least(-80);
  const auto heavy = log_weight > least;
  return select(heavy, exp_normal(select(heavy, log_weight, least)), Value(0));
}

template <class Scalar>
struct WeightSummary {
  Scalar log_sum;         ///< logarithm of the sum of the weights before normalisation
  Scalar effective_size;  ///< N_eff = 1 / sum w^2 of [SLATF 33], from 1 to N
};

/// [SLATF 32] with logarithms: the largest weight is taken out before the exponential, so at least
/// one term of the sum is 1, however far below the format's range all weights lie.
template <class Lanes, class Set>
inline WeightSummary<typename Lanes::Scalar> normalise(Set& set) {
  using math::larger;
  using math::log;
  using Scalar = typename Lanes::Scalar;
  using Value = typename Lanes::Value;
  const int n = set.size();
  Scalar* log_weights = set.log_weights();
  Value most[kBlock / Lanes::kWidth];
  for (Value& best : most) best = Value(no_log_weight<Scalar>());
  for (int i = 0; i < n; i += Lanes::kWidth) {
    Value& best = most[place_in_block(i) / Lanes::kWidth];
    best = larger(best, Value(Lanes::load(log_weights + i)));
  }
  Scalar lanes[kBlock];
  for (int i = 0; i < kBlock; i += Lanes::kWidth) Lanes::store(lanes + i, most[i / Lanes::kWidth]);
  for (int half = kBlock / 2; half > 0; half /= 2) {
    for (int i = 0; i < half; ++i) lanes[i] = larger(lanes[i], lanes[i + half]);
  }
  const Scalar largest = lanes[0];

  OrderedSum<Lanes> sum;
  OrderedSum<Lanes> squares;
  for (int i = 0; i < n; i += Lanes::kWidth) {
    const Value w = weight_of(Value(Lanes::load(log_weights + i) - Value(largest)));
    sum.add(i, w);
    squares.add(i, w * w);
  }
  const Scalar total = sum.total();
  const Scalar log_total = log(total);
  for (int i = 0; i < n; i += Lanes::kWidth) {
    const Value relative = Lanes::load(log_weights + i) - Value(largest);
    Lanes::store(log_weights + i, relative - Value(log_total));  // [SLATF 32]
  }
  WeightSummary<Scalar> summary;
  summary.log_sum = largest + log_total;
  summary.effective_size = total * total / squares.total();  // [SLATF 33]
  return summary;
}

/// All n particles weigh the same; those that fill the last block weigh nothing.
template <class Set>
inline void equal_weights(Set& set) {
  using math::log;
  using Scalar = typename Set::Scalar;
  const Scalar log_weight = -log(Scalar(set.size()));
  int i = 0;
  for (; i < set.size(); ++i) set.log_weights()[i] = log_weight;
  for (; place_in_block(i) != 0; ++i) set.log_weights()[i] = no_log_weight<Scalar>();
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
