// The quick question whether a covariance is positive definite, for every step on the desk.
#pragma once

#include <limits>

#include "auvest/math/linear_algebra.hpp"
#include "auvest/types.hpp"

namespace auvest {
namespace desk {

/// Whether all pivots of P are well above the noise of their elimination: then check_belief() need
/// not be asked. Without a division, on which each next pivot would wait, the pivots and what they
/// are compared with grow by a common factor; false, too, where that leaves the format, or where
/// the inverse of a pivot might.
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
  double noise = 16 * static_cast<double>(math::pivot_floor(Scalar(1)));  // times the factor
  const double normal = static_cast<double>((std::numeric_limits<Scalar>::min)()) / noise;
  AUVEST_UNROLL
  for (int k = 0; k < N; ++k) {
    const double pivot = c[k][k];
    const double least = noise * static_cast<double>(p[k * N + k]);
    well = well && static_cast<double>(p[k * N + k]) >= normal && least >= (Limits::min)() &&
           pivot > least && pivot <= (Limits::max)();
    noise = noise * pivot;
    AUVEST_UNROLL
    for (int i = k + 1; i < N; ++i) {
      AUVEST_UNROLL
      for (int j = k + 1; j <= i; ++j) c[i][j] = c[i][j] * pivot - c[i][k] * c[j][k];
    }
  }
  return well;
}

}  // namespace desk
}  // namespace auvest
