// Random: the generator's published sequence, the deviates' distributions, streams, save and
// restore, and the float bits that every target must repeat.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "auvest/math/bits.hpp"
#include "auvest/math/random.hpp"

namespace math = auvest::math;
using math::Random;

namespace {

const int kDraws = 100000;

/// Kolmogorov and Smirnov's statistic sqrt(n) D of a sample against a distribution function.
template <class Distribution>
double kolmogorov_smirnov(std::vector<double> sample, Distribution distribution) {
  std::sort(sample.begin(), sample.end());
  const double n = static_cast<double>(sample.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const double p = distribution(sample[i]);
    largest = std::max(largest, p - static_cast<double>(i) / n);
    largest = std::max(largest, static_cast<double>(i + 1) / n - p);
  }
  return std::sqrt(n) * largest;
}

/// sqrt(n) D exceeds this in one sample of 100 (Kolmogorov's limit distribution).
const double kKolmogorovOnePercent = 1.628;

double normal_distribution(double x) { return 0.5 * std::erfc(-x * 0.70710678118654752); }

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double n = static_cast<double>(a.size());
  double mean_a = 0.0, mean_b = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    mean_a += a[i] / n;
    mean_b += b[i] / n;
  }
  double aa = 0.0, bb = 0.0, ab = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
    ab += (a[i] - mean_a) * (b[i] - mean_b);
  }
  return ab / std::sqrt(aa * bb);
}

/// Both deviates of each pair, in order.
template <class Scalar>
std::vector<double> normals(Random random, int pairs) {
  std::vector<double> sample;
  for (int i = 0; i < pairs; ++i) {
    Scalar a, b;
    random.normal_pair(a, b);
    sample.push_back(static_cast<double>(a));
    sample.push_back(static_cast<double>(b));
  }
  return sample;
}

template <class Scalar>
std::vector<double> uniforms(Random random, int count) {
  std::vector<double> sample;
  for (int i = 0; i < count; ++i) sample.push_back(static_cast<double>(random.uniform<Scalar>()));
  return sample;
}

}  // namespace

TEST_CASE("xoshiro128++: the sequence from the state 1, 2, 3, 4") {
  const uint32_t start[4] = {1, 2, 3, 4};
  const uint32_t expected[] = {641u,        1573767u,    3222811527u, 3517856514u, 836907274u,
                               4247214768u, 3867114732u, 1355841295u, 495546011u,  621204420u};
  Random random(0);
  random.set_state(start);
  for (uint32_t value : expected) CHECK(random.next_u32() == value);
}

TEST_CASE("state: saved and restored; four zeros are replaced") {
  Random random(7, 3);
  for (int i = 0; i < 100; ++i) random.next_u32();
  uint32_t state[4];
  random.get_state(state);
  Random other(0);
  other.set_state(state);
  for (int i = 0; i < 100; ++i) CHECK(other.next_u32() == random.next_u32());
  Random copy(random);
  CHECK(copy.next_u32() == random.next_u32());

  const uint32_t zeros[4] = {0, 0, 0, 0};
  other.set_state(zeros);
  uint32_t any = 0;
  for (int i = 0; i < 20; ++i) any |= other.next_u32();
  CHECK(any != 0);
}

TEST_CASE("uniform: the documented bits, words and order") {
  Random random(11);
  Random words(11);
  for (int i = 0; i < 100; ++i) {
    CHECK(random.uniform<float>() == std::ldexp(static_cast<float>(words.next_u32() >> 8), -24));
    const double high = static_cast<double>(words.next_u32() >> 5);
    const double low = static_cast<double>(words.next_u32() >> 6);
    CHECK(random.uniform<double>() == std::ldexp(high * 67108864.0 + low, -53));
  }
}

TEST_CASE("uniform: the largest words stay below 1, the smallest give 0") {
  // s[0] = 0 and s[3] = 0 give the word 0; s[0] = 2^32 - 1 and s[3] = 1 the word 2^32 - 1.
  Random random(0);
  const uint32_t low[4] = {0, 1, 0, 0};
  random.set_state(low);
  CHECK(random.uniform<float>() == 0.0f);
  const uint32_t high[4] = {0xffffffffu, 0, 0, 1};
  random.set_state(high);
  CHECK(random.uniform<float>() == 0.99999994f);
  // The normal deviate of the largest uniform: the end of the tail, finite.
  random.set_state(high);
  float a, b;
  random.normal_pair(a, b);
  CHECK(std::hypot(a, b) == doctest::Approx(std::sqrt(48.0 * std::log(2.0))).epsilon(1e-6));
}

TEST_CASE_TEMPLATE("uniform: moments and distribution", Scalar, float, double) {
  const std::vector<double> sample = uniforms<Scalar>(Random(2024), kDraws);
  double mean = 0.0, square = 0.0;
  for (double u : sample) {
    REQUIRE(u >= 0.0);
    REQUIRE(u < 1.0);
    mean += u / kDraws;
    square += u * u / kDraws;
  }
  // Four standard deviations of the estimates.
  CHECK(std::fabs(mean - 0.5) < 4.0 * std::sqrt(1.0 / 12.0 / kDraws));
  CHECK(std::fabs(square - 1.0 / 3.0) < 4.0 * std::sqrt(4.0 / 45.0 / kDraws));
  CHECK(kolmogorov_smirnov(sample, [](double u) { return u; }) < kKolmogorovOnePercent);
}

