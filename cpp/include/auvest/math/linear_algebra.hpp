// Small fixed-size linear algebra with one evaluation order: explicit loops over the lower
// triangle.
//
// Eigen gives the types; its products and decompositions are large on an 8-bit chip and leave the
// order of a sum to the version and the vector unit. Symmetric matrices are read and written in
// their lower triangle only.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/types.hpp"

namespace auvest {
namespace math {

/// Copies the lower triangle onto the upper one.
template <class Scalar, int N>
inline void mirror_lower(Matrix<Scalar, N, N>& a) {
  for (int i = 1; i < N; ++i) {
    for (int j = 0; j < i; ++j) a(j, i) = a(i, j);
  }
}

/// True if every element is finite.
template <class Scalar, int Rows, int Cols>
AUVEST_INLINE bool all_finite(const Matrix<Scalar, Rows, Cols>& a) {
  bool finite = true;
  AUVEST_UNROLL
  for (int i = 0; i < Rows; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j < Cols; ++j) finite = finite && is_finite(a(i, j));
  }
  return finite;
}

/// True if every element of the lower triangle is finite.
template <class Scalar, int N>
AUVEST_INLINE bool lower_finite(const Matrix<Scalar, N, N>& a) {
  bool finite = true;
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) finite = finite && is_finite(a(i, j));
  }
  return finite;
}

/// The least pivots that are more than rounding noise of an elimination: 4 epsilon of the diagonal.
/// False if a diagonal element is not positive (or is NaN).
template <class Scalar, int N>
AUVEST_INLINE bool pivot_floors(const Matrix<Scalar, N, N>& a, Vector<Scalar, N>& floor) {
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) {
    if (!(a(i, i) > Scalar(0))) return false;
    floor(i) = Scalar(4) * machine_epsilon<Scalar>() * a(i, i);
  }
  return true;
}

/// Columns 0..Cols-1 of the Cholesky factor of the symmetric matrix `a`, in place.
///
/// On return the first `Cols` columns hold L (N x Cols, lower trapezoidal) and the trailing block
/// its Schur complement, so that a = L L' + [0 0; 0 Schur].
///
/// A pivot below its floor is raised to it, which adds a variance the format cannot resolve and
/// keeps the factor real. The same floor holds for the Schur complement's diagonal. False, with `a`
/// left unusable, if a diagonal element is not positive (or is NaN).
template <int Cols, class Scalar, int N>
inline bool partial_cholesky(Matrix<Scalar, N, N>& a) {
  static_assert(0 < Cols && Cols <= N, "Cols is the number of columns to eliminate");
  Vector<Scalar, N> floor;
  if (!pivot_floors(a, floor)) return false;
  AUVEST_UNROLL
  for (int k = 0; k < Cols; ++k) {
    if (a(k, k) < floor(k)) a(k, k) = floor(k);
    const Scalar pivot = sqrt(a(k, k));
    const Scalar inverse = Scalar(1) / pivot;
    a(k, k) = pivot;
    AUVEST_UNROLL
    for (int i = k + 1; i < N; ++i) a(i, k) = a(i, k) * inverse;
    AUVEST_UNROLL
    for (int i = k + 1; i < N; ++i) {
      AUVEST_UNROLL
      for (int j = k + 1; j <= i; ++j) a(i, j) = a(i, j) - a(i, k) * a(j, k);
    }
  }
  AUVEST_UNROLL
  for (int i = Cols; i < N; ++i) {
    if (a(i, i) < floor(i)) a(i, i) = floor(i);
  }
  return true;
}

/// a = L D L' with a unit lower triangular L, in place: D on the diagonal, L below it. Pivots that
/// are zero to rounding are floored as in partial_cholesky. False, with `a` left unusable, if `a`
/// is indefinite or a diagonal element is not positive (or is NaN).
template <class Scalar, int N>
inline bool ldlt(Matrix<Scalar, N, N>& a) {
  Vector<Scalar, N> floor;
  if (!pivot_floors(a, floor)) return false;
  AUVEST_UNROLL
  for (int k = 0; k < N; ++k) {
    if (a(k, k) < -(Scalar(N) * floor(k))) return false;
    if (a(k, k) < floor(k)) a(k, k) = floor(k);
    if (k + 1 == N) break;
    const Scalar inverse = Scalar(1) / a(k, k);
    AUVEST_UNROLL
    for (int i = N - 1; i > k; --i) {  // upwards: row i needs the unscaled column above it
      const Scalar l = a(i, k) * inverse;
      AUVEST_UNROLL
      for (int j = k + 1; j <= i; ++j) a(i, j) = a(i, j) - l * a(j, k);
      a(i, k) = l;
    }
  }
  return true;
}

/// True if the symmetric matrix (lower triangle) is positive definite to working precision: no
/// pivot of its Cholesky factorisation is lost in rounding noise.
template <class Scalar, int N>
inline bool is_positive_definite(Matrix<Scalar, N, N> a) {
  Vector<Scalar, N> diagonal;
  for (int i = 0; i < N; ++i) diagonal(i) = a(i, i);
  for (int k = 0; k < N; ++k) {
    if (!(a(k, k) > Scalar(N) * machine_epsilon<Scalar>() * diagonal(k)) || !is_finite(a(k, k))) {
      return false;
    }
    const Scalar inverse = Scalar(1) / a(k, k);
    for (int i = k + 1; i < N; ++i) {
      for (int j = k + 1; j <= i; ++j) a(i, j) = a(i, j) - a(i, k) * a(j, k) * inverse;
    }
  }
  return true;
}

/// Lower triangle of Phi P Phi' for a symmetric P given by its lower triangle.
template <class Scalar, int N>
inline Matrix<Scalar, N, N> symmetric_product(const Matrix<Scalar, N, N>& phi,
                                              Matrix<Scalar, N, N> p) {
  mirror_lower(p);
  Matrix<Scalar, N, N> result;
  for (int i = 0; i < N; ++i) {
    Vector<Scalar, N> row;  // row i of Phi P
    for (int k = 0; k < N; ++k) {
      row(k) = Scalar(0);
      for (int l = 0; l < N; ++l) row(k) = row(k) + phi(i, l) * p(l, k);
    }
    for (int j = 0; j <= i; ++j) {
      Scalar sum = Scalar(0);
      for (int k = 0; k < N; ++k) sum = sum + row(k) * phi(j, k);
      result(i, j) = sum;
      result(j, i) = sum;
    }
  }
  return result;
}

}  // namespace math
}  // namespace auvest
