// Small fixed-size linear algebra with one evaluation order: explicit loops over the lower
// triangle.
//
// Eigen gives the types; its products and decompositions are large on an 8-bit chip and leave the
// order of a sum to the version and the vector unit. Symmetric matrices are read and written in
// their lower triangle only. What the particle filters use is written over `Value`, a number or a
// batch of numbers (select.hpp); conditions are then masks.
#pragma once

#include <cstring>
#include <limits>

#include "auvest/math/basic.hpp"
#include "auvest/math/select.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

#if defined(AUVEST_AVR_KERNELS)
// The row kernels of float in assembler: firmware/library/src/avr_kernels.S.
float plus_dot(float start, const float* u, const float* v,
               uint8_t count) __asm__("auvest_plus_dot");
float minus_dot(float start, const float* u, const float* v,
                uint8_t count) __asm__("auvest_minus_dot");
float dot(const float* u, const float* v, uint8_t count) __asm__("auvest_dot");
void add_scaled(float scale, const float* x, float* y, uint8_t count) __asm__("auvest_add_scaled");
bool all_finite(const float* a, uint8_t count) __asm__("auvest_all_finite");
inline float plus_dot(float start, const float* u, const float* v, int count) {
  return plus_dot(start, u, v, static_cast<uint8_t>(count));
}
inline float minus_dot(float start, const float* u, const float* v, int count) {
  return minus_dot(start, u, v, static_cast<uint8_t>(count));
}
inline float dot(const float* u, const float* v, int count) {
  return dot(u, v, static_cast<uint8_t>(count));
}
inline void add_scaled(float scale, const float* x, float* y, int count) {
  add_scaled(scale, x, y, static_cast<uint8_t>(count));
}
inline bool all_finite(const float* a, int count) {
  return all_finite(a, static_cast<uint8_t>(count));
}
#endif

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

/// u x v in the plane.
template <class Value>
AUVEST_OUTLINE AUVEST_INLINE Value cross(const Value* u, const Value* v) {
  return minus_dot(u[0] * v[1], u + 1, v, 1);
}

/// y[i] += scale x[i].
template <class Value>
AUVEST_OUTLINE AUVEST_INLINE void add_scaled(Value scale, const Value* x, Value* y, int count) {
  AUVEST_UNROLL
  for (int i = 0; i < count; ++i) y[i] = y[i] + scale * x[i];
}

/// Fills an array with zeros.
template <class Value>
AUVEST_OUTLINE AUVEST_INLINE void set_zero(Value* a, int count) {
  AUVEST_UNROLL
  for (int i = 0; i < count; ++i) a[i] = Value(0);
}

/// Fills a matrix with zeros.
template <class Value, int Rows, int Cols>
AUVEST_INLINE void set_zero(Matrix<Value, Rows, Cols>& a) {
  set_zero(a.data(), Rows * Cols);
}

/// to = from. (Eigen's assignment is written out element by element, which takes flash.)
template <class Scalar, int Rows, int Cols>
inline void copy(const Matrix<Scalar, Rows, Cols>& from, Matrix<Scalar, Rows, Cols>& to) {
  std::memcpy(static_cast<void*>(&to), &from, sizeof to);
}

template <class Scalar, int N>
inline void copy(const Belief<Scalar, N>& from, Belief<Scalar, N>& to) {
  std::memcpy(static_cast<void*>(&to), &from, sizeof to);
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
template <class Value, int N>
AUVEST_INLINE void mirror_lower(Matrix<Value, N, N>& a) {
  AUVEST_UNROLL
  for (int i = 1; i < N; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j < i; ++j) a(j, i) = a(i, j);
  }
}

/// Number of rows for what the first o of n components say about the others; at least one, because
/// there are no empty arrays.
constexpr int other_states(int n, int o) { return n > o ? n - o : 1; }

/// True if all numbers are finite.
template <class Value>
AUVEST_OUTLINE AUVEST_INLINE Mask<Value> all_finite(const Value* a, int count) {
  Mask<Value> finite = is_finite(a[0]);
  AUVEST_UNROLL
  for (int i = 1; i < count; ++i) finite = finite && is_finite(a[i]);
  return finite;
}

/// True if every element is finite.
template <class Value, int Rows, int Cols>
AUVEST_INLINE Mask<Value> all_finite(const Matrix<Value, Rows, Cols>& a) {
  static_assert(sizeof(int) > 2 || Rows * Cols < 256, "an 8-bit chip counts to 255");
  return all_finite(a.data(), Rows * Cols);
}

/// True if every element of the lower triangle is finite.
template <class Scalar, int N>
AUVEST_INLINE bool lower_finite(const Matrix<Scalar, N, N>& a) {
  bool finite = true;
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) finite = finite && all_finite(&a(i, 0), i + 1);
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

/// For a positive definite matrix: a pivot below its floor is raised to it, which adds a variance
/// the format cannot resolve and keeps the root real.
struct RaiseLostPivots {
  template <class Value>
  static AUVEST_INLINE Value keep(const Value& pivot, const Value& floor, Value& inverse) {
    const Value raised = larger(pivot, floor);
    inverse = Value(1) / raised;
    return raised;
  }
};

