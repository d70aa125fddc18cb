// The functions of this folder on batches of numbers (xsimd), lane by lane the bits of the scalar
// ones. Host only.
//
// Polynomials and reductions are the scalar code's own templates. What is rare there (infinities,
// NaN, subnormals, angles beyond 96 rad) goes lane by lane through the scalar function.
#pragma once

#include <cfloat>
#include <cstdint>
#include <type_traits>
#include <xsimd/xsimd.hpp>

#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/select.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/math/twin.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

/// One 32-bit unsigned integer per lane.
template <class Arch>
struct WordBatch {
  using Batch = xsimd::batch<uint32_t, Arch>;
  Batch v;

  WordBatch() = default;
  explicit AUVEST_INLINE WordBatch(uint32_t word) : v(word) {}
  explicit AUVEST_INLINE WordBatch(const Batch& words) : v(words) {}

  friend AUVEST_INLINE WordBatch operator+(const WordBatch& a, const WordBatch& b) {
    return WordBatch(Batch(a.v + b.v));
  }
  friend AUVEST_INLINE WordBatch operator^(const WordBatch& a, const WordBatch& b) {
    return WordBatch(Batch(a.v ^ b.v));
  }
  friend AUVEST_INLINE WordBatch operator&(const WordBatch& a, const WordBatch& b) {
    return WordBatch(Batch(a.v & b.v));
  }
  friend AUVEST_INLINE WordBatch operator|(const WordBatch& a, const WordBatch& b) {
    return WordBatch(Batch(a.v | b.v));
  }
  friend AUVEST_INLINE WordBatch operator<<(const WordBatch& a, int count) {
    return WordBatch(Batch(a.v << count));
  }
  friend AUVEST_INLINE WordBatch operator>>(const WordBatch& a, int count) {
    return WordBatch(Batch(a.v >> count));
  }
};

/// One number per lane: FloatBatch and DoubleBatch.
template <class Number_, class Arch>
struct NumberBatch {
  using Number = Number_;
  using Batch = xsimd::batch<Number, Arch>;
  using Mask = xsimd::batch_bool<Number, Arch>;
  static constexpr int kWidth = static_cast<int>(Batch::size);
  Batch v;

  NumberBatch() = default;
  AUVEST_INLINE NumberBatch(Number x) : v(x) {}  // implicit: a number is the same in all lanes
  /// Of another type of number.
  template <class Other, class = typename std::enable_if<std::is_arithmetic<Other>::value &&
                                                         !std::is_same<Other, Number>::value>::type>
  explicit AUVEST_INLINE NumberBatch(Other x) : v(static_cast<Number>(x)) {}
  explicit AUVEST_INLINE NumberBatch(const Batch& x) : v(x) {}

  friend AUVEST_INLINE NumberBatch operator+(const NumberBatch& a, const NumberBatch& b) {
    return NumberBatch(Batch(a.v + b.v));
  }
  friend AUVEST_INLINE NumberBatch operator-(const NumberBatch& a, const NumberBatch& b) {
    return NumberBatch(Batch(a.v - b.v));
  }
  friend AUVEST_INLINE NumberBatch operator*(const NumberBatch& a, const NumberBatch& b) {
    return NumberBatch(Batch(a.v * b.v));
  }
  friend AUVEST_INLINE NumberBatch operator/(const NumberBatch& a, const NumberBatch& b) {
    return NumberBatch(Batch(a.v / b.v));
  }
  /// With the sign of zero, as a number's. (xsimd's, for AVX-512, is 0 - v.)
  AUVEST_INLINE NumberBatch operator-() const { return NumberBatch(Batch(v ^ Batch(-Number(0)))); }
  friend AUVEST_INLINE Mask operator<(const NumberBatch& a, const NumberBatch& b) {
    return a.v < b.v;
  }
  friend AUVEST_INLINE Mask operator>(const NumberBatch& a, const NumberBatch& b) {
    return a.v > b.v;
  }
  friend AUVEST_INLINE Mask operator<=(const NumberBatch& a, const NumberBatch& b) {
    return a.v <= b.v;
  }
  friend AUVEST_INLINE Mask operator>=(const NumberBatch& a, const NumberBatch& b) {
    return a.v >= b.v;
  }
};

template <class Arch>
using FloatBatch = NumberBatch<float, Arch>;
template <class Arch>
using DoubleBatch = NumberBatch<double, Arch>;

