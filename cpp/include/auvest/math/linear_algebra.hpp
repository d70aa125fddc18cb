// Small fixed-size linear algebra with one evaluation order: explicit loops over the lower
// triangle.
//
// Eigen gives the types; its products and decompositions are large on an 8-bit chip and leave the
// order of a sum to the version and the vector unit. Symmetric matrices are read and written in
// their lower triangle only. What the particle filters use is written over `Value`, a number or a
// batch of numbers (select.hpp); conditions are then masks.
#pragma once

#include <cstring>

#include "auvest/math/basic.hpp"
#include "auvest/math/select.hpp"
#include "auvest/types.hpp"

namespace auvest {
namespace math {

/// start + sum_i u[i] v[i], in the order of i.
template <class Value>
AUVEST_OUTLINE AUVEST_INLINE Value plus_dot(Value start, const Value* u, const Value* v,
                                            int count) {
  AUVEST_UNROLL
  for (int i = 0; i < count; ++i) start = start + u[i] * v[i];
  return start;
}

/// start - sum_i u[i] v[i], in the order of i.
template <class Value>
AUVEST_OUTLINE AUVEST_INLINE Value minus_dot(Value start, const Value* u, const Value* v,
                                             int count) {
  AUVEST_UNROLL
  for (int i = 0; i < count; ++i) start = start - u[i] * v[i];
  return start;
}

/// sum_i u[i] v[i], in the order of i, for count > 0.
template <class Value>
AUVEST_OUTLINE AUVEST_INLINE Value dot(const Value* u, const Value* v, int count) {
  return plus_dot(u[0] * v[0], u + 1, v + 1, count - 1);
}

/// Fills a matrix with zeros.
template <class Value, int Rows, int Cols>
AUVEST_INLINE void set_zero(Matrix<Value, Rows, Cols>& a) {
  AUVEST_UNROLL
  for (int i = 0; i < Rows; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j < Cols; ++j) a(i, j) = Value(0);
  }
}

/// to = from. (Eigen's assignment is written out element by element, which takes flash.)
template <class Scalar, int Rows, int Cols>
inline void copy(const Matrix<Scalar, Rows, Cols>& from, Matrix<Scalar, Rows, Cols>& to) {
  std::memcpy(to.data(), from.data(), sizeof(Scalar) * Rows * Cols);
}

template <class Scalar, int N>
inline void copy(const Belief<Scalar, N>& from, Belief<Scalar, N>& to) {
  copy(from.x, to.x);
  copy(from.P, to.P);
}

/// to = from in the lanes of `where`.
template <class Value, int Rows, int Cols>
AUVEST_INLINE void copy_where(const Mask<Value>& where, const Matrix<Value, Rows, Cols>& from,
                              Matrix<Value, Rows, Cols>& to) {
  AUVEST_UNROLL
  for (int i = 0; i < Rows; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j < Cols; ++j) to(i, j) = select(where, from(i, j), to(i, j));
  }
}

template <class Value, int N>
AUVEST_INLINE void copy_where(const Mask<Value>& where, const Belief<Value, N>& from,
                              Belief<Value, N>& to) {
  copy_where(where, from.x, to.x);
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) to.P(i, j) = select(where, from.P(i, j), to.P(i, j));
  }
}

/// Copies the lower triangle onto the upper one.
template <class Scalar, int N>
inline void mirror_lower(Matrix<Scalar, N, N>& a) {
  for (int i = 1; i < N; ++i) {
    for (int j = 0; j < i; ++j) a(j, i) = a(i, j);
  }
}

/// Number of rows for what the first o of n components say about the others; at least one, because
/// there are no empty arrays.
constexpr int other_states(int n, int o) { return n > o ? n - o : 1; }

/// True if every element is finite.
template <class Value, int Rows, int Cols>
AUVEST_INLINE Mask<Value> all_finite(const Matrix<Value, Rows, Cols>& a) {
  Mask<Value> finite = is_finite(a(0, 0));
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

/// True if all that a belief means is finite.
template <class Scalar, int N>
AUVEST_INLINE bool all_finite(const Belief<Scalar, N>& belief) {
  return all_finite(belief.x) && lower_finite(belief.P);
}

/// The least pivot that is more than rounding noise of an elimination: 4 epsilon of the diagonal.
template <class Value>
AUVEST_INLINE Value pivot_floor(const Value& diagonal) {
  return Value(4) * machine_epsilon<Value>() * diagonal;
}

/// pivot_floor() of all diagonal elements. False if one is not positive (or is NaN).
template <class Value, int N>
AUVEST_INLINE Mask<Value> pivot_floors(const Matrix<Value, N, N>& a, Vector<Value, N>& floor) {
  Mask<Value> positive = a(0, 0) > Value(0);
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) {
    positive = positive && a(i, i) > Value(0);
    floor(i) = pivot_floor(a(i, i));
  }
  return positive;
}

/// For a positive definite matrix: a pivot below its floor is raised to it, which adds a variance
/// the format cannot resolve and keeps the root real.
struct RaiseLostPivots {
  template <class Value>
  static AUVEST_INLINE void invert(const Value& pivot, const Value& floor, Value& root,
                                   Value& inverse) {
    const Value raised = larger(pivot, floor);
    inverse = Value(1) / raised;
    root = sqrt(raised);
  }
};