TEST_CASE_TEMPLATE("normal: moments, tails and distribution", Scalar, float, double) {
  const std::vector<double> sample = normals<Scalar>(Random(2025), kDraws / 2);
  double moment[5] = {0.0, 0.0, 0.0, 0.0, 0.0};
  int beyond_three = 0;
  for (double x : sample) {
    double power = 1.0;
    for (int k = 1; k <= 4; ++k) {
      power *= x;
      moment[k] += power / kDraws;
    }
    if (std::fabs(x) > 3.0) ++beyond_three;
  }
  // Four standard deviations of the estimates: variances 1, 2, 15, 96.
  CHECK(std::fabs(moment[1]) < 4.0 * std::sqrt(1.0 / kDraws));
  CHECK(std::fabs(moment[2] - 1.0) < 4.0 * std::sqrt(2.0 / kDraws));
  CHECK(std::fabs(moment[3]) < 4.0 * std::sqrt(15.0 / kDraws));
  CHECK(std::fabs(moment[4] - 3.0) < 4.0 * std::sqrt(96.0 / kDraws));
  const double expected = 0.0026997960633 * kDraws;
  CHECK(std::fabs(beyond_three - expected) < 4.0 * std::sqrt(expected));
  CHECK(kolmogorov_smirnov(sample, normal_distribution) < kKolmogorovOnePercent);
}

TEST_CASE_TEMPLATE("normal: no serial correlation, none within a pair", Scalar, float, double) {
  const std::vector<double> sample = normals<Scalar>(Random(99), kDraws / 2);
  const double limit = 4.0 / std::sqrt(static_cast<double>(kDraws));
  for (std::size_t lag = 1; lag <= 5; ++lag) {
    const std::vector<double> a(sample.begin(), sample.end() - static_cast<int>(lag));
    const std::vector<double> b(sample.begin() + static_cast<int>(lag), sample.end());
    CHECK(std::fabs(correlation(a, b)) < limit);
    // Squares: Box and Muller's two share a radius that must not show.
    std::vector<double> aa, bb;
    for (std::size_t i = 0; i < a.size(); ++i) {
      aa.push_back(a[i] * a[i]);
      bb.push_back(b[i] * b[i]);
    }
    CHECK(std::fabs(correlation(aa, bb)) < limit);
  }
}

TEST_CASE("normal takes a fixed number of words: normal() is the first of a pair") {
  Random a(5, 1), b(5, 1);
  for (int i = 0; i < 50; ++i) {
    float first, second;
    a.normal_pair(first, second);
    CHECK(math::to_bits(b.normal<float>()) == math::to_bits(first));
    CHECK(a.next_u32() == b.next_u32());
  }
  Random c(5, 1), words(5, 1);
  c.normal<float>();
  words.next_u32();
  words.next_u32();
  CHECK(c.next_u32() == words.next_u32());
  c.normal<double>();
  for (int i = 0; i < 4; ++i) words.next_u32();
  CHECK(c.next_u32() == words.next_u32());
}

TEST_CASE("streams: neighbouring seeds and streams are unrelated") {
  const std::vector<double> base = uniforms<double>(Random(1, 0), kDraws / 4);
  const double limit = 4.0 / std::sqrt(static_cast<double>(kDraws / 4));
  const uint64_t seeds[][2] = {{1, 1}, {1, 2}, {2, 0}, {0, 1}, {1, 1ull << 32}, {1ull << 32, 1}};
  for (const uint64_t(&key)[2] : seeds) {
    CHECK(std::fabs(correlation(base, uniforms<double>(Random(key[0], key[1]), kDraws / 4))) <
          limit);
  }
  // The first draws over seeds, and over streams, are a uniform sample themselves.
  std::vector<double> over_streams, over_seeds;
  for (uint64_t i = 0; i < 20000; ++i) {
    over_streams.push_back(Random(1, i).uniform<double>());
    over_seeds.push_back(Random(i).uniform<double>());
  }
  const auto uniform = [](double u) { return u; };
  CHECK(kolmogorov_smirnov(over_streams, uniform) < kKolmogorovOnePercent);
  CHECK(kolmogorov_smirnov(over_seeds, uniform) < kKolmogorovOnePercent);
  CHECK(std::fabs(correlation(over_streams, over_seeds)) < 4.0 / std::sqrt(20000.0));
}

TEST_CASE("seeding: each input bit changes about half of the state") {
  uint32_t base[4];
  Random(123, 456).get_state(base);
  for (int bit_index = 0; bit_index < 128; ++bit_index) {
    const uint64_t flip = 1ull << (bit_index % 64);
    uint32_t state[4];
    (bit_index < 64 ? Random(123 ^ flip, 456) : Random(123, 456 ^ flip)).get_state(state);
    int changed = 0;
    for (int i = 0; i < 4; ++i) {
      for (uint32_t rest = state[i] ^ base[i]; rest != 0; rest &= rest - 1) ++changed;
    }
    CHECK(changed > 38);  // 64 +- 4.6 standard deviations of 5.66
    CHECK(changed < 90);
  }
}

TEST_CASE("golden bits: seed 42, stream 7, on every target") {
  Random random(42, 7);
  const uint32_t words[] = {0xf1228542u, 0x0f5a90eau, 0x4d8ac014u, 0x7ace829du};
  for (uint32_t word : words) CHECK(random.next_u32() == word);
  const uint32_t bits[] = {0x3f83fd3eu, 0xbf088a33u, 0xbf9871a6u, 0xbf6540ddu,
                           0xbfbfc16au, 0x3f824abbu, 0x3efa70abu, 0x4015971eu,
                           0xbf5ee5c9u, 0x3f9c85adu, 0xbfaf1439u, 0x3f9f1c96u,
                           0xbd352664u, 0xbf8635beu, 0x3f1918dau, 0xbf755b58u};
  for (uint32_t pattern : bits) CHECK(math::to_bits(random.normal<float>()) == pattern);
}