template <class Number, class Arch>
struct ScalarOf<NumberBatch<Number, Arch>> {
  using Type = Number;
};

template <class Number, class Arch>
AUVEST_INLINE NumberBatch<Number, Arch> select(const xsimd::batch_bool<Number, Arch>& condition,
                                               const NumberBatch<Number, Arch>& yes,
                                               const NumberBatch<Number, Arch>& no) {
  return NumberBatch<Number, Arch>(xsimd::select(condition, yes.v, no.v));
}

/// One instruction; a NaN gives what the general larger() gives.
template <class Number, class Arch>
AUVEST_INLINE NumberBatch<Number, Arch> larger(const NumberBatch<Number, Arch>& a,
                                               const NumberBatch<Number, Arch>& b) {
  return NumberBatch<Number, Arch>(xsimd::max(b.v, a.v));
}

/// `b` where b < a, `a` elsewhere; so `a` where one of them is NaN.
template <class Number, class Arch>
AUVEST_INLINE NumberBatch<Number, Arch> smaller(const NumberBatch<Number, Arch>& a,
                                                const NumberBatch<Number, Arch>& b) {
  return NumberBatch<Number, Arch>(xsimd::min(b.v, a.v));
}

template <class Number, class Arch>
AUVEST_INLINE NumberBatch<Number, Arch> sqrt(const NumberBatch<Number, Arch>& x) {
  return NumberBatch<Number, Arch>(xsimd::sqrt(x.v));
}

template <class Arch>
AUVEST_INLINE WordBatch<Arch> to_bits(const FloatBatch<Arch>& x) {
  return WordBatch<Arch>(xsimd::bitwise_cast<xsimd::batch<uint32_t, Arch>>(x.v));
}
template <class Arch>
AUVEST_INLINE FloatBatch<Arch> from_bits(const WordBatch<Arch>& bits) {
  return FloatBatch<Arch>(xsimd::bitwise_cast<xsimd::batch<float, Arch>>(bits.v));
}
/// The float of an integer below 2^31.
template <class Arch>
AUVEST_INLINE FloatBatch<Arch> to_float(const WordBatch<Arch>& word) {
  return FloatBatch<Arch>(
      xsimd::to_float(xsimd::bitwise_cast<xsimd::batch<int32_t, Arch>>(word.v)));
}

/// The lanes of odd numbers.
template <class Arch>
AUVEST_INLINE Mask<FloatBatch<Arch>> ends_in_one(const WordBatch<Arch>& word) {
  using Integers = xsimd::batch<int32_t, Arch>;
  const Integers last = xsimd::bitwise_cast<Integers>((word & WordBatch<Arch>(1u)).v);
  return xsimd::bool_cast(last == Integers(1));
}

template <class Arch>
AUVEST_INLINE WordBatch<Arch> rotate_left(const WordBatch<Arch>& x, int count) {
  return (x << count) | (x >> (32 - count));
}

// From here on a Value is a FloatBatch or a Twin.

namespace detail {

/// The scalar function of each lane, or of each pair of lanes.
template <class Number, class Arch, class Function>
AUVEST_COLD NumberBatch<Number, Arch> lane_by_lane(const NumberBatch<Number, Arch>& x,
                                                   Function function) {
  alignas(64) Number lanes[NumberBatch<Number, Arch>::kWidth];
  x.v.store_aligned(lanes);
  for (Number& lane : lanes) lane = function(lane);
  return NumberBatch<Number, Arch>(xsimd::batch<Number, Arch>::load_aligned(lanes));
}
template <class Number, class Arch, class Function>
AUVEST_COLD NumberBatch<Number, Arch> lane_by_lane(const NumberBatch<Number, Arch>& x,
                                                   const NumberBatch<Number, Arch>& y,
                                                   Function function) {
  using Value = NumberBatch<Number, Arch>;
  alignas(64) Number lanes_x[Value::kWidth];
  alignas(64) Number lanes_y[Value::kWidth];
  x.v.store_aligned(lanes_x);
  y.v.store_aligned(lanes_y);
  for (int i = 0; i < Value::kWidth; ++i) lanes_x[i] = function(lanes_x[i], lanes_y[i]);
  return Value(xsimd::batch<Number, Arch>::load_aligned(lanes_x));
}
template <class Batch, class Function>
AUVEST_INLINE Twin<Batch> lane_by_lane(const Twin<Batch>& x, Function function) {
  return Twin<Batch>(lane_by_lane(x.a, function), lane_by_lane(x.b, function));
}
template <class Batch, class Function>
AUVEST_INLINE Twin<Batch> lane_by_lane(const Twin<Batch>& x, const Twin<Batch>& y,
                                       Function function) {
  return Twin<Batch>(lane_by_lane(x.a, y.a, function), lane_by_lane(x.b, y.b, function));
}

/// The words of a batch, or of two side by side.
template <class Value>
struct WordOf;
template <class Arch>
struct WordOf<FloatBatch<Arch>> {
  using Type = WordBatch<Arch>;
};
template <class Batch>
struct WordOf<Twin<Batch>> {
  using Type = TwinWord<typename WordOf<Batch>::Type>;
};

}  // namespace detail

