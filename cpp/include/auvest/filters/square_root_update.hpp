// The measurement update that every Gaussian filter of auvest shares, [UKF S1] to [UKF S6]
// (docs/algorithms/ukf.md).
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
inline namespace AUVEST_INSTRUCTIONS {

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

  Correction() {}  ///< to be filled by an update
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
  math::copy(noise, s);
  AUVEST_UNROLL
  for (int i = 0; i < M; ++i) {
    // [UKF S2]
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) s(i, j) = math::plus_dot(s(i, j), &a(i, 0), &a(j, 0), O);
  }
  math::mirror_lower(s);
}

/// The same for one number and two states, without loops.
template <class Value>
AUVEST_INLINE void innovation_covariance(const Matrix<Value, 1, 2>& a,
                                         const Matrix<Value, 1, 1>& noise, Matrix<Value, 1, 1>& s) {
  s(0, 0) = noise(0, 0) + a(0, 0) * a(0, 0) + a(0, 1) * a(0, 1);  // [UKF S2]
}

/// Potter's formula, one decorrelated measurement after the other. `noise` is E = U D U' as
/// math::ldlt leaves it. Uses up `a`; leaves the variances s on the diagonal of `noise`, whose
/// product is the determinant of S. False where the result would not be finite.
///
/// With `Independent` E is diagonal: nothing to decorrelate. The first measurement meets y = 0 and
/// G = I: batches leave out what these multiply. (Numbers do not: code costs flash.) Neither
/// changes a bit of a finite result: at most the signs of zeros in f, v and `surprise`, and what
/// these are added to is not -0.
template <bool Independent = false, class Value, int M, int O>
AUVEST_OUTLINE AUVEST_INLINE math::Mask<Value> potter(Matrix<Value, M, O>& a,
                                                      Matrix<Value, M, M>& noise,
                                                      const Vector<Value, M>& innovation,
                                                      Posterior<Value, O>& posterior) {
  using math::add_scaled;
  using math::is_finite;
  using math::sqrt;
  Vector<Value, O>& y = posterior.y;
  Matrix<Value, O, O>& g = posterior.g;
  math::set_zero(y);
  math::set_zero(g);
  AUVEST_UNROLL
  for (int k = 0; k < O; ++k) g(k, k) = Value(1);
  Vector<Value, M> residual;  // the innovation decorrelated
  posterior.nis = Value(0);
  math::Mask<Value> finite = is_finite(noise(0, 0));
  AUVEST_UNROLL
  for (int m = 0; m < M; ++m) {
    Value* const row = &a(m, 0);
    const bool first = !math::is_number<Value>() && m == 0;
    const int correlated = Independent ? 0 : m;
    residual(m) = math::minus_dot(innovation(m), &noise(m, 0), residual.data(), correlated);
    AUVEST_UNROLL
    for (int l = 0; l < correlated; ++l) add_scaled(-noise(m, l), &a(l, 0), row, O);
    Vector<Value, O> f;  // [UKF S3]: G' a
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) f(k) = first ? row[k] : math::dot(&g(k, 0), row, O);
    const Value spread = math::plus_dot(noise(m, m), f.data(), f.data(), O);
    const Value minus_gamma = Value(-1) / (spread + sqrt(noise(m, m) * spread));
    // f and with it all that follows from it is bounded by these two.
    finite = finite && is_finite(spread) && is_finite(minus_gamma);
    noise(m, m) = spread;
    const Value surprise = first ? residual(m) : math::minus_dot(residual(m), row, y.data(), O);
    const Value step = surprise / spread;
    posterior.nis = posterior.nis + step * surprise;  // [UKF S6]
    Vector<Value, O> v;                               // G f
    if (first) {
      v = f;
    } else {
      math::set_zero(v);
      AUVEST_UNROLL
      for (int k = 0; k < O; ++k) add_scaled(f(k), &g(k, 0), v.data(), O);
    }
    add_scaled(step, v.data(), y.data(), O);  // [UKF S3]
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) v(k) = v(k) * minus_gamma;
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) add_scaled(f(k), v.data(), &g(k, 0), O);  // [UKF S3]
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
  using math::larger;
  Vector<Value, N> x;
  Vector<Value, O> shift;  // L y
  AUVEST_UNROLL
  for (int i = 0; i < O; ++i) {
    shift(i) = dot(&root(i, 0), posterior.y.data(), i + 1);
    x(i) = belief.x(i) + shift(i);  // [UKF S4]
  }
  AUVEST_UNROLL
  for (int i = O; i < N; ++i) {
    x(i) = math::plus_dot(belief.x(i), &slope(i - O, 0), shift.data(), O);  // [UKF S5]
  }
  const math::Mask<Value> finite = math::all_finite(x);
  if (math::is_number<Value>() && !any(finite)) return finite;
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
      belief.P(i, j) = dot(&root(i, 0), &root(j, 0), O);  // [UKF S4]
      belief.P(j, i) = belief.P(i, j);
    }
  }

  // The others, by their regression on the observed ones. What is left of a variance is at least
  // what the format resolves.
  const Value* b = slope.data();
  AUVEST_UNROLL
  for (int i = O; i < N; ++i) {
    Value* const row = &belief.P(i, 0);
    Value change[O];  // row i of P_uo - P_uo+
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      const Value after = dot(b, &belief.P(k, 0), O);  // [UKF S5]
      change[k] = row[k] - after;
      row[k] = after;
    }
    const Value floor = math::pivot_floor(row[i]);
    const Value* other = slope.data();
    AUVEST_UNROLL
    for (int j = O; j <= i; ++j) {
      row[j] = math::minus_dot(row[j], change, other, O);  // [UKF S5]
      other += O;
    }
    row[i] = larger(row[i], floor);
    b += O;
  }
  return finite;
}

