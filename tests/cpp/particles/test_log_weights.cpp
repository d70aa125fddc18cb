// Normalisation where plain weights would be zero, infinite or not a number.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/particle_set.hpp"

namespace {

template <class Scalar>
struct Weights {
  using Set = auvest::ParticleSet<Scalar, 0>;
  std::vector<Scalar> storage;
  Set set;
  auvest::WeightSummary<Scalar> summary;

  explicit Weights(const std::vector<double>& logs)
      : storage(Set::storage_size(static_cast<int>(logs.size()))),
        set(storage.data(), static_cast<int>(logs.size())) {
    set.resize(static_cast<int>(logs.size()));
    auvest::equal_weights(set);
    for (int i = 0; i < set.size(); ++i) {
      set.log_weights()[i] = static_cast<Scalar>(logs[static_cast<std::size_t>(i)]);
    }
    summary = auvest::normalise<auvest::OneLane<Scalar>>(set);
  }
  double weight(int i) const { return double(auvest::weight_of(set.log_weights()[i])); }
};

TEST_CASE("normalise: known weights, their sum and N_eff") {
  const Weights<double> w({std::log(1.0), std::log(2.0), std::log(5.0)});
  CHECK(w.weight(0) == close_to(1.0 / 8, 1e-15));
  CHECK(w.weight(2) == close_to(5.0 / 8, 1e-15));
  CHECK(w.summary.log_sum == close_to(std::log(8.0), 1e-15));
  CHECK(w.summary.effective_size == close_to(64.0 / 30, 1e-15));
}

TEST_CASE_TEMPLATE("normalise: weights far below and above the format's range", Scalar, float,
                   double) {
  for (const double level : {-1e5, -1000.0, 0.0, 1000.0, 1e5}) {
    const Weights<Scalar> w({level, level + std::log(3.0)});
    // The differences of the logarithms are what is left at their size.
    const double tolerance =
        1e-6 + std::fabs(level) * double(std::numeric_limits<Scalar>::epsilon());
    CHECK(w.weight(0) == close_to(0.25, 4 * tolerance));
    CHECK(w.weight(1) == close_to(0.75, 4 * tolerance));
    CHECK(double(w.summary.log_sum) == close_to(level + std::log(4.0), 1e-6));
  }
}

TEST_CASE("normalise: one particle left, zero weights, not a number") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const double none = double(auvest::no_log_weight<float>());
  const Weights<float> one({-5000, -10, none, double(nan)});
  CHECK(one.weight(0) == 0);
  CHECK(one.weight(1) == 1);
  CHECK(one.weight(2) == 0);
  CHECK(one.weight(3) == 0);
  CHECK(one.summary.effective_size == 1);
  // Equal weights: N_eff is their number, however many and however small.
  const Weights<float> equal(std::vector<double>(1000, -12345));
  CHECK(equal.summary.effective_size == 1000);
  CHECK(equal.weight(7) == close_to(1e-3, 1e-3));
  // All lost: all the same.
  const Weights<float> lost(std::vector<double>(8, none));
  CHECK(lost.weight(3) == close_to(0.125, 1e-6));
}

TEST_CASE("weight: no subnormal number, one at one") {
  CHECK(auvest::weight_of(0.0f) == 1.0f);
  CHECK(auvest::weight_of(-80.1f) == 0.0f);
  CHECK(auvest::weight_of(-80.0f) == 0.0f);  // the edge itself is no weight
  CHECK(auvest::weight_of(-79.9f) > std::numeric_limits<float>::min());
  CHECK(auvest::weight_of(-std::numeric_limits<float>::infinity()) == 0.0f);
}

}  // namespace