template <class Value>
using WordOf = typename detail::WordOf<Value>::Type;

/// The upper 24 bits of a word as a fraction in [0, 1).
template <class Value>
AUVEST_INLINE Value fraction_of(const WordOf<Value>& word) {
  return to_float(word >> 8) * Value(5.9604644775390625e-08f);  // 2^-24
}

template <class Value, class = WordOf<Value>>
AUVEST_INLINE Value absolute(const Value& x) {
  return from_bits(to_bits(x) & WordOf<Value>(0x7fffffffu));
}
template <class Value, class = WordOf<Value>>
AUVEST_INLINE Mask<Value> is_finite(const Value& x) {
  return absolute(x) <= Value(FLT_MAX);
}
template <class Value, class = WordOf<Value>>
AUVEST_INLINE Value copy_sign(const Value& x, const Value& y) {
  return from_bits((to_bits(x) & WordOf<Value>(0x7fffffffu)) |
                   (to_bits(y) & WordOf<Value>(0x80000000u)));
}

template <class Value, class = WordOf<Value>>
AUVEST_INLINE Value exp_normal(const Value& x) {
  Value shifted;
  const Value e = detail::exp_kernel(x, shifted);
  return from_bits(to_bits(e) + (to_bits(shifted) << 23));  // of its bits only k is left
}

template <class Value, class = WordOf<Value>>
AUVEST_INLINE Value exp(const Value& x) {
  if (!all(x >= Value(-87.0f) && x <= Value(88.7228317f))) {
    return detail::lane_by_lane(x, [](float lane) { return math::exp(lane); });
  }
  return exp_normal(x);
}

template <class Value, class = WordOf<Value>>
AUVEST_INLINE Value log_normal(const Value& x) {
  using Word = WordOf<Value>;
  const Word bits = to_bits(x) + Word(0x3f800000u - 0x3f3504f3u);
  const Value m = from_bits((bits & Word(0x007fffffu)) + Word(0x3f3504f3u));
  return detail::log_kernel(m, Value(to_float(bits >> 23) - Value(127.0f)));
}

template <class Value, class = WordOf<Value>>
AUVEST_INLINE Value log(const Value& x) {
  if (!all(x >= Value(1.17549435e-38f) && x <= Value(3.40282347e+38f))) {
    return detail::lane_by_lane(x, [](float lane) { return math::log(lane); });
  }
  return log_normal(x);
}

template <class Value, class = WordOf<Value>>
AUVEST_INLINE void sincos_near(const Value& x, Value& s, Value& c) {
  using Word = WordOf<Value>;
  // Up to pi/4, where the scalar code does not reduce, k is 0 and nothing is subtracted.
  Value shifted;
  const Value angle = detail::reduce_near(x, shifted);
  const Word quarter = to_bits(shifted);
  const Value sine = detail::sin_kernel(angle);
  const Value cosine = detail::cos_kernel(angle);
  const Mask<Value> odd = ends_in_one(quarter);
  const Word sign_s = (quarter << 30) & Word(0x80000000u);
  const Word sign_c = ((quarter + Word(1u)) << 30) & Word(0x80000000u);
  s = from_bits(to_bits(select(odd, cosine, sine)) ^ sign_s);
  c = from_bits(to_bits(select(odd, sine, cosine)) ^ sign_c);
}

template <class Value, class = WordOf<Value>>
AUVEST_INLINE void sincos(const Value& x, Value& s, Value& c) {
  const Value size = absolute(x);
  if (!all(size <= Value(96.0f))) {
    s = detail::lane_by_lane(x, [](float lane) { return math::sin(lane); });
    c = detail::lane_by_lane(x, [](float lane) { return math::cos(lane); });
    return;
  }
  sincos_near(x, s, c);
  s = select(size < Value(2.44140625e-04f), x, s);  // 2^-12
}

