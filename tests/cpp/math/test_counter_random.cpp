// Threefry-2x32: the published sequence, the deviates' distribution, and that indices, numbers and
// keys give independent ones.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "auvest/math/bits.hpp"
#include "auvest/math/counter_random.hpp"

namespace {

namespace math = auvest::math;
using math::CounterKey;
using math::Random;

CounterKey key_of(uint32_t first, uint32_t second) {
  Random random(0);
  CounterKey key(random);
  key.word[0] = first;
  key.word[1] = second;
  return key;
}

TEST_CASE("threefry: known answers of its authors (Random123, kat_vectors)") {
  struct Case {
    uint32_t counter[2], key[2], expected[2];
  };
  const Case cases[] = {
      {{0, 0}, {0, 0}, {0x6b200159u, 0x99ba4efeu}},
      {{~0u, ~0u}, {~0u, ~0u}, {0x1cb996fcu, 0xbb002be7u}},
      {{0x243f6a88u, 0x85a308d3u}, {0x13198a2eu, 0x03707344u}, {0xc4923a9cu, 0x483df7a0u}}};
  for (const Case& c : cases) {
    uint32_t a = c.counter[0];
    uint32_t b = c.counter[1];
    math::threefry(key_of(c.key[0], c.key[1]), a, b);
    CHECK(a == c.expected[0]);
    CHECK(b == c.expected[1]);
  }
}

TEST_CASE("key: the next two words of the generator") {
  Random random(5, 6);
  Random words(5, 6);
  const CounterKey key(random);
  CHECK(key.word[0] == words.next_u32());
  CHECK(key.word[1] == words.next_u32());
  CHECK(random.next_u32() == words.next_u32());
}

/// Of n deviates and of products with the neighbour in index, in number and in the pair.
template <class Scalar>
void check_normals() {
  Random random(3);
  const CounterKey key(random);
  const CounterKey other(random);
  const int n = 200000;
  double mean = 0, square = 0, fourth = 0, in_pair = 0, in_index = 0, in_number = 0, in_key = 0;
  Scalar last(0);
  for (int i = 0; i < n; ++i) {
    Scalar a, b, c, d, e, f;
    math::counter_normal_pair(key, static_cast<uint32_t>(i), 0u, a, b);
    math::counter_normal_pair(key, static_cast<uint32_t>(i), 1u, c, d);
    math::counter_normal_pair(other, static_cast<uint32_t>(i), 0u, e, f);
    const double x = double(a);
    mean += x;
    square += x * x;
    fourth += x * x * x * x;
    in_pair += x * double(b);
    in_index += x * double(last);
    in_number += x * double(c);
    in_key += x * double(e);
    last = a;
  }
  const double error = 1 / std::sqrt(double(n));  // of a mean of deviates of variance 1
  CHECK(std::fabs(mean / n) < 4 * error);
  CHECK(std::fabs(square / n - 1) < 4 * std::sqrt(2.0) * error);
  CHECK(std::fabs(fourth / n - 3) < 4 * std::sqrt(96.0) * error);
  for (const double product : {in_pair, in_index, in_number, in_key}) {
    CHECK(std::fabs(product / n) < 4 * error);
  }
}

TEST_CASE("deviates: standard normal, independent over index, number, pair and key") {
  check_normals<float>();
  check_normals<double>();
}

TEST_CASE("deviates: the float bits that every target must repeat") {
  const CounterKey key = key_of(1, 2);
  const uint32_t expected[3][2] = {
      {3205115958u, 3189969499u}, {1054503449u, 1049656923u}, {3203156863u, 3216795451u}};
  for (uint32_t i = 0; i < 3; ++i) {
    float a, b;
    math::counter_normal_pair(key, 1000 * i, i, a, b);
    CHECK(math::to_bits(a) == expected[i][0]);
    CHECK(math::to_bits(b) == expected[i][1]);
  }
}

}  // namespace
