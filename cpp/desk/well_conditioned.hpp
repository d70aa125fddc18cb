// The quick question whether a covariance is positive definite, for every step on the desk.
#pragma once

#include <limits>

#include "auvest/math/linear_algebra.hpp"
#include "auvest/types.hpp"

namespace auvest {
namespace desk {

/// Whether what the states do not say of each other is so much of their variances that the noise of
/// an elimination cannot hide a pivot: then check_belief() need not be asked. With pivots d_k and
/// variances p_kk the product of d_k / p_kk bounds the smallest eigenvalue of the correlations from
/// below, e times that. The elimination goes without a division, on which each next pivot would
/// wait: the pivots grow by a common factor. False, too, where that leaves the format, or where the
/// inverse of a pivot might.
template <class Scalar, int N>
__attribute__((noinline)) bool is_well_conditioned(const Matrix<Scalar, N, N>& P) {
  using Limits = std::numeric_limits<double>;
  const Scalar* p = P.data();
  double c[N][N];  // what the eliminated rows do not say of the others, times the factor
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) c[i][j] = static_cast<double>(p[i * N + j]);
  }
  bool well = true;
  double factor = 1;
  double left = 1;  // of the variances, the product
  const double noise = 16 * static_cast<double>(math::pivot_floor(Scalar(1)));
  const double normal = static_cast<double>((std::numeric_limits<Scalar>::min)()) / noise;
  AUVEST_UNROLL
  for (int k = 0; k < N; ++k) {
    const double pivot = c[k][k];
    const double variance = static_cast<double>(p[k * N + k]);
    const double whole = factor * variance;
    well = well && variance >= normal && noise * whole >= (Limits::min)() && pivot > 0 &&
           pivot <= (Limits::max)();
    left = left * (pivot / whole);
    factor = factor * pivot;
    AUVEST_UNROLL
    for (int i = k + 1; i < N; ++i) {
      AUVEST_UNROLL
      for (int j = k + 1; j <= i; ++j) c[i][j] = c[i][j] * pivot - c[i][k] * c[j][k];
    }
  }
  return well && left > noise;
}

}  // namespace desk
}  // namespace auvest
