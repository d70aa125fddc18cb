// A Gaussian mixture: one Gaussian per particle, in consecutive fields of a ParticleSet: N means,
// then the lower triangle of the covariance, row by row. Without covariances: points.
#pragma once

#include "auvest/config.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/select.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/particles/lanes.hpp"
#include "auvest/particles/weighted_means.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Numbers in the lower triangle of an n x n matrix.
constexpr int triangle_numbers(int n) { return n * (n + 1) / 2; }

/// Reads the means of the particles of one group of lanes; `from` is the first's first field.
template <class Lanes, class Value, int N>
AUVEST_INLINE void load_mean(const typename Lanes::Scalar* from, Vector<Value, N>& x) {
  AUVEST_UNROLL
  for (int k = 0; k < N; ++k) x(k) = Lanes::load(from + k * kBlock);
}

template <class Lanes, class Value, int N>
AUVEST_INLINE void store_mean(typename Lanes::Scalar* to, const Vector<Value, N>& x) {
  AUVEST_UNROLL
  for (int k = 0; k < N; ++k) Lanes::store(to + k * kBlock, x(k));
}

/// Reads a lower triangle; `from` is the first's first element.
template <class Lanes, class Value, int N>
AUVEST_INLINE void load_covariance(const typename Lanes::Scalar* from, Matrix<Value, N, N>& p) {
  AUVEST_UNROLL
  for (int k = 0; k < N; ++k) {
    AUVEST_UNROLL
    for (int l = 0; l <= k; ++l, from += kBlock) p(k, l) = Lanes::load(from);
  }
}

template <class Lanes, class Value, int N>
AUVEST_INLINE void load_belief(const typename Lanes::Scalar* from, Belief<Value, N>& belief) {
  load_mean<Lanes>(from, belief.x);
  load_covariance<Lanes>(from + N * kBlock, belief.P);
}

template <class Lanes, class Value, int N>
AUVEST_INLINE void store_belief(typename Lanes::Scalar* to, const Belief<Value, N>& belief) {
  store_mean<Lanes>(to, belief.x);
  int offset = N * kBlock;
  AUVEST_UNROLL
  for (int k = 0; k < N; ++k) {
    AUVEST_UNROLL
    for (int l = 0; l <= k; ++l, offset += kBlock) Lanes::store(to + offset, belief.P(k, l));
  }
}

namespace detail {

/// By value: the caller's own belief stays in registers.
template <class Lanes, class Value, int N>
AUVEST_COLD void store_lanes(math::Mask<Value> where, typename Lanes::Scalar* to,
                             Belief<Value, N> belief) {
  Belief<Value, N> stored;
  load_belief<Lanes>(to, stored);
  math::copy_where(where, belief, stored);
  store_belief<Lanes>(to, stored);
}

}  // namespace detail

/// Stores the belief in the lanes of `where` only: mostly all.
template <class Lanes, class Value, int N>
AUVEST_INLINE void store_belief_where(const math::Mask<Value>& where, typename Lanes::Scalar* to,
                                      const Belief<Value, N>& belief) {
  using math::all;
  if (all(where)) {
    store_belief<Lanes>(to, belief);
  } else if (!math::is_number<Value>()) {
    detail::store_lanes<Lanes>(where, to, belief);
  }
}

/// The means of K fields, each about the first particle's number, in one pass over no other fields.
template <class Lanes, int K, class Set>
void mean_fields(const Set& set, const int (&fields)[K], typename Set::Scalar (&mean)[K]) {
  using Scalar = typename Set::Scalar;
  using Value = typename Lanes::Value;
  constexpr int kAhead = 16;  // blocks, read so sparsely that no cache foresees it
  Scalar origin[K];
  for (int k = 0; k < K; ++k) origin[k] = *set.at(0, fields[k]);
  weighted_means<Lanes>(
      set,
      [&](int i, Value(&q)[K]) {
        for (int k = 0; k < K; ++k) {
          const Scalar* number = set.at(i, fields[k]);
          q[k] = Lanes::load(number) - Value(origin[k]);
          Lanes::prefetch(number + kAhead * Set::kFields * kBlock);
        }
      },
      mean);
  for (int k = 0; k < K; ++k) mean[k] = origin[k] + mean[k];
}

/// Calls f(at, k, l) for `count` numbers of the lower triangle of an N x N matrix from number
/// `first` on.
template <int N, class Function>
AUVEST_INLINE void for_part(int first, int count, const Function& f) {
  int at = 0;
  for (int k = 0; k < N; ++k) {
    for (int l = 0; l <= k; ++l, ++at) {
      if (at >= first && at < first + count) f(at, k, l);
    }
  }
}

/// Mean and covariance of the mixture in the fields from `field` on. With `Angle` the last of the N
/// components is an angle [rad], whose mean is that of unit vectors.
template <class Lanes, int N, bool Covariances, bool Angle, class Set>
Belief<typename Set::Scalar, N> summarise(const Set& set, int field) {
  using Scalar = typename Set::Scalar;
  using Value = typename Lanes::Value;
  using math::sincos;
  using math::wrap;
  // Deviations from the first particle, so that large numbers cost no digits.
  Vector<Scalar, N> origin;
  for (int k = 0; k < N; ++k) origin(k) = *set.at(0, field + k);
  Scalar mean[N + 1];  // the angle's as cosine and sine
  weighted_means<Lanes>(
      set,
      [&](int i, Value(&q)[N + 1]) {
        Vector<Value, N> x;
        load_mean<Lanes>(set.at(i, field), x);
        for (int k = 0; k < N; ++k) q[k] = x(k) - Value(origin(k));
        q[N] = Value(0);
        if (Angle) sincos(Value(x(N - 1) - Value(origin(N - 1))), q[N], q[N - 1]);
      },
      mean);
  Belief<Scalar, N> belief;
  for (int k = 0; k < N; ++k) belief.x(k) = origin(k) + mean[k];
  if (Angle) {
    belief.x(N - 1) = math::wrap(Scalar(origin(N - 1) + math::atan2(mean[N], mean[N - 1])));
  }

  // In parts: the sums of the 21 numbers of a master would take twice the stack of all else.
  constexpr int kTriangle = triangle_numbers(N);
  constexpr int kPart = kTriangle % 7 == 0 ? 7 : kTriangle;
  for (int part = 0; part < kTriangle; part += kPart) {
    Scalar covariance[kPart];
    weighted_means<Lanes>(
        set,
        [&](int i, Value(&q)[kPart]) {
          const Scalar* from = set.at(i, field);
          Vector<Value, N> x;
          load_mean<Lanes>(from, x);
          for (int k = 0; k < N; ++k) x(k) = x(k) - Value(belief.x(k));
          if (Angle) x(N - 1) = wrap(Value(x(N - 1)));
          for_part<N>(part, kPart, [&](int at, int k, int l) {
            q[at - part] = x(k) * x(l);
            if (Covariances) {
              q[at - part] = q[at - part] + Lanes::load(from + (N + at) * kBlock);
            }
          });
        },
        covariance);
    for_part<N>(part, kPart, [&](int at, int k, int l) {
      belief.P(k, l) = belief.P(l, k) = covariance[at - part];
    });
  }
  return belief;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
