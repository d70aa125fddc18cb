// Two values side by side, each of which goes through the same operations: while one waits for a
// root or a quotient the processor works on the other. Value: a batch (simd.hpp), whose functions
// take a Twin as a batch of twice the width.
#pragma once

#include <cstdint>

#include "auvest/config.hpp"
#include "auvest/math/select.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

template <class Mask_>
struct TwinMask {
  Mask_ a, b;

  TwinMask() = default;
  AUVEST_INLINE TwinMask(const Mask_& first, const Mask_& second) : a(first), b(second) {}

  friend AUVEST_INLINE TwinMask operator&&(const TwinMask& x, const TwinMask& y) {
    return TwinMask(x.a && y.a, x.b && y.b);
  }
  friend AUVEST_INLINE TwinMask operator||(const TwinMask& x, const TwinMask& y) {
    return TwinMask(x.a || y.a, x.b || y.b);
  }
  AUVEST_INLINE TwinMask operator!() const { return TwinMask(!a, !b); }
  friend AUVEST_INLINE bool any(const TwinMask& x) { return any(x.a) || any(x.b); }
  friend AUVEST_INLINE bool all(const TwinMask& x) { return all(x.a) && all(x.b); }
};

/// Two words (32-bit unsigned integers, or batches of them).
template <class Word>
struct TwinWord {
  Word a, b;

  explicit AUVEST_INLINE TwinWord(uint32_t word) : a(word), b(word) {}
  AUVEST_INLINE TwinWord(const Word& first, const Word& second) : a(first), b(second) {}

  friend AUVEST_INLINE TwinWord operator+(const TwinWord& x, const TwinWord& y) {
    return TwinWord(x.a + y.a, x.b + y.b);
  }
  friend AUVEST_INLINE TwinWord operator^(const TwinWord& x, const TwinWord& y) {
    return TwinWord(x.a ^ y.a, x.b ^ y.b);
  }
  friend AUVEST_INLINE TwinWord operator&(const TwinWord& x, const TwinWord& y) {
    return TwinWord(x.a & y.a, x.b & y.b);
  }
  friend AUVEST_INLINE TwinWord operator|(const TwinWord& x, const TwinWord& y) {
    return TwinWord(x.a | y.a, x.b | y.b);
  }
  friend AUVEST_INLINE TwinWord operator<<(const TwinWord& x, int count) {
    return TwinWord(x.a << count, x.b << count);
  }
  friend AUVEST_INLINE TwinWord operator>>(const TwinWord& x, int count) {
    return TwinWord(x.a >> count, x.b >> count);
  }
  friend AUVEST_INLINE TwinWord rotate_left(const TwinWord& x, int count) {
    return TwinWord(rotate_left(x.a, count), rotate_left(x.b, count));
  }
};

template <class Value>
struct Twin {
  using TwinMask = math::TwinMask<Mask<Value>>;
  Value a, b;

  Twin() = default;
  AUVEST_INLINE Twin(float x) : a(x), b(x) {}  // implicit: a number is the same in both
  explicit AUVEST_INLINE Twin(double x) : a(x), b(x) {}
  explicit AUVEST_INLINE Twin(int x) : a(x), b(x) {}
  AUVEST_INLINE Twin(const Value& first, const Value& second) : a(first), b(second) {}

  friend AUVEST_INLINE Twin operator+(const Twin& x, const Twin& y) {
    return Twin(x.a + y.a, x.b + y.b);
  }
  friend AUVEST_INLINE Twin operator-(const Twin& x, const Twin& y) {
    return Twin(x.a - y.a, x.b - y.b);
  }
  friend AUVEST_INLINE Twin operator*(const Twin& x, const Twin& y) {
    return Twin(x.a * y.a, x.b * y.b);
  }
  friend AUVEST_INLINE Twin operator/(const Twin& x, const Twin& y) {
    return Twin(x.a / y.a, x.b / y.b);
  }
  AUVEST_INLINE Twin operator-() const { return Twin(-a, -b); }
  friend AUVEST_INLINE TwinMask operator<(const Twin& x, const Twin& y) {
    return TwinMask(x.a < y.a, x.b < y.b);
  }
  friend AUVEST_INLINE TwinMask operator>(const Twin& x, const Twin& y) {
    return TwinMask(x.a > y.a, x.b > y.b);
  }
  friend AUVEST_INLINE TwinMask operator<=(const Twin& x, const Twin& y) {
    return TwinMask(x.a <= y.a, x.b <= y.b);
  }
  friend AUVEST_INLINE TwinMask operator>=(const Twin& x, const Twin& y) {
    return TwinMask(x.a >= y.a, x.b >= y.b);
  }

  friend AUVEST_INLINE Twin select(const TwinMask& condition, const Twin& yes, const Twin& no) {
    return Twin(select(condition.a, yes.a, no.a), select(condition.b, yes.b, no.b));
  }
  friend AUVEST_INLINE Twin larger(const Twin& x, const Twin& y) {
    return Twin(larger(x.a, y.a), larger(x.b, y.b));
  }
  friend AUVEST_INLINE Twin smaller(const Twin& x, const Twin& y) {
    return Twin(smaller(x.a, y.a), smaller(x.b, y.b));
  }
  friend AUVEST_INLINE Twin sqrt(const Twin& x) { return Twin(sqrt(x.a), sqrt(x.b)); }
};

template <class Value>
struct ScalarOf<Twin<Value>> {
  using Type = typename ScalarOf<Value>::Type;
};

template <class Value>
AUVEST_INLINE auto to_bits(const Twin<Value>& x) -> TwinWord<decltype(to_bits(x.a))> {
  return TwinWord<decltype(to_bits(x.a))>(to_bits(x.a), to_bits(x.b));
}
template <class Word>
AUVEST_INLINE auto from_bits(const TwinWord<Word>& x) -> Twin<decltype(from_bits(x.a))> {
  return Twin<decltype(from_bits(x.a))>(from_bits(x.a), from_bits(x.b));
}
template <class Word>
AUVEST_INLINE auto to_float(const TwinWord<Word>& x) -> Twin<decltype(to_float(x.a))> {
  return Twin<decltype(to_float(x.a))>(to_float(x.a), to_float(x.b));
}
template <class Word>
AUVEST_INLINE auto ends_in_one(const TwinWord<Word>& x) -> TwinMask<decltype(ends_in_one(x.a))> {
  return TwinMask<decltype(ends_in_one(x.a))>(ends_in_one(x.a), ends_in_one(x.b));
}

template <class Value, int Rows, int Cols>
AUVEST_INLINE void split(const Matrix<Twin<Value>, Rows, Cols>& both, Matrix<Value, Rows, Cols>& a,
                         Matrix<Value, Rows, Cols>& b) {
  AUVEST_UNROLL
  for (int i = 0; i < Rows; ++i) {
    AUVEST_UNROLL
    for (int j = 0; j < Cols; ++j) {
      a(i, j) = both(i, j).a;
      b(i, j) = both(i, j).b;
    }
  }
}

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
