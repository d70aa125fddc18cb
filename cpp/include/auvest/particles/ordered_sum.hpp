// Sums over particles in one defined order, the same for any number of lanes.
//
// Particle i is added to partial sum i mod kBlock; at the end the partial sums are folded in
// halves. A vector register keeps as many partial sums as it has lanes, and the chain of rounding
// errors is kBlock times shorter than that of a plain loop.
#pragma once

#include "auvest/config.hpp"
#include "auvest/particles/lanes.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The sum of `count` partial sums, a power of two; they are overwritten.
template <class Scalar>
inline Scalar fold(Scalar* partial, int count) {
  for (int half = count / 2; half > 0; half /= 2) {
    for (int i = 0; i < half; ++i) partial[i] = partial[i] + partial[i + half];
  }
  return partial[0];
}

template <class Lanes>
class OrderedSum {
 public:
  using Scalar = typename Lanes::Scalar;
  using Value = typename Lanes::Value;

  OrderedSum() {
    for (Value& partial : partial_) partial = Value(0);
  }

  /// Adds the values of the particles from `first` on.
  AUVEST_INLINE void add(int first, const Value& value) {
    Value& partial = partial_[place_in_block(first) / Lanes::kWidth];
    partial = partial + value;
  }

  Scalar total() const {
    Scalar folded[kBlock];
    for (int i = 0; i < kBlock; i += Lanes::kWidth) {
      Lanes::store(folded + i, partial_[i / Lanes::kWidth]);
    }
    return fold(folded, kBlock);
  }

 private:
  Value partial_[kBlock / Lanes::kWidth];
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
