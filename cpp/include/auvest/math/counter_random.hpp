// Random numbers as a function of a counter: Threefry-2x32 with 20 rounds (Salmon, Moraes, Dror and
// Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011).
//
// A particle filter draws its noise here: the deviates of particle i are a function of a key and of
// i alone. So they do not depend on the order in which particles are visited, nor on how many
// stand side by side in a vector register, and no generator state is kept per particle. The key
// comes from the one Random that a call takes as its argument.
#pragma once

#include <cstddef>
#include <cstdint>

#include "auvest/config.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/select.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

/// What makes the deviates of one call different from those of all others.
struct CounterKey {
  uint32_t word[2];

  /// Takes two words.
  explicit CounterKey(Random& random) {
    word[0] = random.next_u32();
    word[1] = random.next_u32();
  }
};

AUVEST_INLINE uint32_t rotate_left(uint32_t x, int count) {
  return (x << count) | (x >> (32 - count));
}

/// Replaces the counter (a, b) by two random words. Word: uint32_t, or a batch of them.
template <class Word>
AUVEST_INLINE void threefry(const CounterKey& key, Word& a, Word& b) {
  static const int kRotation[8] = {13, 15, 26, 6, 17, 29, 16, 24};
  const uint32_t schedule[3] = {key.word[0], key.word[1], key.word[0] ^ key.word[1] ^ 0x1bd11bdau};
  a = a + Word(schedule[0]);
  b = b + Word(schedule[1]);
  AUVEST_UNROLL
  for (int block = 0; block < 5; ++block) {
    AUVEST_UNROLL
    for (int round = 0; round < 4; ++round) {
      a = a + b;
      b = rotate_left(b, kRotation[(block % 2) * 4 + round]) ^ a;
    }
    a = a + Word(schedule[(block + 1) % 3]);
    b = b + Word(schedule[(block + 2) % 3] + static_cast<uint32_t>(block + 1));
  }
}

/// The upper 24 bits of a word as a fraction in [0, 1).
template <class Scalar>
AUVEST_INLINE Scalar fraction_of(uint32_t word) {
  return static_cast<Scalar>(static_cast<int32_t>(word >> 8)) *
         Scalar(5.9604644775390625e-08);  // 2^-24
}

namespace detail {

/// Two uniform deviates in [0, 1) for a scalar of the given size.
template <class Value, std::size_t Bytes>
struct CounterUniforms;

template <class Value>
struct CounterUniforms<Value, 4> {
  template <class Word>
  static AUVEST_INLINE void draw(const CounterKey& key, const Word& index, uint32_t number,
                                 Value& u, Value& v) {
    Word first = index;
    Word second = Word(number);
    threefry(key, first, second);
    u = fraction_of<Value>(first);
    v = fraction_of<Value>(second);
  }
};

template <class Value>
struct CounterUniforms<Value, 8> {
  static void draw(const CounterKey& key, uint32_t index, uint32_t number, Value& u, Value& v) {
    u = one(key, index, 2u * number);
    v = one(key, index, 2u * number + 1u);
  }

 private:
  static Value one(const CounterKey& key, uint32_t high, uint32_t low) {
    threefry(key, high, low);
    const Value upper = static_cast<Value>(static_cast<int32_t>(high >> 5));
    const Value lower = static_cast<Value>(static_cast<int32_t>(low >> 6));
    return (upper * Value(67108864.0) + lower) * Value(1.1102230246251565e-16);  // 2^26, 2^-53
  }
};

}  // namespace detail

/// Two independent standard normal deviates: the `number`-th pair of particle `index`.
template <class Value, class Word>
AUVEST_INLINE void counter_normal_pair(const CounterKey& key, const Word& index, uint32_t number,
                                       Value& a, Value& b) {
  Value u, v;
  detail::CounterUniforms<Value, sizeof(typename ScalarOf<Value>::Type)>::draw(key, index, number,
                                                                               u, v);
  box_muller(u, v, a, b);
}

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
