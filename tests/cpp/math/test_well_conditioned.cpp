// The quick question of the desk against the elimination of the core, which decides.
#include "desk/well_conditioned.hpp"

#include <cmath>
#include <limits>

#include "auvest/math/random.hpp"
#include "doctest/doctest.h"

namespace {

using auvest::Matrix;
using auvest::desk::is_well_conditioned;

/// L D L' with a unit lower triangular L of numbers about `slope` and the pivots `d`.
template <class Scalar, int N>
Matrix<Scalar, N, N> product(const double (&d)[N], double slope, auvest::math::Random& random) {
  double l[N][N];
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < i; ++j) l[i][j] = slope * random.normal<double>();
    l[i][i] = 1;
  }
  Matrix<Scalar, N, N> p;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) {
      double sum = 0;
      for (int k = 0; k < N && k <= i && k <= j; ++k) sum += l[i][k] * d[k] * l[j][k];
      p(i, j) = static_cast<Scalar>(sum);
    }
  }
  return p;
}

/// Of what is well conditioned the core loses no pivot. It is where the pivots, each over its
/// variance, are together more than 64 times the rounding noise.
template <class Scalar, int N>
void compare(double unit) {
  auvest::math::Random random(N);
  const double noise = static_cast<double>(std::numeric_limits<Scalar>::epsilon());
  int quick = 0;
  for (int round = 0; round < 300; ++round) {
    for (int lost = 0; lost < N; ++lost) {
      for (double share : {1000., 100., 10., 1., 0., -1., -10., -1e6}) {
        double d[N];
        for (double& pivot : d) pivot = unit;
        d[lost] = share * noise * unit;
        // The diagonal is about `unit` whatever the pivot: rows above the lost one reach it.
        const Matrix<Scalar, N, N> p = product<Scalar, N>(d, lost == 0 ? 0 : 0.7, random);
        double left = 1;
        for (int i = 0; i < N; ++i) left *= d[i] / static_cast<double>(p(i, i));
        const bool well = is_well_conditioned(p);
        CAPTURE(lost);
        CAPTURE(share);
        if (well) CHECK(auvest::math::is_positive_definite(p));
        // The numbers of P are rounded, which is in the pivots too.
        if (share <= 0 || left < 32 * noise) CHECK_FALSE(well);
        if (lost > 0 && share > 0 && left > 128 * noise) CHECK(well);
        quick += well ? 1 : 0;
      }
    }
  }
  CHECK(quick > 0);
}

}  // namespace

TEST_CASE(
    "what is well conditioned loses no pivot, and what has lost one is not well conditioned") {
  for (double unit : {1., 1e-4, 1e4}) {
    compare<double, 2>(unit);
    compare<double, 3>(unit);
    compare<double, 6>(unit);
    compare<float, 3>(unit);
    compare<float, 6>(unit);
  }
}

TEST_CASE(
    "a diagonal is well conditioned up to the factors that the format holds, and no further") {
  Matrix<double, 6, 6> p = Matrix<double, 6, 6>::Zero();
  for (int i = 0; i < 6; ++i) p(i, i) = 1e-6 * (i + 1);
  CHECK(is_well_conditioned(p));
  for (int i = 0; i < 6; ++i) p(i, i) = 1e6 * (i + 1);
  CHECK(is_well_conditioned(p));
  // 31 factors come to the last pivot, which is 1e315 then, and 1e-300 with 1e-314 for its noise.
  for (int i = 0; i < 6; ++i) p(i, i) = 7e9;
  CHECK_FALSE(is_well_conditioned(p));
  for (int i = 0; i < 6; ++i) p(i, i) = 4.2e-10;
  CHECK_FALSE(is_well_conditioned(p));
}

TEST_CASE("what is not finite is not well conditioned, wherever it stands") {
  const float values[] = {std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity(), 0.f};
  for (float value : values) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j <= i; ++j) {
        if (value == 0.f && i != j) continue;  // a covariance of 0 is fine
        Matrix<float, 4, 4> p = Matrix<float, 4, 4>::Identity();
        p(i, j) = value;
        CHECK_FALSE(is_well_conditioned(p));
      }
    }
  }
}

TEST_CASE("a variance whose pivot may have no inverse in the format is not well conditioned") {
  for (double variance : {1e-30, 1.6e-33, 1.4e-33, 1e-38, 1.6e-43}) {
    const double d[3] = {1e-4, variance, 1e-6};
    Matrix<float, 3, 3> p = Matrix<float, 3, 3>::Zero();
    for (int i = 0; i < 3; ++i) p(i, i) = static_cast<float>(d[i]);
    CAPTURE(variance);
    // The smallest pivot that is asked for is 64 epsilon of it.
    const double least = static_cast<double>(std::numeric_limits<float>::min());
    const double noise = 64 * static_cast<double>(std::numeric_limits<float>::epsilon());
    CHECK(is_well_conditioned(p) == (variance * noise > least));
    if (is_well_conditioned(p)) CHECK(auvest::math::is_positive_definite(p));
  }
}

TEST_CASE("pivots of which one is behind another that is nearly lost are not well conditioned") {
  auvest::math::Random random(7);
  int well = 0;
  for (int round = 0; round < 20000; ++round) {
    double d[6];
    for (double& pivot : d) pivot = std::pow(10., -5 * random.uniform<double>());
    Matrix<float, 6, 6> p = product<float, 6>(d, 1.5, random);
    double scale[6];
    for (double& one : scale) one = std::pow(10., 10 * random.uniform<double>() - 5);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j)
        p(i, j) = static_cast<float>(static_cast<double>(p(i, j)) * scale[i] * scale[j]);
    }
    if (!is_well_conditioned(p)) continue;
    ++well;
    CHECK(auvest::math::ldlt(p));
  }
  CHECK(well > 100);
}
