// Sums over particles in one defined order, the same for any number of lanes.
//
// Particle i is added to partial sum i mod kBlock; at the end the partial sums are folded in
// halves. A vector register keeps as many partial sums as it has lanes, and the chain of rounding
// errors is kBlock times shorter than that of a plain loop.
#pragma once

#include "auvest/config.hpp"
#include "auvest/particles/lanes.hpp"

namespace auvest {

template <class Lanes>
class OrderedSum {
 public:
  using Scalar = typename Lanes::Scalar;
  using Value = typename Lanes::Value;

  OrderedSum() {
    for (int i = 0; i < kBlock; ++i) partial_[i] = Scalar(0);
  }

  /// Adds the values of the particles from `first` on.
  AUVEST_INLINE void add(int first, const Value& value) {
    Scalar* partial = partial_ + place_in_block(first);
    Lanes::store(partial, Lanes::load(partial) + value);
  }

  Scalar total() const {
    Scalar folded[kBlock];
    for (int i = 0; i < kBlock; ++i) folded[i] = partial_[i];
    for (int half = kBlock / 2; half > 0; half /= 2) {
      for (int i = 0; i < half; ++i) folded[i] = folded[i] + folded[i + half];
    }
    return folded[0];
  }

 private:
  Scalar partial_[kBlock];
};

}  // namespace auvest