/// The update from S on: moves `belief` by the innovation and S of `correction`, and gives it the
/// NIS. `a` is A, `noise` is E (lower triangle); `root` and `slope` are those of
/// math::factor_leading. Uses up all but `slope`.
template <int M, int O, int U, class Scalar, int N>
AUVEST_INLINE Status correct_belief(Belief<Scalar, N>& belief, Matrix<Scalar, O, O>& root,
                                    const Matrix<Scalar, U, O>& slope, Matrix<Scalar, M, O>& a,
                                    Matrix<Scalar, M, M>& noise,
                                    Correction<Scalar, M>& correction) {
  if (!math::ldlt(noise)) return Status::kNotPositiveDefinite;
  Posterior<Scalar, O> posterior;
  if (!potter(a, noise, correction.innovation, posterior)) return Status::kOverflow;
  correction.nis = posterior.nis;
  return move_belief(belief, root, slope, posterior) ? Status::kOk : Status::kOverflow;
}

/// The same for one number seen through the only two states: a range. In the plane
/// |f|^2 I - f f' = g g' with g = (f_1, -f_0), so that I - f f' / s = (d I + g g') / s and
///
///     P+ = (d / s) P + u u' / s,   u = L g,
///
/// again a sum of squares on the diagonal, here without a root.
template <class Scalar>
AUVEST_OUTLINE AUVEST_INLINE Status correct_belief(
    Belief<Scalar, 2>& belief, Matrix<Scalar, 2, 2>& root, const Matrix<Scalar, 1, 2>&,
    Matrix<Scalar, 1, 2>& a, Matrix<Scalar, 1, 1>& noise, Correction<Scalar, 1>& correction) {
  if (!(noise(0, 0) > Scalar(0))) return Status::kNotPositiveDefinite;
  const Scalar innovation = correction.innovation(0);
  const Scalar spread = correction.S(0, 0);
  const Scalar inverse = Scalar(1) / spread;
  const Scalar step = innovation * inverse;
  const Scalar nis = step * innovation;  // [UKF S6]
  const Scalar f0 = a(0, 0);
  const Scalar f1 = a(0, 1);
  // [UKF S4]
  const Scalar x0 = belief.x(0) + root(0, 0) * f0 * step;
  const Scalar x1 = belief.x(1) + (root(1, 0) * f0 + root(1, 1) * f1) * step;
  const bool finite = math::is_finite(spread) && math::is_positive(inverse) &&
                      math::is_finite(nis) && math::is_finite(x0) && math::is_finite(x1);
  if (!finite) return Status::kOverflow;
  correction.nis = nis;
  belief.x(0) = x0;
  belief.x(1) = x1;
  const Scalar left = noise(0, 0) * inverse;
  const Scalar u0 = root(0, 0) * f1;
  const Scalar u1 = root(1, 0) * f1 - root(1, 1) * f0;
  const Scalar u1_scaled = u1 * inverse;
  belief.P(0, 0) = left * belief.P(0, 0) + u0 * (u0 * inverse);  // [UKF S4]
  belief.P(1, 0) = left * belief.P(1, 0) + u0 * u1_scaled;
  belief.P(0, 1) = belief.P(1, 0);
  belief.P(1, 1) = left * belief.P(1, 1) + u1 * u1_scaled;
  return Status::kOk;
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
    return correct_belief(belief, root, slope, a, noise, correction);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
