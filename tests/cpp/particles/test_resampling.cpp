// Each policy: n offspring, expectation n w, its own bound on the spread; the copies in place
// against a second particle set.
#include <doctest/doctest.h>

#include "close.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "auvest/particles/particle_set.hpp"
#include "auvest/particles/resampling.hpp"

namespace {

using auvest::math::Random;

template <class Policy, class Scalar>
void count(std::vector<Scalar>& w, Random& random) {
  Policy::count(w.data(), static_cast<int>(w.size()), random);
}

/// Uneven, with zeros in front, inside and at the end.
std::vector<double> uneven(int n) {
  std::vector<double> w;
  for (int i = 0; i < n; ++i) w.push_back(i % 3 == 0 ? 0.0 : 0.3 + 2.9 * ((7 * i) % 5));
  w.back() = 0;
  return w;
}

double sum(const std::vector<double>& w) {
  double total = 0;
  for (const double each : w) total += each;
  return total;
}

template <class Policy>
void check_unbiased() {
  const std::vector<double> w = uneven(12);
  const double total = sum(w);
  const int n = static_cast<int>(w.size());
  const int trials = 20000;
  std::vector<double> mean(w.size()), square(w.size());
  Random random(8);
  for (int t = 0; t < trials; ++t) {
    std::vector<double> counts = w;
    count<Policy>(counts, random);
    REQUIRE(sum(counts) == n);
    for (std::size_t i = 0; i < w.size(); ++i) {
      REQUIRE(counts[i] == std::floor(counts[i]));
      mean[i] += counts[i] / trials;
      square[i] += counts[i] * counts[i] / trials;
    }
  }
  for (std::size_t i = 0; i < w.size(); ++i) {
    const double expected = n * w[i] / total;
    const double variance = square[i] - mean[i] * mean[i];
    CHECK(std::fabs(mean[i] - expected) <= 4.5 * std::sqrt(variance / trials) + 1e-12);
    if (w[i] <= 0) CHECK(mean[i] == 0);
  }
}

TEST_CASE("resampling: unbiased, and n in all") {
  check_unbiased<auvest::SystematicResampling>();
  check_unbiased<auvest::StratifiedResampling>();
  check_unbiased<auvest::ResidualResampling>();
  check_unbiased<auvest::MultinomialResampling>();
}

template <class Policy>
void check_spread(double below, double above) {
  Random random(9);
  for (int t = 0; t < 500; ++t) {
    const std::vector<double> w = uneven(9 + t % 40);
    std::vector<double> counts = w;
    count<Policy>(counts, random);
    for (std::size_t i = 0; i < w.size(); ++i) {
      const double expected = static_cast<double>(w.size()) * w[i] / sum(w);
      CHECK(counts[i] > expected - below);
      CHECK(counts[i] < expected + above);
    }
  }
}

TEST_CASE("resampling: systematic within 1 of n w, stratified within 2, residual above the floor") {
  check_spread<auvest::SystematicResampling>(1 + 1e-12, 1 + 1e-12);
  check_spread<auvest::StratifiedResampling>(2, 2);
  check_spread<auvest::ResidualResampling>(1 + 1e-12, 1e9);
}

TEST_CASE("resampling: multinomial has the variance n p (1 - p), systematic less") {
  const std::vector<double> w(10, 0.1);
  double multinomial = 0, systematic = 0;
  Random random(10);
  const int trials = 20000;
  for (int t = 0; t < trials; ++t) {
    std::vector<double> a = w;
    std::vector<double> b = w;
    count<auvest::MultinomialResampling>(a, random);
    count<auvest::SystematicResampling>(b, random);
    multinomial += (a[4] - 1) * (a[4] - 1) / trials;
    systematic += (b[4] - 1) * (b[4] - 1) / trials;
  }
  CHECK(multinomial == close_to(0.9, 0.05));
  CHECK(systematic < 1e-3);
}

template <class Policy>
void check_edges() {
  Random random(11);
  // All weight on one particle, wherever it stands.
  for (const std::size_t heavy : {0u, 3u, 7u}) {
    std::vector<double> w(8, 0.0);
    w[heavy] = 1e-30;
    count<Policy>(w, random);
    for (std::size_t i = 0; i < 8; ++i) CHECK(w[i] == (i == heavy ? 8 : 0));
  }
  std::vector<double> single(1, 0.3);
  count<Policy>(single, random);
  CHECK(single[0] == 1);
  // Many floats, whose running sum rounds: still n in all, and none far off.
  const int n = 100000;
  std::vector<float> many(n, 1.0f / n);
  count<Policy>(many, random);
  double total = 0;
  for (const float count : many) total += static_cast<double>(count);
  CHECK(total == n);
  CHECK(*std::max_element(many.begin(), many.end()) < 12);
}

TEST_CASE("resampling: one heavy particle, one particle, many particles in float") {
  check_edges<auvest::SystematicResampling>();
  check_edges<auvest::StratifiedResampling>();
  check_edges<auvest::ResidualResampling>();
  check_edges<auvest::MultinomialResampling>();
}

/// The first number is 0, which uniform() gives once in 2^24.
Random first_zero() {
  Random random(1);
  const uint32_t state[4] = {0, 1, 0, 0};
  random.set_state(state);
  return random;
}

template <class Policy>
void check_position_zero() {
  Random random = first_zero();
  REQUIRE(random.uniform<float>() == 0);
  random = first_zero();
  std::vector<float> w = {0, 0, 3, 1, 4};
  count<Policy>(w, random);
  CHECK(w[0] == 0);  // a share without length is not met by the position on its edge
  CHECK(w[1] == 0);
  CHECK(w[2] >= 1);
  CHECK(w[2] + w[3] + w[4] == 5);
}

TEST_CASE("resampling: a position of 0 falls on the first particle with a weight") {
  check_position_zero<auvest::SystematicResampling>();
  check_position_zero<auvest::StratifiedResampling>();
  check_position_zero<auvest::ResidualResampling>();
  check_position_zero<auvest::MultinomialResampling>();
}

TEST_CASE("resampling: a position on the edge of two shares falls on the second") {
  Random random = first_zero();
  std::vector<float> w = {1, 1, 0, 2};  // positions 0, 1, 2 and 3, sums 1, 2, 2 and 4
  count<auvest::SystematicResampling>(w, random);
  CHECK(w == std::vector<float>({1, 1, 0, 2}));
}

TEST_CASE("resampling: positions that rounding leaves behind all go to the last with a weight") {
  double w[5] = {1, 0, 2, 0, 0};
  auvest::detail::count_positions(w, 5, 3.0, 3, auvest::detail::WholeWeight(),
                                  [](int k) { return k == 0 ? 0.1 : 1.0; });
  CHECK(w[0] == 1);
  CHECK(w[1] == 0);
  CHECK(w[2] == 2);
  CHECK(w[3] == 0);
  CHECK(w[4] == 0);
}

TEST_CASE("resampling: sorted uniform positions, also from a first number of 0") {
  Random random = first_zero();
  auvest::detail::SortedUniforms<float> positions(6, random);
  CHECK(positions(0) == 0);  // the least of six may be 0, and the others lie above it
  float last = 0;
  for (int k = 1; k < 6; ++k) {
    const float position = positions(k);
    CHECK(position > last);
    CHECK(position < 1);
    last = position;
  }
}

TEST_CASE("redistribute: in place, the same particles as with a second set") {
  using Set = auvest::ParticleSet<double, 3>;
  Random random(12);
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 1 + trial % 50;
    // What lies behind the particles is anything, a weight of one too.
    std::vector<double> storage(Set::storage_size(n), trial % 2 == 0 ? std::nan("") : 0.0);
    Set set(storage.data(), n);
    set.resize(n);
    std::vector<double> w =
        trial % 5 == 0 ? std::vector<double>(static_cast<std::size_t>(n), 1.0) : uneven(n);
    if (sum(w) <= 0) w[0] = 1;
    std::vector<double> counts = w;
    count<auvest::MultinomialResampling>(counts, random);
    std::vector<double> expected;
    for (int i = 0; i < n; ++i) {
      const double count = counts[static_cast<std::size_t>(i)];
      set.log_weights()[i] = count;
      for (int f = 0; f < 3; ++f) *set.at(i, f) = 100 * f + i;
      expected.insert(expected.end(), static_cast<std::size_t>(count), 1.0 * i);
    }
    auvest::redistribute(set);
    std::vector<double> found;
    for (int i = 0; i < n; ++i) {
      found.push_back(*set.at(i, 0));
      for (int f = 1; f < 3; ++f) CHECK(*set.at(i, f) == *set.at(i, 0) + 100 * f);
      CHECK(set.log_weights()[i] == -std::log(double(n)));
      // Who goes on stays where it is.
      if (counts[static_cast<std::size_t>(i)] > 0) CHECK(*set.at(i, 0) == i);
    }
    std::sort(found.begin(), found.end());
    CHECK(found == expected);
    for (int i = n; i % auvest::kBlock != 0; ++i) {
      CHECK(auvest::weight_of(set.log_weights()[i]) == 0);
      for (int f = 0; f < 3; ++f) CHECK(*set.at(i, f) == *set.at(n - 1, f));  // numbers, too
    }
  }
}

TEST_CASE("resample: from log weights, the mean stays") {
  using Set = auvest::ParticleSet<float, 1>;
  const int n = 4000;
  std::vector<float> storage(Set::storage_size(n));
  Set set(storage.data(), n);
  set.resize(n);
  auvest::equal_weights(set);
  double mean = 0, total = 0;
  for (int i = 0; i < n; ++i) {
    const double x = i / (n - 1.0);
    *set.at(i, 0) = static_cast<float>(x);
    set.log_weights()[i] = static_cast<float>(-300 + 5 * x);
    mean += x * std::exp(5 * x);
    total += std::exp(5 * x);
  }
  auvest::normalise<auvest::OneLane<float>>(set);
  Random random(13);
  auvest::resample<auvest::OneLane<float>>(auvest::SystematicResampling(), set, random);
  double after = 0;
  for (int i = 0; i < n; ++i) after += static_cast<double>(*set.at(i, 0)) / n;
  CHECK(std::fabs(after - mean / total) < 1.0 / n);  // systematic: within one spacing
}

}  // namespace