template <class Value, class = WordOf<Value>>
AUVEST_INLINE Value atan2(const Value& y, const Value& x) {
  const Value zero(0.0f);
  const Value size_x = absolute(x);
  const Value size_y = absolute(y);
  const auto steep = size_y > size_x;
  const Value ratio = smaller(size_y, size_x) / larger(size_x, size_y);  // NaN if one is
  if (!all(ratio >= Value(7.88860905e-31f) && ratio <= Value(1.0f))) {   // 2^-100
    return detail::lane_by_lane(y, x, [](float a, float b) { return math::atan2(a, b); });
  }
  const auto left = x < zero;
  const Value high = select(steep, Value(1.57079637f), select(left, Value(3.14159274f), zero));
  const Value low =
      select(steep, Value(-4.37113883e-08f), select(left, Value(-8.74227766e-08f), zero));
  const Value rising = select(steep, -ratio, ratio);
  const Value z = select(left, -rising, rising);
  const Value u = ratio * ratio;
  const Value bent = low + z * (u * detail::atan_polynomial(u));
  const Value tail = select(ratio >= Value(2.44140625e-04f), bent, low);  // 2^-12
  return copy_sign(Value((high + z) + tail), y);
}

template <class Value, class = WordOf<Value>>
AUVEST_INLINE Value wrap(const Value& a) {
  const Mask<Value> inside = a > Value(-pi<float>()) && a <= Value(pi<float>());
  if (all(inside)) return a;
  const Value size = absolute(a);
  if (!all(size <= Value(9.424777f))) {
    return detail::lane_by_lane(a, [](float lane) { return math::wrap(lane); });
  }
  const Value turned = (size - Value(6.28318548f)) + Value(1.74845553e-07f);
  const Value signed_turn = select(a < Value(0.0f), -turned, turned);
  const Value outside = select(size > Value(pi<float>()), signed_turn, size);  // -pi: +pi
  return select(inside, a, outside);
}

// Doubles: what is not in the processor goes lane by lane through the scalar function.

template <class Arch>
AUVEST_INLINE DoubleBatch<Arch> absolute(const DoubleBatch<Arch>& x) {
  using Batch = typename DoubleBatch<Arch>::Batch;
  return DoubleBatch<Arch>(Batch(x.v ^ (x.v & Batch(-0.0))));
}
template <class Arch>
AUVEST_INLINE Mask<DoubleBatch<Arch>> is_finite(const DoubleBatch<Arch>& x) {
  return absolute(x) <= DoubleBatch<Arch>(DBL_MAX);
}
template <class Arch>
AUVEST_INLINE void sincos_near(const DoubleBatch<Arch>& x, DoubleBatch<Arch>& s,
                               DoubleBatch<Arch>& c) {
  constexpr int kWidth = DoubleBatch<Arch>::kWidth;
  alignas(64) double angles[kWidth];
  alignas(64) double sines[kWidth];
  alignas(64) double cosines[kWidth];
  x.v.store_aligned(angles);
  for (int i = 0; i < kWidth; ++i) {
    if (i > 0 && angles[i] == angles[i - 1] && angles[i] != 0.0) {  // often all are alike
      sines[i] = sines[i - 1];
      cosines[i] = cosines[i - 1];
    } else {
      math::sincos(angles[i], sines[i], cosines[i]);
    }
  }
  s = DoubleBatch<Arch>(xsimd::batch<double, Arch>::load_aligned(sines));
  c = DoubleBatch<Arch>(xsimd::batch<double, Arch>::load_aligned(cosines));
}
template <class Arch>
AUVEST_INLINE void sincos(const DoubleBatch<Arch>& x, DoubleBatch<Arch>& s, DoubleBatch<Arch>& c) {
  sincos_near(x, s, c);
}
template <class Arch>
AUVEST_INLINE DoubleBatch<Arch> atan2(const DoubleBatch<Arch>& y, const DoubleBatch<Arch>& x) {
  return detail::lane_by_lane(y, x, [](double a, double b) { return math::atan2(a, b); });
}
template <class Arch>
AUVEST_INLINE DoubleBatch<Arch> wrap(const DoubleBatch<Arch>& a) {
  using Value = DoubleBatch<Arch>;
  if (all(a > Value(-pi<double>()) && a <= Value(pi<double>()))) return a;
  return detail::lane_by_lane(a, [](double lane) { return math::wrap(lane); });
}

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
