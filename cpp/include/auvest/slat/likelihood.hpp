// What an echo is worth: the density of its innovation, and the gate beyond which it is worth
// nothing.
#pragma once

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/select.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// log N(innovation; 0, S) + M/2 log(2 pi) of [SLATF 31] from what potter() leaves; never below
/// -1e20, nor a NaN. -1e20 where `valid` is false.
template <class Value, int O, int M>
AUVEST_INLINE Value log_density(const math::Mask<Value>& valid,
                                const Posterior<Value, O>& posterior,
                                const Matrix<Value, M, M>& variances) {
  using math::larger;
  using math::log;
  using math::select;
  const Value least = Value(-1e20);
  Value determinant = variances(0, 0);
  AUVEST_UNROLL
  for (int m = 1; m < M; ++m) determinant = determinant * variances(m, m);
  const Value density = Value(-0.5) * (posterior.nis + log(determinant));  // [SLATF 31]
  return select(valid, larger(least, density), least);
}

/// A measurement beyond the gate says nothing: where the NIS exceeds `gate`, y = 0, G = I and the
/// NIS is the gate, so that its density, too, falls no further.
template <class Value, int O>
AUVEST_INLINE void saturate(const Value& gate, Posterior<Value, O>& posterior) {
  using math::select;
  const math::Mask<Value> inside = !(posterior.nis > gate);
  posterior.nis = select(inside, posterior.nis, gate);
  AUVEST_UNROLL
  for (int i = 0; i < O; ++i) {
    posterior.y(i) = select(inside, posterior.y(i), Value(0));
    AUVEST_UNROLL
    for (int j = 0; j < O; ++j) {
      posterior.g(i, j) = select(inside, posterior.g(i, j), Value(i == j ? 1 : 0));
    }
  }
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
