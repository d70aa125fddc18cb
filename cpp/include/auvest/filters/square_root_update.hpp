// The measurement update that every Gaussian filter of auvest shares.
//
// A measurement of the first O states sees the others only through their regression on these:
//
//     P_oo = L L',   x_o = L y with y ~ N(0, I),   x_u = B x_o + rest,   B = P_uo P_oo^-1.
//
// In the coordinates y a filter describes its measurement as
//
//     innovation = A y + e,   e ~ N(0, E),   so that S = A A' + E.
//
// The EKF has A = H L and E = R; the UKF has the t_i of its sigma points in the columns of A and
// the rest of P_yy in E (sigma_points.hpp). The update decorrelates E = U D U', then takes one
// scalar measurement of variance d after the other with Potter's square-root formula
//
//     G <- G (I - gamma f f'),  f = G' a,  s = f'f + d,  gamma = 1 / (s + sqrt(d s))
//
// and forms P_oo+ = (L G)(L G)'. That equals P - K S K' there, but a square cannot turn negative:
// no Joseph form is needed, and 32 bits serve where P - K S K' needs 64. The other states follow,
//
//     P_uo+ = B P_oo+,   P_uu+ = P_uu - (P_uo - P_uo+) B',   x_u+ = x_u + B (x_o+ - x_o).
//
// The NIS comes out as a sum of squares, sum r^2 / s, which equals innovation' S^-1 innovation.
//
// A particle filter with one Gaussian per particle takes the same steps in the lanes of a vector
// register: all but SquareRootUpdate is written over `Value`, a number or a batch of numbers
// (select.hpp), and answers with a mask.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

/// What an update reports. On anything but kOk the numbers are zero.
template <class Scalar, int M>
struct Correction {
  Status status;
  /// True if the measurement model replaced the measurement by its near-field form: innovation and
  /// S are then those of the form it chose (for RangeBearing: position error in metres).
  bool near_field;
  Vector<Scalar, M> innovation;
  Matrix<Scalar, M, M> S;  ///< covariance of the innovation
  Scalar nis;              ///< normalised innovation squared, chi-square with M degrees of freedom

  explicit Correction(Status s) { clear(s); }

  void clear(Status s) {
    status = s;
    near_field = false;
    math::set_zero(innovation);
    math::set_zero(S);
    nis = Scalar(0);
  }
};

/// What a measurement makes of the coordinates y ~ N(0, I).
template <class Value, int O>
struct Posterior {
  Vector<Value, O> y;     ///< their mean
  Matrix<Value, O, O> g;  ///< G', with G G' their covariance
  Value nis;
};

/// A = H L.
template <class Value, int M, int O>
AUVEST_INLINE void project(const Matrix<Value, M, O>& h, const Matrix<Value, O, O>& root,
                           Matrix<Value, M, O>& a) {
  AUVEST_UNROLL
  for (int m = 0; m < M; ++m) {
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      Value sum = h(m, k) * root(k, k);
      AUVEST_UNROLL
      for (int i = k + 1; i < O; ++i) sum = sum + h(m, i) * root(i, k);
      a(m, k) = sum;
    }
  }
}

/// S = A A' + E, from the lower triangle of E; both triangles.
template <class Value, int M, int O>
AUVEST_INLINE void innovation_covariance(const Matrix<Value, M, O>& a,
                                         const Matrix<Value, M, M>& noise, Matrix<Value, M, M>& s) {
  AUVEST_UNROLL
  for (int i = 0; i < M; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) {
      s(i, j) = math::plus_dot(noise(i, j), &a(i, 0), &a(j, 0), O);
      s(j, i) = s(i, j);
    }
  }
}

