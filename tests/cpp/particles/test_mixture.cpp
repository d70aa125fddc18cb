// Mean and covariance of a mixture against their definition; headings on the circle.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <vector>

#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/mixture.hpp"
#include "auvest/particles/particle_set.hpp"

namespace {

using auvest::Belief;
using Lanes = auvest::OneLane<double>;

/// Particles with N means and, behind them, the lower triangle of a covariance.
template <int N>
struct Mixture {
  using Set = auvest::ParticleSet<double, N + auvest::triangle_numbers(N)>;
  std::vector<double> storage;
  Set set;

  explicit Mixture(int n) : storage(Set::storage_size(n), 0.0), set(storage.data(), n) {
    set.resize(n);
    auvest::equal_weights(set);
  }
};

TEST_CASE("mixture: the moments of weighted Gaussians, by hand") {
  // Means 0 and 4 with weights 3/4 and 1/4: 1, and between them 3/4 1 + 1/4 9 = 3.
  Mixture<2> mixture(2);
  const double x[2][2] = {{1000, -5}, {1004, 3}};
  const double p[2][3] = {{2, 0.5, 1}, {6, -1.5, 5}};
  for (int i = 0; i < 2; ++i) {
    mixture.set.log_weight(i) = std::log(i == 0 ? 0.75 : 0.25);
    for (int k = 0; k < 2; ++k) *mixture.set.at(i, k) = x[i][k];
    for (int k = 0; k < 3; ++k) *mixture.set.at(i, 2 + k) = p[i][k];
  }
  const Belief<double, 2> all = auvest::summarise<Lanes, 2, true, false>(mixture.set, 0);
  CHECK(all.x(0) == close_to(1001, 1e-14));
  CHECK(all.x(1) == close_to(-3, 1e-14));
  CHECK(all.P(0, 0) == close_to(3 + 3, 1e-13));
  CHECK(all.P(1, 0) == close_to(0 + 0.75 * 1 * 2 + 0.25 * 3 * 6, 1e-13));
  CHECK(all.P(0, 1) == all.P(1, 0));
  CHECK(all.P(1, 1) == close_to(2 + 0.75 * 4 + 0.25 * 36, 1e-13));
  const Belief<double, 2> points = auvest::summarise<Lanes, 2, false, false>(mixture.set, 0);
  CHECK(points.x == all.x);
  CHECK(points.P(0, 0) == close_to(3, 1e-13));
  CHECK(points.P(1, 0) == close_to(6, 1e-13));
}

TEST_CASE("mixture: the mean of headings lies in (-pi, pi], whichever particle is the first") {
  const double pi = auvest::math::pi<double>();
  const double first[] = {pi - 0.01, -pi + 0.05};
  for (int swapped = 0; swapped < 2; ++swapped) {
    Mixture<3> mixture(2);
    for (int i = 0; i < 2; ++i) *mixture.set.at(i, 2) = first[(i + swapped) % 2];
    const Belief<double, 3> mean = auvest::summarise<Lanes, 3, false, true>(mixture.set, 0);
    CHECK(mean.x(2) == close_to(-pi + 0.02, 1e-14));
    CHECK(mean.P(2, 2) == close_to(0.03 * 0.03, 1e-12));
  }
}

}  // namespace
