#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "auvest/particles/ordered_sum.hpp"
#include "auvest/particles/particle_set.hpp"
#include "auvest/particles/weighted_means.hpp"

namespace {

using auvest::kBlock;
using Set = auvest::ParticleSet<double, 2>;

TEST_CASE("particle set: every number of every particle has its own place, blocks are arrays") {
  const int n = 37;
  std::vector<double> storage(Set::storage_size(n), -1.0);
  CHECK(storage.size() == 48 * 3);
  Set set(storage.data(), n);
  set.resize(n);
  for (int i = 0; i < n; ++i) {
    set.log_weights()[i] = -i;
    for (int f = 0; f < 2; ++f) *set.at(i, f) = 10 * i + f;
  }
  for (int i = 0; i < n; ++i) {
    CHECK(set.log_weights()[i] == -i);
    for (int f = 0; f < 2; ++f) CHECK(*set.at(i, f) == 10 * i + f);
    if (i % kBlock != 0) CHECK(set.at(i, 1) == set.at(i - 1, 1) + 1);
  }
  set.copy(36, 3);
  CHECK(*set.at(3, 1) == 361);
  CHECK(*set.at(4, 1) == 41);
  CHECK(set.log_weights()[3] == -3);
  set.fill_block();
  for (int i = n; i < 48; ++i) CHECK(*set.at(i, 1) == 361);
}

TEST_CASE("particle set: a copy has the same particles, and a place of its own") {
  const int n = 21;
  std::vector<double> storage(Set::storage_size(40), -1.0);
  std::vector<double> other(storage.size(), -2.0);
  Set set(storage.data(), 40);
  set.resize(n);
  for (int i = 0; i < n; ++i) {
    set.log_weights()[i] = -i;
    for (int f = 0; f < 2; ++f) *set.at(i, f) = 10 * i + f;
  }
  Set copy(set, other.data());
  CHECK(copy.size() == n);
  CHECK(copy.capacity() == 40);
  for (int i = 0; i < n; ++i) {
    CHECK(copy.log_weights()[i] == -i);
    for (int f = 0; f < 2; ++f) CHECK(*copy.at(i, f) == 10 * i + f);
  }
  *copy.at(3, 1) = 0;
  copy.log_weight(3) = 0;
  copy.resize(1);
  CHECK(copy.size() == 1);  // fewer than before
  CHECK(*set.at(3, 1) == 31);
  CHECK(set.log_weight(3) == -3);
  CHECK(set.size() == n);
}

TEST_CASE("ordered sum: the documented order, which is not the plain one") {
  const int n = 1000;
  std::vector<float> values;
  for (int i = 0; i < n; ++i) values.push_back(1.0f / static_cast<float>(i + 1));
  auvest::OrderedSum<auvest::OneLane<float>> sum;
  for (int i = 0; i < n; ++i) sum.add(i, values[static_cast<std::size_t>(i)]);

  float partial[16] = {};
  double exact = 0;
  float plain = 0;
  for (int i = 0; i < n; ++i) {
    const float value = values[static_cast<std::size_t>(i)];
    partial[i % 16] += value;
    exact += static_cast<double>(value);
    plain += value;
  }
  for (int half = 8; half > 0; half /= 2) {
    for (int i = 0; i < half; ++i) partial[i] += partial[i + half];
  }
  CHECK(sum.total() == partial[0]);
  CHECK(sum.total() != plain);
  CHECK(std::fabs(static_cast<double>(sum.total()) - exact) < 1e-6);
}

TEST_CASE("weighted means: against plain sums; particles behind the last do not count") {
  const int n = 21;
  std::vector<double> storage(Set::storage_size(n), 0.0);
  Set set(storage.data(), n);
  set.resize(n);
  double weights = 0, first = 0, second = 0;
  for (int i = 0; i < n; ++i) {
    const double w = 0.1 + 0.05 * (i % 7);
    set.log_weights()[i] = std::log(w);
    *set.at(i, 0) = i;
    *set.at(i, 1) = i * i;
    weights += w;
    first += w * i;
    second += w * i * i;
  }
  for (int i = n; i < 32; ++i) {
    set.log_weights()[i] = auvest::no_log_weight<double>();
    *set.at(i, 0) = *set.at(i, 1) = 1e6;
  }
  double mean[2];
  auvest::weighted_means<auvest::OneLane<double>>(
      set,
      [&set](int i, double(&q)[2]) {
        q[0] = *set.at(i, 0);
        q[1] = *set.at(i, 1);
      },
      mean);
  CHECK(mean[0] == doctest::Approx(first / weights).epsilon(1e-14));
  CHECK(mean[1] == doctest::Approx(second / weights).epsilon(1e-14));
}

TEST_CASE("weighted means: the sums have the order of ordered_sum.hpp, for any number") {
  using Lanes = auvest::OneLane<float>;
  using Floats = auvest::ParticleSet<float, 1>;
  for (int n = 1; n <= 50; ++n) {
    std::vector<float> storage(Floats::storage_size(n), 0.0f);
    Floats set(storage.data(), n);
    set.resize(n);
    auvest::OrderedSum<Lanes> weights, values;
    for (int i = 0; i < n; ++i) {
      set.log_weights()[i] = -0.1f * static_cast<float>(i % 7);
      *set.at(i, 0) = 1.0f / static_cast<float>(3 * i + 1);
      const float w = auvest::weight_of(set.log_weights()[i]);
      weights.add(i, w);
      values.add(i, w * *set.at(i, 0));
    }
    float mean[1];
    auvest::weighted_means<Lanes>(
        set, [&set](int i, float(&q)[1]) { q[0] = *set.at(i, 0); }, mean);
    CHECK(mean[0] == values.total() / weights.total());
  }
}

}  // namespace
