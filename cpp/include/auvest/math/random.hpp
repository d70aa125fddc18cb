// A small, portable random generator: xoshiro128++ (Blackman and Vigna, "Scrambled linear
// pseudorandom number generators", ACM TOMS 47(4), 2021), uniform and normal deviates.
//
// The order of the draws is part of the interface: one call of a function always takes the same
// number of 32-bit words, stated at the function.
#pragma once

#include <cstddef>
#include <cstdint>

#include "auvest/config.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/trigonometry.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

class Random;

namespace detail {

/// A bijection of 64-bit words in which each input bit reaches each output bit (the finaliser of
/// splitmix64, variant 13 of Stafford's).
inline uint64_t mix_word(uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

/// Uniform deviates of a scalar type of the given size.
template <class Scalar, std::size_t Bytes>
struct Uniform;

}  // namespace detail

/// Two independent standard normal deviates from two uniform ones in [0, 1).
template <class Value>
AUVEST_INLINE void box_muller(const Value& u, const Value& v, Value& a, Value& b) {
  const Value above_zero = Value(1) - u;  // (0, 1], exact
  const Value angle_rad = two_pi<Value>() * v;
  const Value radius = sqrt(Value(-2) * log_normal(above_zero));
  Value sine, cosine;
  sincos_near(angle_rad, sine, cosine);
  a = radius * cosine;
  b = radius * sine;
}

/// A stream of random numbers. Copyable; a copy repeats the stream from where it was taken.
class Random {
 public:
  static const int kStateWords = 4;

  /// Different pairs (seed, stream) give different states, well mixed: a run takes the seed, each
  /// of its vehicles, filters or workers a stream number.
  explicit Random(uint64_t seed, uint64_t stream = 0) {
    // Four Feistel rounds: a bijection from the pair to the 128 bits of the state.
    uint64_t left = seed;
    uint64_t right = stream;
    uint64_t round_key = 0;
    for (uint8_t i = 0; i < 2; ++i) {
      round_key += 0x9e3779b97f4a7c15ull;
      right ^= detail::mix_word(left + round_key);
      round_key += 0x9e3779b97f4a7c15ull;
      left ^= detail::mix_word(right + round_key);
    }
    state_[0] = static_cast<uint32_t>(left);
    state_[1] = static_cast<uint32_t>(left >> 32);
    state_[2] = static_cast<uint32_t>(right);
    state_[3] = static_cast<uint32_t>(right >> 32);
    avoid_zero_state();
  }

  /// The state, to save a run.
  void get_state(uint32_t (&state)[kStateWords]) const {
    for (uint8_t i = 0; i < kStateWords; ++i) state[i] = state_[i];
  }

  /// Goes on from a saved state. Four zeros, from which the generator could not leave, are
  /// replaced.
  void set_state(const uint32_t (&state)[kStateWords]) {
    for (uint8_t i = 0; i < kStateWords; ++i) state_[i] = state[i];
    avoid_zero_state();
  }

  /// 32 random bits.
  uint32_t next_u32() {
    const uint32_t result = rotate_left(state_[0] + state_[3], 7) + state_[0];
    const uint32_t shifted = state_[1] << 9;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = rotate_left(state_[3], 11);
    return result;
  }

  /// Uniform in [0, 1): a multiple of 2^-24 from one word, or of 2^-53 from two (high part first)
  /// where Scalar is a 64-bit double.
  template <class Scalar>
  Scalar uniform() {
    return detail::Uniform<Scalar, sizeof(Scalar)>::draw(*this);
  }

  /// Two independent standard normal deviates (Box and Muller) from two uniforms, the radius first.
  /// |a|, |b| <= 5.77 in float, 8.57 in double.
  template <class Scalar>
  void normal_pair(Scalar& a, Scalar& b) {
    const Scalar u = uniform<Scalar>();
    const Scalar v = uniform<Scalar>();
    box_muller(u, v, a, b);
  }

  /// The first deviate of a normal_pair(); the second is dropped, so that the number of words taken
  /// is the same at every call.
  template <class Scalar>
  Scalar normal() {
    Scalar a, b;
    normal_pair(a, b);
    return a;
  }

 private:
  static uint32_t rotate_left(uint32_t x, uint8_t count) {
    return (x << count) | (x >> (32u - count));
  }

  void avoid_zero_state() {
    if ((state_[0] | state_[1] | state_[2] | state_[3]) == 0) state_[0] = 1;
  }

  uint32_t state_[kStateWords];
};

namespace detail {

template <class Scalar>
struct Uniform<Scalar, 4> {
  static Scalar draw(Random& random) {
    const int32_t bits = static_cast<int32_t>(random.next_u32() >> 8);
    return static_cast<Scalar>(bits) * Scalar(5.9604644775390625e-08);  // 2^-24
  }
};

template <class Scalar>
struct Uniform<Scalar, 8> {
  static Scalar draw(Random& random) {
    const Scalar high = static_cast<Scalar>(static_cast<int32_t>(random.next_u32() >> 5));
    const Scalar low = static_cast<Scalar>(static_cast<int32_t>(random.next_u32() >> 6));
    return (high * Scalar(67108864.0) + low) * Scalar(1.1102230246251565e-16);  // 2^26, 2^-53
  }
};

}  // namespace detail
}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