/// For a positive *semi*definite matrix: a pivot that is zero to rounding gives columns of zeros,
/// so the rank does not grow.
struct DropLostPivots {
  template <class Value>
  static AUVEST_INLINE Value keep(const Value& pivot, const Value& floor, Value& inverse) {
    const Mask<Value> lost = !(pivot > floor);
    inverse = select(lost, Value(0), Value(1) / select(lost, Value(1), pivot));
    return select(lost, Value(0), pivot);
  }
};

/// a = L D L' with a unit lower triangular L, in place, for the symmetric matrix `a` of n rows
/// (lower triangle): D on the diagonal, L below it, room to work above it. `inverse` is that of D.
/// `LostPivots` says what becomes of pivots that are lost in rounding noise. False if a diagonal
/// element of `a` is not positive (or is NaN), or a pivot is below `least` times it.
template <class LostPivots = RaiseLostPivots, class Value>
AUVEST_OUTLINE AUVEST_INLINE Mask<Value> ldlt(Value* a, int n, Value least, Value* inverse) {
  Mask<Value> definite = Value(0) < Value(1);  // so far
  Value* row = a;
  AUVEST_UNROLL
  for (int i = 0; i < n; ++i) {
    const Value diagonal = row[i];
    Value* above = a;
    AUVEST_UNROLL
    for (int k = 0; k < i; ++k) {
      above[i] = row[k];  // unscaled, as this row and those to come need it
      row[k] = row[k] * inverse[k];
      add_scaled(-row[k], above + k + 1, row + k + 1, i - k);
      above += n;
    }
    definite = definite && diagonal > Value(0) && !(row[i] < least * diagonal);
    row[i] = LostPivots::keep(row[i], pivot_floor(diagonal), inverse[i]);
    row += n;
  }
  return definite;
}

/// The same for a positive definite matrix that may have lost that to rounding: false, with `a`
/// left unusable, if it is indefinite.
template <class Value, int N>
AUVEST_INLINE Mask<Value> ldlt(Matrix<Value, N, N>& a) {
  Vector<Value, N> inverse;
  return ldlt(a.data(), N, -(Value(N) * pivot_floor(Value(1))), inverse.data());
}

/// The same for a number, which is its own D.
template <class Value>
AUVEST_INLINE Mask<Value> ldlt(Matrix<Value, 1, 1>& a) {
  return a(0, 0) > Value(0);
}

/// The root of the leading O x O block of the symmetric matrix `p`, and the regression of the other
/// components on the first O: with p the covariance of (v_o, v_u),
///
///     P_oo = root root',   v_u = slope v_o + (what v_o says nothing about),  slope = P_uo P_oo^-1.
///
/// `LostPivots` as in ldlt(). False if a diagonal element of the block is not positive (or is NaN).
template <class LostPivots = RaiseLostPivots, int O, int U, class Value, int N>
AUVEST_OUTLINE AUVEST_INLINE Mask<Value> factor_leading(const Matrix<Value, N, N>& p,
                                                        Matrix<Value, O, O>& root,
                                                        Matrix<Value, U, O>& slope) {
  static_assert(0 < O && O <= N && U == other_states(N, O), "the first O of N components");
  Matrix<Value, O, O> l;  // P_oo = L D L', unit lower triangular; D on the diagonal
  AUVEST_UNROLL
  for (int i = 0; i < O; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) l(i, j) = p(i, j);
  }
  Vector<Value, O> inverse;
  const Value any_size(std::numeric_limits<typename ScalarOf<Value>::Type>::lowest());
  const Mask<Value> positive = ldlt<LostPivots>(l.data(), O, any_size, inverse.data());
  AUVEST_UNROLL
  for (int k = 0; k < O; ++k) {
    root(k, k) = sqrt(l(k, k));  // [UKF S1]
    AUVEST_UNROLL
    for (int i = k + 1; i < O; ++i) {
      root(i, k) = l(i, k) * root(k, k);
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
      slope(i - O, k) = value;  // [UKF S1]
    }
  }
  return positive;
}

/// The same for two components and no others.
template <class Value>
AUVEST_OUTLINE AUVEST_INLINE Mask<Value> factor_leading(const Matrix<Value, 2, 2>& p,
                                                        Matrix<Value, 2, 2>& root,
                                                        Matrix<Value, 1, 2>&) {
  const Value scaled = p(1, 0) * (Value(1) / p(0, 0));
  // [UKF S1]
  root(0, 0) = sqrt(p(0, 0));
  root(0, 1) = Value(0);
  root(1, 0) = scaled * root(0, 0);
  root(1, 1) = sqrt(larger(p(1, 1) - scaled * p(1, 0), pivot_floor(p(1, 1))));
  return p(0, 0) > Value(0) && p(1, 1) > Value(0);
}

/// True if the symmetric matrix (lower triangle) is positive definite to working precision: no
/// pivot of its elimination is lost in rounding noise.
template <class Scalar, int N>
AUVEST_OUTLINE bool is_positive_definite(Matrix<Scalar, N, N> a) {
  Vector<Scalar, N> inverse;
  const Scalar least = Scalar(N) * machine_epsilon<Scalar>();
  // A pivot that is not a number makes those after it so.
  return ldlt(a.data(), N, least, inverse.data()) && is_finite(inverse(N - 1));
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
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
