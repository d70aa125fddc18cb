// Decisions without branches, so that one text serves a number and a vector of numbers.
//
// A kernel that is written over `Value` runs with Value = float, double or, on the host, with a
// batch of floats that holds one particle per lane. Each lane does what the scalar code does. The
// mask of a comparison is a bool for a number and one bool per lane for a batch; both know && || !.
#pragma once

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

/// The number type inside a value: the value's own type, or that of a batch's lanes.
template <class Value>
struct ScalarOf {
  using Type = Value;
};

/// True if a value is one number, not a batch.
template <class Value>
constexpr bool is_number() {
  return sizeof(Value) == sizeof(typename ScalarOf<Value>::Type);
}

/// What a comparison of two values gives.
template <class Value>
using Mask = decltype(Value() < Value());

template <class Value>
AUVEST_INLINE Value select(bool condition, const Value& yes, const Value& no) {
  return condition ? yes : no;
}

/// True if a mask is true in one of its lanes, or in all of them. (Those of batches are xsimd's.)
AUVEST_INLINE bool any(bool mask) { return mask; }
AUVEST_INLINE bool all(bool mask) { return mask; }

/// `b` where b > a, `a` elsewhere; so `a` where one of them is NaN.
template <class Value>
AUVEST_INLINE Value larger(const Value& a, const Value& b) {
  return select(a < b, b, a);
}

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
