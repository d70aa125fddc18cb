// The measurement update that every Gaussian filter of auvest shares.
//
// Let P = L L' + [0 0; 0 Schur] with L the first O columns of its Cholesky factor: they carry all
// that a measurement of the first O states can see. In the coordinates of L the prior is N(0, I),
// and a filter describes its measurement as
//
//     innovation = A' y + e,   y ~ N(0, I),   e ~ N(0, E),   so that S = A' A + E.
//
// The EKF has A = (H L)' and E = R; the UKF has the t_i of its sigma points in the rows of A and
// the rest of P_yy in E (sigma_points.hpp). The update decorrelates E = U D U', then takes one
// scalar measurement of variance d after the other with Potter's square-root formula
//
//     G <- G (I - gamma f f'),  f = G' a,  s = f'f + d,  gamma = 1 / (s + sqrt(d s))
//
// and forms P = (L G)(L G)' + [0 0; 0 Schur]. That equals P - K S K', but a square cannot turn
// negative: no Joseph form is needed, and 32 bits serve where P - K S K' needs 64. The NIS comes
// out as a sum of squares, sum r^2 / s, which equals innovation' S^-1 innovation.
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

  explicit Correction(Status s) : status(s), near_field(false), nis(Scalar(0)) {
    for (int i = 0; i < M; ++i) {
      innovation(i) = Scalar(0);
      for (int j = 0; j < M; ++j) S(i, j) = Scalar(0);
    }
  }
};

/// Updates `belief`, whose P holds the factor left by math::partial_cholesky<O>.
/// `noise` is E (lower triangle), `a` is A. Fills S and nis from `correction.innovation`; returns
/// kNotPositiveDefinite if E is not positive definite.
template <int M, int O, class Scalar, int N>
inline Status square_root_update(Belief<Scalar, N>& belief, const Matrix<Scalar, O, M>& a,
                                 Matrix<Scalar, M, M> noise, Correction<Scalar, M>& correction) {
  using math::sqrt;
  AUVEST_UNROLL
  for (int i = 0; i < M; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) {
      Scalar sum = noise(i, j);
      AUVEST_UNROLL
      for (int k = 0; k < O; ++k) sum = sum + a(k, i) * a(k, j);
      correction.S(i, j) = sum;
      correction.S(j, i) = sum;
    }
  }
  if (!math::ldlt(noise)) return Status::kNotPositiveDefinite;

  // Potter, one decorrelated measurement after the other; y and G live in the coordinates of L.
  Vector<Scalar, O> y;
  Matrix<Scalar, O, O> g;
  Matrix<Scalar, O, M> b;      // columns: A decorrelated
  Vector<Scalar, M> residual;  // the innovation decorrelated
  correction.nis = Scalar(0);
  AUVEST_UNROLL
  for (int m = 0; m < M; ++m) {
    residual(m) = correction.innovation(m);
    AUVEST_UNROLL
    for (int l = 0; l < m; ++l) residual(m) = residual(m) - noise(m, l) * residual(l);
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      b(k, m) = a(k, m);
      AUVEST_UNROLL
      for (int l = 0; l < m; ++l) b(k, m) = b(k, m) - noise(m, l) * b(k, l);
    }

    Vector<Scalar, O> f;  // G' b
    Vector<Scalar, O> v;  // G f
    Scalar surprise = residual(m);
    Scalar spread = noise(m, m);
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      f(k) = b(k, m);
      if (m > 0) {
        f(k) = g(0, k) * b(0, m);
        AUVEST_UNROLL
        for (int l = 1; l < O; ++l) f(k) = f(k) + g(l, k) * b(l, m);
        surprise = surprise - b(k, m) * y(k);
      }
      spread = spread + f(k) * f(k);
    }
    const Scalar gamma = Scalar(1) / (spread + sqrt(noise(m, m) * spread));
    const Scalar step = surprise / spread;
    correction.nis = correction.nis + step * surprise;
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      v(k) = f(k);
      if (m > 0) {
        v(k) = g(k, 0) * f(0);
        AUVEST_UNROLL
        for (int l = 1; l < O; ++l) v(k) = v(k) + g(k, l) * f(l);
      }
      y(k) = m > 0 ? y(k) + v(k) * step : v(k) * step;
      AUVEST_UNROLL
      for (int l = 0; l < O; ++l) {
        const Scalar shrink = v(k) * (gamma * f(l));
        const Scalar before = m > 0 ? g(k, l) : (k == l ? Scalar(1) : Scalar(0));
        g(k, l) = before - shrink;
      }
    }
  }

  // Back to the state: x += L y, P = (L G)(L G)' + Schur.
  Matrix<Scalar, N, O> root;
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) {
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      Scalar sum = belief.P(i, 0) * g(0, k);
      AUVEST_UNROLL
      for (int l = 1; l < O && l <= i; ++l) sum = sum + belief.P(i, l) * g(l, k);
      root(i, k) = sum;
    }
    Scalar shift = belief.P(i, 0) * y(0);
    AUVEST_UNROLL
    for (int l = 1; l < O && l <= i; ++l) shift = shift + belief.P(i, l) * y(l);
    belief.x(i) = belief.x(i) + shift;
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) {
      Scalar sum = root(i, 0) * root(j, 0);
      AUVEST_UNROLL
      for (int k = 1; k < O; ++k) sum = sum + root(i, k) * root(j, k);
      belief.P(i, j) = j < O ? sum : belief.P(i, j) + sum;
    }
  }
  return Status::kOk;
}

}  // namespace auvest