/// For a positive *semi*definite matrix: a pivot that is zero to rounding gives columns of zeros,
/// so the rank does not grow.
struct DropLostPivots {
  template <class Value>
  static AUVEST_INLINE void invert(const Value& pivot, const Value& floor, Value& root,
                                   Value& inverse) {
    const Mask<Value> lost = !(pivot > floor);
    const Value kept = select(lost, Value(1), pivot);
    inverse = select(lost, Value(0), Value(1) / kept);
    root = select(lost, Value(0), sqrt(kept));
  }
};

/// The root of the leading O x O block of the symmetric matrix `p`, and the regression of the other
/// components on the first O: with p the covariance of (v_o, v_u),
///
///     P_oo = root root',   v_u = slope v_o + (what v_o says nothing about),  slope = P_uo P_oo^-1.
///
/// `LostPivots` says what becomes of pivots that are lost in rounding noise. False if a diagonal
/// element of the block is not positive (or is NaN).
template <class LostPivots = RaiseLostPivots, int O, int U, class Value, int N>
AUVEST_OUTLINE AUVEST_INLINE Mask<Value> factor_leading(const Matrix<Value, N, N>& p,
                                                        Matrix<Value, O, O>& root,
                                                        Matrix<Value, U, O>& slope) {
  static_assert(0 < O && O <= N && U == other_states(N, O), "the first O of N components");
  Matrix<Value, O, O> l;  // P_oo = L D L', unit lower triangular; D on the diagonal for a while
  AUVEST_UNROLL
  for (int i = 0; i < O; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) l(i, j) = p(i, j);
  }
  Vector<Value, O> floor;
  const Mask<Value> positive = pivot_floors(l, floor);
  Vector<Value, O> inverse;
  AUVEST_UNROLL
  for (int k = 0; k < O; ++k) {
    LostPivots::invert(l(k, k), floor(k), root(k, k), inverse(k));
    AUVEST_UNROLL
    for (int i = O - 1; i > k; --i) {  // upwards: row i needs the unscaled column above it
      const Value scaled = l(i, k) * inverse(k);
      AUVEST_UNROLL
      for (int j = k + 1; j <= i; ++j) l(i, j) = l(i, j) - scaled * l(j, k);
      l(i, k) = scaled;
      root(i, k) = scaled * root(k, k);
      root(k, i) = Value(0);
    }
  }
  AUVEST_UNROLL
  for (int i = O; i < N; ++i) {
    Vector<Value, O> row;
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      row(k) = minus_dot(p(i, k), &l(k, 0), row.data(), k);
    }
    AUVEST_UNROLL
    for (int k = O - 1; k >= 0; --k) {
      Value value = row(k) * inverse(k);
      AUVEST_UNROLL
      for (int j = k + 1; j < O; ++j) value = value - l(j, k) * slope(i - O, j);
      slope(i - O, k) = value;
    }
  }
  return positive;
}

/// a = L D L' with a unit lower triangular L, in place: D on the diagonal, L below it. Pivots that
/// are zero to rounding are floored as in factor_leading. False, with `a` left unusable, if `a`
/// is indefinite or a diagonal element is not positive (or is NaN).
template <class Value, int N>
AUVEST_INLINE Mask<Value> ldlt(Matrix<Value, N, N>& a) {
  Vector<Value, N> floor;
  Mask<Value> definite = pivot_floors(a, floor);
  AUVEST_UNROLL
  for (int k = 0; k < N; ++k) {
    definite = definite && !(a(k, k) < -(Value(N) * floor(k)));
    a(k, k) = larger(a(k, k), floor(k));
    if (k + 1 == N) break;
    const Value inverse = Value(1) / a(k, k);
    AUVEST_UNROLL
    for (int i = N - 1; i > k; --i) {  // upwards: row i needs the unscaled column above it
      const Value l = a(i, k) * inverse;
      AUVEST_UNROLL
      for (int j = k + 1; j <= i; ++j) a(i, j) = a(i, j) - l * a(j, k);
      a(i, k) = l;
    }
  }
  return definite;
}

/// True if the symmetric matrix (lower triangle) is positive definite to working precision: no
/// pivot of its Cholesky factorisation is lost in rounding noise.
template <class Scalar, int N>
AUVEST_OUTLINE bool is_positive_definite(const Matrix<Scalar, N, N>& a) {
  Scalar root[N * (N + 1) / 2];  // lower triangle, row after row
  Scalar* row = root;
  for (int i = 0; i < N; ++i) {
    const Scalar* above = root;
    for (int j = 0; j < i; ++j) {
      row[j] = minus_dot(a(i, j), row, above, j) / above[j];
      above += j + 1;
    }
    const Scalar pivot = minus_dot(a(i, i), row, row, i);
    if (!(pivot > Scalar(N) * machine_epsilon<Scalar>() * a(i, i)) || !is_finite(pivot)) {
      return false;
    }
    row[i] = sqrt(pivot);
    row += i + 1;
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
