// Keeps a covariance positive definite where an echo ends a long silence.
//
// The update of square_root_update.hpp takes the states that the sonar does not see from a
// difference, P_uu - (P_uo - P_uo+) B'. After hours without an echo the prediction is so large that
// what is left of it is below its last digit. With C = P_uu - B P_oo B', what the observed states
// do not say of the others and no echo changes,
//
//     P_uu+ = C + B P_oo+ B',
//
// a sum. So where C is lost in the rounding noise of the prediction its pivots are raised to that
// noise, which adds what the format cannot resolve, and the sum is formed anew.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/select.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The variances of the states from O on, before an update.
template <int O, class Value, int N>
AUVEST_INLINE Vector<Value, N - O> unseen_variances(const Matrix<Value, N, N>& P) {
  Vector<Value, N - O> variances;
  AUVEST_UNROLL
  for (int i = O; i < N; ++i) variances(i - O) = P(i, i);
  return variances;
}

namespace detail {

template <int O, class Value, int N, int U>
AUVEST_COLD void raise_lost_pivots(const Vector<Value, U>& before, const Matrix<Value, U, O>& slope,
                                   Matrix<Value, N, N>& P) {
  using math::any;
  using math::larger;
  using math::select;
  // The noise of the dozen roundings behind an element.
  const Value noise = Value(16) * math::machine_epsilon<Value>();
  Matrix<Value, U, U> l;  // of C = L D L', D on the diagonal
  Vector<Value, U> inverse;
  math::Mask<Value> lost = Value(1) < Value(0);
  AUVEST_UNROLL
  for (int i = 0; i < U; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j <= i; ++j) {
      Value c = math::minus_dot(P(O + i, O + j), &P(O + i, 0), &slope(j, 0), O);
      AUVEST_UNROLL
      for (int k = 0; k < j; ++k) c = c - l(i, k) * l(k, k) * l(j, k);
      l(i, j) = i == j ? c : Value(c * inverse(j));
    }
    const Value least = noise * before(i);
    const math::Mask<Value> gone = l(i, i) < least;
    lost = lost || gone;
    // Not so for masters that were not added; and what is left of a lost pivot's column is noise,
    // which divided by the pivot would be anything.
    const math::Mask<Value> there = l(i, i) > Value(0) && !gone;
    inverse(i) = select(there, Value(1) / select(there, l(i, i), Value(1)), Value(0));
    l(i, i) = larger(least, l(i, i));
  }
  if (!any(lost)) return;
  for (int i = 0; i < U; ++i) {
    for (int j = 0; j <= i; ++j) {
      Value p = math::dot(&P(O + i, 0), &slope(j, 0), O);
      for (int k = 0; k <= j; ++k) {
        p = p + (k == i ? l(k, k) : Value(l(i, k) * l(k, k))) * (k == j ? Value(1) : l(j, k));
      }
      P(O + i, O + j) = select(lost, p, P(O + i, O + j));
    }
  }
}

}  // namespace detail

/// After the update of a covariance with the variances `before` by what its first O states are
/// seen: `slope` is B of math::factor_leading(), of P the lower triangle is read. No bit changes
/// where nothing was lost.
template <int O, class Value, int N, int U>
AUVEST_INLINE void keep_definite(const Vector<Value, U>& before, const Matrix<Value, U, O>& slope,
                                 Matrix<Value, N, N>& P) {
  static_assert(U == N - O, "the states that are not seen");
  using math::any;
  math::Mask<Value> shrunk = before(0) > Value(1.25) * P(O, O);
  AUVEST_UNROLL
  for (int i = 1; i < U; ++i) shrunk = shrunk || before(i) > Value(1.25) * P(O + i, O + i);
  if (any(shrunk)) detail::raise_lost_pivots<O>(before, slope, P);
}

namespace detail {

/// Raises each variance v that is smaller than its covariances c with others, of variances w,
/// allow, c^2 <= v w, to the least that they do: it was lost in what it is a difference of. Of two
/// that do not go together the one that is further from going with all comes first.
template <class Scalar, int N>
AUVEST_COLD void raise_lost_variances(Matrix<Scalar, N, N>& P) {
  for (int pass = 0; pass < N; ++pass) {
    int lost = -1;
    Scalar smallest = Scalar(0);
    Scalar least = Scalar(0);
    for (int i = 0; i < N; ++i) {
      Scalar needed = Scalar(0);
      Scalar sum = Scalar(0);
      for (int j = 0; j < N; ++j) {
        if (j == i || !(P(j, j) > Scalar(0))) continue;
        const Scalar c = i > j ? P(i, j) : P(j, i);
        const Scalar by_other = c / P(j, j) * c;
        sum = sum + by_other;
        if (by_other > needed) needed = by_other;
      }
      if (!(P(i, i) < needed)) continue;
      const Scalar share = P(i, i) / sum;
      if (lost >= 0 && !(share < smallest)) continue;
      lost = i;
      smallest = share;
      least = needed;
    }
    if (lost < 0) return;
    P(lost, lost) = least;
  }
}

}  // namespace detail

/// Raises the variances of a covariance (lower triangle) by what its pivots lack to be more than
/// rounding noise. For slave and masters whose common drift is so large that what is known of one
/// relative to the other lies in the last digits. Where a variance would double, as of a matrix
/// that is indefinite beyond rounding, all grow by the same share first, the least that serves.
template <class Scalar, int N>
AUVEST_COLD void raise_pivots(Matrix<Scalar, N, N>& P) {
  const Scalar noise = Scalar(16) * math::machine_epsilon<Scalar>();
  detail::raise_lost_variances(P);
  for (Scalar share = noise;; share = Scalar(4) * share) {
    Matrix<Scalar, N, N> l;  // P = L D L', D on the diagonal
    Vector<Scalar, N> lack;
    bool moderate = true;
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j <= i; ++j) {
        Scalar c = P(i, j);
        for (int k = 0; k < j; ++k) c = c - l(i, k) * l(k, k) * l(j, k);
        const bool there = l(j, j) > Scalar(0);  // not so for masters that were not added
        l(i, j) = i == j ? c : there ? Scalar(c / l(j, j)) : Scalar(0);
      }
      lack(i) = noise * P(i, i) - l(i, i);
      if (lack(i) > Scalar(0)) {
        l(i, i) = l(i, i) + lack(i);
        moderate = moderate && lack(i) <= P(i, i);
      } else {
        lack(i) = Scalar(0);
      }
    }
    if (moderate || share > Scalar(1e6)) {
      for (int i = 0; i < N; ++i) P(i, i) = P(i, i) + lack(i);
      return;
    }
    for (int i = 0; i < N; ++i) P(i, i) = P(i, i) + share * P(i, i);
  }
}

/// The same for a covariance that is indefinite by more than rounding; no bit of others changes.
template <class Scalar, int N>
AUVEST_COLD void mend_indefinite(Matrix<Scalar, N, N>& P) {
  Matrix<Scalar, N, N> p = P;
  if (!math::ldlt(p)) raise_pivots(P);
}

/// Whether nothing is known of the heading, the third state of a pose: its sigma is beyond a turn.
/// The position then goes by multiples of that sigma, forth and back, and may end with a variance
/// that lies in the last digits of what it came from.
template <class Scalar, int Pose>
bool heading_is_open(const Matrix<Scalar, Pose, Pose>& P) {
  return Pose > 2 && !(P(Pose - 1, Pose - 1) < Scalar(40));
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