/// Potter's formula, one decorrelated measurement after the other. `noise` is E = U D U' as
/// math::ldlt leaves it. Uses up `a`; leaves the variances s on the diagonal of `noise`, whose
/// product is the determinant of S. False where the result would not be finite.
template <class Value, int M, int O>
AUVEST_OUTLINE AUVEST_INLINE math::Mask<Value> potter(Matrix<Value, M, O>& a,
                                                      Matrix<Value, M, M>& noise,
                                                      const Vector<Value, M>& innovation,
                                                      Posterior<Value, O>& posterior) {
  using math::dot;
  using math::is_finite;
  using math::minus_dot;
  using math::plus_dot;
  using math::sqrt;
  Vector<Value, O>& y = posterior.y;
  Matrix<Value, O, O>& g = posterior.g;
  Vector<Value, M> residual;  // the innovation decorrelated
  posterior.nis = Value(0);
  math::Mask<Value> finite = is_finite(noise(0, 0));
  AUVEST_UNROLL
  for (int m = 0; m < M; ++m) {
    residual(m) = minus_dot(innovation(m), &noise(m, 0), residual.data(), m);
    AUVEST_UNROLL
    for (int l = 0; l < m; ++l) {
      AUVEST_UNROLL
      for (int k = 0; k < O; ++k) a(m, k) = a(m, k) - noise(m, l) * a(l, k);
    }
    const bool first = m == 0;  // y = 0 and G = I
    Vector<Value, O> f;         // G' a
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) f(k) = first ? a(m, k) : dot(&g(k, 0), &a(m, 0), O);
    const Value spread = plus_dot(noise(m, m), f.data(), f.data(), O);
    const Value gamma = Value(1) / (spread + sqrt(noise(m, m) * spread));
    // f and with it all that follows from it is bounded by these two.
    finite = finite && is_finite(spread) && is_finite(gamma);
    noise(m, m) = spread;
    const Value surprise = first ? residual(m) : minus_dot(residual(m), &a(m, 0), y.data(), O);
    const Value step = surprise / spread;
    posterior.nis = posterior.nis + step * surprise;
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      Value v = f(k);  // G f
      if (!first) {
        v = g(0, k) * f(0);
        AUVEST_UNROLL
        for (int l = 1; l < O; ++l) v = v + g(l, k) * f(l);
      }
      y(k) = first ? v * step : y(k) + v * step;
      const Value scaled = v * gamma;
      AUVEST_UNROLL
      for (int l = 0; l < O; ++l) {
        g(l, k) = (first ? Value(k == l ? 1 : 0) : g(l, k)) - scaled * f(l);
      }
    }
  }
  return finite && is_finite(posterior.nis);
}

/// Moves `belief` to the posterior of its coordinates; `root` becomes L G, a root of P_oo+. False
/// where the state would not be finite: a number is then untouched, a lane of a batch is lost.
template <int O, int U, class Value, int N>
AUVEST_OUTLINE AUVEST_INLINE math::Mask<Value> move_belief(Belief<Value, N>& belief,
                                                           Matrix<Value, O, O>& root,
                                                           const Matrix<Value, U, O>& slope,
                                                           const Posterior<Value, O>& posterior) {
  using math::any;
  using math::dot;
  Vector<Value, N> x;
  Vector<Value, O> shift;  // L y
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) {
    if (i < O) {
      shift(i) = dot(&root(i, 0), posterior.y.data(), i + 1);
      x(i) = belief.x(i) + shift(i);
    } else {
      x(i) = math::plus_dot(belief.x(i), &slope(i - O, 0), shift.data(), O);
    }
  }
  const math::Mask<Value> finite = math::all_finite(x);
  if (!any(finite)) return finite;
  math::copy(x, belief.x);

  // The observed states: P_oo = (L G)(L G)', in both triangles for what follows.
  AUVEST_UNROLL
  for (int i = 0; i < O; ++i) {
    Vector<Value, O> row;
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) row(k) = dot(&root(i, 0), &posterior.g(k, 0), i + 1);
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) root(i, k) = row(k);
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) {
      belief.P(i, j) = dot(&root(i, 0), &root(j, 0), O);
      belief.P(j, i) = belief.P(i, j);
    }
  }

  // The others, by their regression on the observed ones. What is left of a variance is at least
  // what the format resolves.
  AUVEST_UNROLL
  for (int i = O; i < N; ++i) {
    Vector<Value, O> change;  // row i of P_uo - P_uo+
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      const Value after = dot(&slope(i - O, 0), &belief.P(k, 0), O);
      change(k) = belief.P(i, k) - after;
      belief.P(i, k) = after;
    }
    const Value floor = math::pivot_floor(belief.P(i, i));
    AUVEST_UNROLL
    for (int j = O; j <= i; ++j) {
      belief.P(i, j) = math::minus_dot(belief.P(i, j), change.data(), &slope(j - O, 0), O);
    }
    belief.P(i, i) = math::larger(belief.P(i, i), floor);
  }
  return finite;
}

/// The update as a rule of GaussianFilter. Moves `belief`. `root` is L and `slope` is B of
/// math::factor_leading; `a` is A, and `noise` is E (lower triangle); all but `slope` are used up.
/// Fills S and nis from `correction.innovation`. Returns kNotPositiveDefinite if E is not positive
/// definite, kOverflow if the result would not be finite, and has not touched the belief then.
struct SquareRootUpdate {
  template <int M, int O, int U, class Scalar, int N>
  AUVEST_INLINE Status operator()(Belief<Scalar, N>& belief, Matrix<Scalar, O, O>& root,
                                  const Matrix<Scalar, U, O>& slope, Matrix<Scalar, M, O>& a,
                                  Matrix<Scalar, M, M>& noise,
                                  Correction<Scalar, M>& correction) const {
    innovation_covariance(a, noise, correction.S);
    if (!math::ldlt(noise)) return Status::kNotPositiveDefinite;
    Posterior<Scalar, O> posterior;
    if (!potter(a, noise, correction.innovation, posterior)) return Status::kOverflow;
    correction.nis = posterior.nis;
    return move_belief(belief, root, slope, posterior) ? Status::kOk : Status::kOverflow;
  }
};

}  // namespace auvest
