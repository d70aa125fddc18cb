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

namespace detail {

/// The posterior N(y, G G') of the coordinates, from the prior N(0, I): Potter's formula, one
/// decorrelated measurement after the other. Uses up `a` and `noise`; `g` is G'.
template <int M, int O, class Scalar>
AUVEST_OUTLINE AUVEST_INLINE Status potter(Matrix<Scalar, M, O>& a, Matrix<Scalar, M, M>& noise,
                                           Correction<Scalar, M>& correction, Vector<Scalar, O>& y,
                                           Matrix<Scalar, O, O>& g) {
  using math::dot;
  using math::minus_dot;
  using math::plus_dot;
  using math::sqrt;
  if (!math::ldlt(noise)) return Status::kNotPositiveDefinite;
  Vector<Scalar, M> residual;  // the innovation decorrelated
  correction.nis = Scalar(0);
  AUVEST_UNROLL
  for (int m = 0; m < M; ++m) {
    residual(m) = minus_dot(correction.innovation(m), &noise(m, 0), residual.data(), m);
    AUVEST_UNROLL
    for (int l = 0; l < m; ++l) {
      AUVEST_UNROLL
      for (int k = 0; k < O; ++k) a(m, k) = a(m, k) - noise(m, l) * a(l, k);
    }
    const bool first = m == 0;  // y = 0 and G = I
    Vector<Scalar, O> f;        // G' a
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) f(k) = first ? a(m, k) : dot(&g(k, 0), &a(m, 0), O);
    const Scalar spread = plus_dot(noise(m, m), f.data(), f.data(), O);
    const Scalar gamma = Scalar(1) / (spread + sqrt(noise(m, m) * spread));
    // f and with it all that follows from it is bounded by these two.
    if (!math::is_finite(spread) || !math::is_finite(gamma)) return Status::kOverflow;
    const Scalar surprise = first ? residual(m) : minus_dot(residual(m), &a(m, 0), y.data(), O);
    const Scalar step = surprise / spread;
    correction.nis = correction.nis + step * surprise;
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      Scalar v = f(k);  // G f
      if (!first) {
        v = g(0, k) * f(0);
        AUVEST_UNROLL
        for (int l = 1; l < O; ++l) v = v + g(l, k) * f(l);
      }
      y(k) = first ? v * step : y(k) + v * step;
      const Scalar scaled = v * gamma;
      AUVEST_UNROLL
      for (int l = 0; l < O; ++l) {
        g(l, k) = (first ? Scalar(k == l) : g(l, k)) - scaled * f(l);
      }
    }
  }
  return math::is_finite(correction.nis) ? Status::kOk : Status::kOverflow;
}

/// Moves `belief` to the posterior N(y, G G') of its coordinates (`g` is G'). kOverflow if the
/// state would not be finite; nothing has been touched then.
template <int O, int U, class Scalar, int N>
AUVEST_OUTLINE AUVEST_INLINE Status move_belief(Belief<Scalar, N>& belief,
                                                const Matrix<Scalar, O, O>& root,
                                                const Matrix<Scalar, U, O>& slope,
                                                const Vector<Scalar, O>& y,
                                                const Matrix<Scalar, O, O>& g) {
  using math::dot;
  Vector<Scalar, N> x;
  Vector<Scalar, O> shift;  // L y
  bool finite = true;
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) {
    if (i < O) {
      shift(i) = dot(&root(i, 0), y.data(), i + 1);
      x(i) = belief.x(i) + shift(i);
    } else {
      x(i) = math::plus_dot(belief.x(i), &slope(i - O, 0), shift.data(), O);
    }
    finite = finite && math::is_finite(x(i));
  }
  if (!finite) return Status::kOverflow;
  math::copy(x, belief.x);

  // The observed states: P_oo = (L G)(L G)', in both triangles for what follows.
  Matrix<Scalar, O, O> square;
  AUVEST_UNROLL
  for (int i = 0; i < O; ++i) {
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) square(i, k) = dot(&root(i, 0), &g(k, 0), i + 1);
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) {
      belief.P(i, j) = dot(&square(i, 0), &square(j, 0), O);
      belief.P(j, i) = belief.P(i, j);
    }
  }

  // The others, by their regression on the observed ones. What is left of a variance is at least
  // what the format resolves.
  AUVEST_UNROLL
  for (int i = O; i < N; ++i) {
    Vector<Scalar, O> change;  // row i of P_uo - P_uo+
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      const Scalar after = dot(&slope(i - O, 0), &belief.P(k, 0), O);
      change(k) = belief.P(i, k) - after;
      belief.P(i, k) = after;
    }
    const Scalar floor = math::pivot_floor(belief.P(i, i));
    AUVEST_UNROLL
    for (int j = O; j <= i; ++j) {
      belief.P(i, j) = math::minus_dot(belief.P(i, j), change.data(), &slope(j - O, 0), O);
    }
    if (belief.P(i, i) < floor) belief.P(i, i) = floor;
  }
  return Status::kOk;
}

}  // namespace detail

/// Updates `belief`. `root` is L and `slope` is B of math::factor_leading; `a` is A, and `noise` is
/// E (lower triangle); both are used up. Fills S and nis from `correction.innovation`. Returns
/// kNotPositiveDefinite if E is not positive definite, kOverflow if the result would not be finite,
/// and has not touched the belief then.
template <int M, int O, int U, class Scalar, int N>
AUVEST_INLINE Status square_root_update(Belief<Scalar, N>& belief, const Matrix<Scalar, O, O>& root,
                                        const Matrix<Scalar, U, O>& slope, Matrix<Scalar, M, O>& a,
                                        Matrix<Scalar, M, M>& noise,
                                        Correction<Scalar, M>& correction) {
  AUVEST_UNROLL
  for (int i = 0; i < M; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) {
      correction.S(i, j) = math::plus_dot(noise(i, j), &a(i, 0), &a(j, 0), O);
      correction.S(j, i) = correction.S(i, j);
    }
  }
  Vector<Scalar, O> y;
  Matrix<Scalar, O, O> g;
  const Status status = detail::potter(a, noise, correction, y, g);
  return status == Status::kOk ? detail::move_belief(belief, root, slope, y, g) : status;
}

}  // namespace auvest
