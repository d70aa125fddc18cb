// How many particles a kernel takes at once. OneLane: one, with plain numbers, on every target.
//
// Particles lie in blocks of kBlock, in which each field is an array of kBlock numbers (a structure
// of arrays). So a vector register of 4, 8 or 16 floats holds the same field of that many particles
// and each of its lanes does what OneLane does, to the bit. A lanes policy offers
//
//     Value            a number, or a batch of kWidth of them
//     Word             the same of 32-bit unsigned integers
//     kWidth           divides kBlock
//     load(p), store(p, value), index(first)
//     prefetch(p)      asks for the cache line of p, if there is a cache
//     kPairs, Pair<S>  whether two groups may go through a kernel side by side (math/twin.hpp), and
//                      the lanes policy of such a pair, whose second group lies S numbers further
//                      on
#pragma once

#include <cstdint>

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Particles per block, and partial sums per sum over particles (ordered_sum.hpp).
constexpr int kBlock = 16;

/// The place of particle i >= 0 in its block. Unsigned: avr-gcc 5.4 miscompiles the signed
/// remainder in the loops over particles.
AUVEST_INLINE unsigned place_in_block(int i) {
  return static_cast<unsigned>(i) % static_cast<unsigned>(kBlock);
}

template <class Scalar_>
struct OneLane {
  using Scalar = Scalar_;
  using Value = Scalar_;
  using Word = uint32_t;
  static constexpr int kWidth = 1;
  static constexpr bool kPairs = false;
  template <int Stride>
  using Pair = OneLane;

  static AUVEST_INLINE Value load(const Scalar* from) { return *from; }
  static AUVEST_INLINE void store(Scalar* to, const Value& value) { *to = value; }
  static AUVEST_INLINE Word index(int first) { return static_cast<uint32_t>(first); }
  static AUVEST_INLINE void prefetch(const Scalar*) {}
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
