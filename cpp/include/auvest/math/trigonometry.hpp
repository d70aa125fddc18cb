// Sine, cosine and the four-quadrant arctangent.
//
// float: own implementations from + - * / and integer operations in one fixed order, so the bits
// are the same on every target; at most 2 ulp from the true value for every float.
// double: sine and cosine are <cmath>'s, the arctangent is a table and a polynomial (at most 2
// ulp). Where double has 32 bits, the double overloads are the float functions. Derivation and
// measured errors: docs/algorithms/math.md.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "auvest/config.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/bits.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {
namespace detail {

/// A fraction of a turn in units of 2^-64 turn.
struct Turn {
  uint32_t low, high;
};

#if defined(AUVEST_AVR_KERNELS)

// The functions of the other branch in assembler: firmware/library/src/avr_angle.S.
Turn fraction_of_turn(float x) __asm__("auvest_fraction_of_turn");
float turn_to_radian(Turn turn) __asm__("auvest_turn_to_radian");

#else

/// product = m a modulo 2^96, both of 12 bytes, most significant byte first. (By bytes: wider
/// integers take much flash on an 8-bit chip.)
inline void multiply(const uint8_t* a, uint32_t m, uint8_t* product) {
  for (uint8_t k = 0; k < 12; ++k) product[k] = 0;
  for (uint8_t j = 0; j < 4; ++j) {
    uint8_t carry = 0;
    for (uint8_t k = static_cast<uint8_t>(12 - j); k-- > 0;) {
      const uint8_t digit = static_cast<uint8_t>(m);
      const uint16_t sum = static_cast<uint16_t>(product[k] + a[k + j] * digit + carry);
      product[k] = static_cast<uint8_t>(sum);
      carry = static_cast<uint8_t>(sum >> 8);
    }
    m >>= 8;
  }
}

/// The integer of 4 bytes, most significant byte first.
AUVEST_OUTLINE inline uint32_t word_of(const uint8_t* bytes) {
  uint32_t word = 0;
  for (uint8_t i = 0; i < 4; ++i) word = (word << 8) | bytes[i];
  return word;
}

/// x / (2 pi) modulo 1 for a finite x >= 0.5. Error below 3 units.
///
/// x = m 2^e with a 24-bit integer m. Digits of 1/(2 pi) that meet m above the binary point make
/// whole turns and are skipped; 96 digits from there on leave 2^-64 of a turn after the product.
inline Turn fraction_of_turn(float x) {
  // 1/(2 pi), most significant byte first, after 24 zero bits (the shift of the smallest x).
  static const uint8_t kDigits[] = {0x00, 0x00, 0x00, 0x28, 0xbe, 0x60, 0xdb, 0x93, 0x91, 0x05,
                                    0x4a, 0x7f, 0x09, 0xd5, 0xf4, 0x7d, 0x4d, 0x37, 0x70, 0x36,
                                    0xd8, 0xa5, 0x66, 0x4f, 0x10, 0xe4, 0x10, 0x7f};
  const uint32_t bits = to_bits(x);
  const uint8_t first = static_cast<uint8_t>((bits >> 23) - 126u);  // first digit needed, 0..128
  const uint32_t m = ((bits & 0x007fffffu) | 0x00800000u) << (first & 7u);
  uint8_t product[12];
  multiply(kDigits + (first >> 3), m, product);
  return {word_of(product + 4), word_of(product)};
}

/// The angle, in rad, of a signed fraction of a turn that is not zero (no float comes closer to a
/// quarter turn than 1.6e-9 rad); rounded once, with an error below 0.54 ulp of the fraction.
inline float turn_to_radian(Turn turn) {
  static const uint8_t kTwoPi[12] = {0, 0, 0, 0, 0, 0, 0, 0, 0xc9, 0x0f, 0xda, 0xa2};  // 2^29 2 pi
  const uint32_t sign = turn.high & 0x80000000u;
  if (sign != 0) {  // the size, but for one unit
    turn.high = ~turn.high;
    turn.low = ~turn.low;
  }
  uint8_t exponent = 129;  // of 2^-1 turn = pi rad, before the product's own carry
  while ((turn.high & 0x80000000u) == 0) {
    turn.high = (turn.high << 1) | (turn.low >> 31);
    turn.low <<= 1;
    --exponent;
  }
  uint8_t bytes[12];
  multiply(kTwoPi, turn.high, bytes);
  uint32_t product = word_of(bytes + 4);  // the leading one is bit 31 or 30
  if ((product & 0x80000000u) == 0) {
    product <<= 1;
    --exponent;
  }
  // The rounding carry, if any, moves into the exponent, as it must.
  const uint32_t rounded = (product >> 8) + ((product & 0x80u) != 0 ? 1u : 0u);
  return from_bits(sign | ((static_cast<uint32_t>(exponent - 1) << 23) + rounded));
}

#endif

/// sin(x) for |x| <= pi/4. The sign of a zero is lost.
template <class Value>
AUVEST_INLINE Value sin_kernel(const Value& x) {
  const Value u = x * x;
  const Value p =
      Value(-1.66666552e-01f) + u * (Value(8.33218917e-03f) + u * Value(-1.95182845e-04f));
  return x + x * (u * p);
}

/// cos(x) for |x| <= pi/4.
template <class Value>
AUVEST_INLINE Value cos_kernel(const Value& x) {
  const Value u = x * x;
  const Value p =
      Value(4.16666456e-02f) + u * (Value(-1.38873095e-03f) + u * Value(2.44323273e-05f));
  return (Value(1) - Value(0.5f) * u) + (u * u) * p;
}

/// x - k pi/2 for the integer k nearest to x 2/pi, |x| <= 96; `shifted` has k in its last bits.
/// pi/2 in three parts: k times the first (18 bits) or the second (18 bits) is exact.
template <class Value>
AUVEST_INLINE Value reduce_near(const Value& x, Value& shifted) {
  const Value shift(12582912.0f);  // 1.5 * 2^23: adding it rounds to an integer
  shifted = x * Value(0.636619772f) + shift;
  const Value k = shifted - shift;
  const Value first = x - k * Value(1.57079315f);   // exact
  const Value second = k * Value(3.17493686e-06f);  // exact
  const Value high = first - second;
  const Value lost = (first - high) - second;
  return high + (lost - k * Value(2.56334407e-12f));
}

/// c[0] + c[1] u + c[2] u^2 + ... for an even count of coefficients, in pairs of neighbouring
/// terms: where they alternate in sign the sums stay small.
template <class Value>
AUVEST_INLINE Value paired_polynomial(const float* c, int count, Value u) {
  const Value v = u * u;
  c += count - 2;
  Value p = Value(c[0]) + u * Value(c[1]);
  AUVEST_UNROLL
  for (int i = 2; i < count; i += 2) {
    c -= 2;
    const Value pair = Value(c[0]) + u * Value(c[1]);
    p = pair + v * p;
  }
  return p;
}

/// P(z^2) of atan(z) = z + z^3 P(z^2), |z| <= 1, from u = z^2.
template <class Value>
AUVEST_INLINE Value atan_polynomial(const Value& u) {
  static const float kPolynomial[8] = {-3.33331525e-01f, 1.99937671e-01f,  -1.42110020e-01f,
                                       1.06657691e-01f,  -7.55166039e-02f, 4.32047322e-02f,
                                       -1.63631924e-02f, 2.91942270e-03f};
  return paired_polynomial(kPolynomial, 8, u);
}

/// The x in [-pi/4, pi/4] (plus a few ulp) and the number of quarter turns, modulo 4, that make up
/// a finite angle.
struct ReducedAngle {
  float angle_rad;
  uint8_t quarter;
};

/// For |x| <= 96.
AUVEST_INLINE ReducedAngle reduce_quarter_near(float x) {
  ReducedAngle reduced;
  float shifted;
  reduced.angle_rad = reduce_near(x, shifted);
  reduced.quarter = static_cast<uint8_t>(to_bits(shifted) & 3u);
  return reduced;
}

inline ReducedAngle reduce_quarter(float x) {
  const float size = absolute(x);
  if (size <= 96.0f) return reduce_quarter_near(x);
  Turn turn = fraction_of_turn(size);
  const uint32_t count = (turn.high + 0x20000000u) >> 30;
  turn.high -= count << 30;
  const float angle = turn_to_radian(turn);
  const bool negative = (to_bits(x) & 0x80000000u) != 0;
  ReducedAngle reduced;
  reduced.angle_rad = negative ? -angle : angle;
  reduced.quarter = static_cast<uint8_t>((negative ? 0u - count : count) & 3u);
  return reduced;
}

/// Sine and cosine of a reduced angle. The sign of a zero is lost.
AUVEST_INLINE void sincos_reduced(const ReducedAngle& r, float& s, float& c) {
  const float sine = sin_kernel(r.angle_rad);
  const float cosine = cos_kernel(r.angle_rad);
  const bool odd = (r.quarter & 1u) != 0;
  s = odd ? cosine : sine;
  c = odd ? sine : cosine;
  if ((r.quarter & 2u) != 0) s = -s;
  if (((r.quarter + 1u) & 2u) != 0) c = -c;
}

/// The double functions, by the size of double.
template <std::size_t Bytes>
struct DoubleTrigonometry {
  static_assert(Bytes == 8, "a double of 32 or 64 bits is expected");

  static double sin(double x) { return std::sin(x); }
  static double cos(double x) { return std::cos(x); }
  static void sincos(double x, double& s, double& c) {
    s = std::sin(x);
    c = std::cos(x);
  }

  static AUVEST_INLINE double atan2(double y, double x) {
    struct Parts {
      double high, low;
    };
    // atan(i / 32).
    static const Parts kAngle[33] = {{0.0, 0.0},
                                     {0.031239833430268277, -1.188442711587748e-18},
                                     {0.06241880999595735, -1.5490756308295046e-18},
                                     {0.09347678115858947, -6.2844725995420954e-18},
                                     {0.12435499454676144, -3.1253241424539383e-18},
                                     {0.15499674192394097, 9.585415594114324e-18},
                                     {0.18534794999569476, 4.180692268843079e-18},
                                     {0.21535769969773805, 4.738160130078733e-19},
                                     {0.24497866312686414, 1.0698755618734451e-17},
                                     {0.2741674511196588, 8.261353575163773e-18},
                                     {0.3028848683749714, -1.1010827903001369e-17},
                                     {0.3310960767041321, -7.952610375793799e-18},
                                     {0.35877067027057225, -2.4623815582638635e-17},
                                     {0.38588266939807375, 2.378822732491941e-17},
                                     {0.4124104415973873, -1.587652227770689e-17},
                                     {0.43833655985795783, -2.494277030626541e-17},
                                     {0.4636476090008061, 2.2698777452961687e-17},
                                     {0.48833395105640554, -1.1373236189329585e-17},
                                     {0.5123894603107377, -2.5462781472855804e-17},
                                     {0.5358112379604637, -4.0637956834825575e-18},
                                     {0.5585993153435624, -5.4556305485916264e-18},
                                     {0.5807563535676704, -1.441464378193067e-17},
                                     {0.6022873461349642, 2.950430737228402e-17},
                                     {0.6231993299340659, 2.672403885140095e-17},
                                     {0.6435011087932844, 1.5834785051444286e-17},
                                     {0.6632029927060933, -3.076054864429649e-17},
                                     {0.6823165548747481, 6.943223671560008e-18},
                                     {0.7008544078844502, -1.987626234335816e-17},
                                     {0.7188299996216245, -2.1478388444456983e-17},
                                     {0.7362574289814281, 3.473937648299457e-17},
                                     {0.7531512809621944, -2.4256934659182068e-17},
                                     {0.7695264804056583, -3.704991905602721e-17},
                                     {0.7853981633974483, 3.061616997868383e-17}};
    // By octant: 0, pi/2 or pi plus or minus atan(small / large).
    struct Octant {
      double high, low, sign, unused;
    };
    static const Octant kOctant[4] = {
        {0.0, 0.0, 1.0, 0.0},
        {1.57079632679489661923, 6.12323399573676604e-17, -1.0, 0.0},
        {3.14159265358979323846, 1.22464679914735321e-16, -1.0, 0.0},
        {1.57079632679489661923, 6.12323399573676604e-17, 1.0, 0.0},
    };
    const double size_x = absolute(x);
    const double size_y = absolute(y);
    const double small = size_x < size_y ? size_x : size_y;
    const double large = size_y > size_x ? size_y : size_x;
    const double ratio = small / large;
    if (!(ratio <= 1.0)) return std::atan2(y, x);  // 0/0, inf/inf and NaN
    // atan(ratio) = atan(c) + atan(z), c a multiple of 1/32, -1/128 <= z <= 3/128: below c = 1/32,
    // where atan(c) and a negative z would cancel, the interval of c = 0 reaches up to 3/128.
    const double kShift = 211106232532992.0;  // 1.5 * 2^47: adding it rounds to a multiple of 1/32
    const double shifted = (ratio - 0.0078125) + kShift;
    const double c = shifted - kShift;
    const double z = (ratio - c) / (1.0 + c * ratio);
    uint64_t bits;
    std::memcpy(&bits, &shifted, sizeof bits);
    const double u = z * z;
    const double p =
        -0.33333333333333276 +
        u * (0.19999999998980503 + u * (-0.14285708671535216 + u * 0.11098942039048114));
    const Parts& angle = kAngle[bits & 63u];
    const Octant& o = kOctant[(size_y > size_x ? 1u : 0u) + (x < 0.0 ? 2u : 0u)];
    const double tail = z + (angle.low + z * (u * p));
    return copy_sign((o.high + o.sign * angle.high) + (o.low + o.sign * tail), y);
  }
};

template <>
struct DoubleTrigonometry<4> {
  static double sin(double x);
  static double cos(double x);
  static void sincos(double x, double& s, double& c);
  static double atan2(double y, double x);
};

}  // namespace detail

/// sin(x), x in rad. Not finite: NaN.
inline float sin(float x) {
  const uint32_t size = to_bits(x) & 0x7fffffffu;
  if (size < 0x39800000u) return x;  // |x| < 2^-12
  if (size <= 0x3f490fdbu) return detail::sin_kernel(x);
  if (size >= 0x7f800000u) return quiet_nan();
  const detail::ReducedAngle r = detail::reduce_quarter(x);
  const float s =
      (r.quarter & 1u) != 0 ? detail::cos_kernel(r.angle_rad) : detail::sin_kernel(r.angle_rad);
  return (r.quarter & 2u) != 0 ? -s : s;
}

/// cos(x), x in rad. Not finite: NaN.
inline float cos(float x) {
  const uint32_t size = to_bits(x) & 0x7fffffffu;
  if (size <= 0x3f490fdbu) return detail::cos_kernel(x);
  if (size >= 0x7f800000u) return quiet_nan();
  const detail::ReducedAngle r = detail::reduce_quarter(x);
  const float c =
      (r.quarter & 1u) != 0 ? detail::sin_kernel(r.angle_rad) : detail::cos_kernel(r.angle_rad);
  return ((r.quarter + 1u) & 2u) != 0 ? -c : c;
}

/// s = sin(x), c = cos(x) for |x| <= 96: the same bits as the two functions, except that the sign
/// of a zero is lost.
AUVEST_INLINE void sincos_near(float x, float& s, float& c) {
  detail::sincos_reduced(detail::reduce_quarter_near(x), s, c);
}

/// s = sin(x), c = cos(x), the same bits as the two functions.
inline void sincos(float x, float& s, float& c) {
  const uint32_t size = to_bits(x) & 0x7fffffffu;
  if (size >= 0x7f800000u) {
    s = quiet_nan();
    c = quiet_nan();
    return;
  }
  detail::ReducedAngle r = {x, 0};
  if (size > 0x3f490fdbu) r = detail::reduce_quarter(x);
  detail::sincos_reduced(r, s, c);
  if (size < 0x39800000u) s = x;
}

/// The angle of the point (x, y) in rad, in [-pi, pi], with C99's results for signed zeros and
/// infinities. A NaN gives NaN.
AUVEST_OUTLINE AUVEST_INLINE float atan2(float y, float x) {
  const float size_x = absolute(x);
  const float size_y = absolute(y);
  // By octant: 0, pi/2 or pi plus or minus atan(z).
  float high = 0.0f;
  bool minus = false;
  if ((to_bits(x) & 0x80000000u) != 0) {
    high = 3.14159274f;
    minus = true;
  }
  float small = size_y;
  float large = size_x;
  if (size_y > size_x) {
    high = 1.57079637f;
    minus = !minus;
    small = size_x;
    large = size_y;
  }
  float z = small / large;
  if (is_nan(z)) {
    if (!(small == large)) return quiet_nan();
    z = to_bits(small) != 0 ? 1.0f : 0.0f;  // two infinities or two zeros
  } else if (leading(to_bits(z)) < leading(0x0d800000u) && to_bits(small) != 0) {  // 2^-100
    // Not every target rounds a subnormal quotient correctly.
    z = small / (large * 5.96046448e-08f) * 5.96046448e-08f;  // 2^-24
  }
  float tail = high * -2.78275338e-08f;  // what `high` lacks
  const float u = z * z;
  if (minus) z = -z;
  // Below 2^-12 z^3 / 3 is less than a sixth of an ulp of z; powers of z would become subnormal.
  if (u >= 5.96046448e-08f) tail = tail + z * (u * detail::atan_polynomial(u));
  return copy_sign((high + z) + tail, y);
}

inline double sin(double x) { return detail::DoubleTrigonometry<sizeof(double)>::sin(x); }
inline double cos(double x) { return detail::DoubleTrigonometry<sizeof(double)>::cos(x); }
inline void sincos(double x, double& s, double& c) {
  detail::DoubleTrigonometry<sizeof(double)>::sincos(x, s, c);
}
inline void sincos_near(double x, double& s, double& c) { sincos(x, s, c); }
AUVEST_INLINE double atan2(double y, double x) {
  return detail::DoubleTrigonometry<sizeof(double)>::atan2(y, x);
}

namespace detail {

inline double DoubleTrigonometry<4>::sin(double x) {
  return static_cast<double>(math::sin(static_cast<float>(x)));
}
inline double DoubleTrigonometry<4>::cos(double x) {
  return static_cast<double>(math::cos(static_cast<float>(x)));
}
inline void DoubleTrigonometry<4>::sincos(double x, double& s, double& c) {
  float sine, cosine;
  math::sincos(static_cast<float>(x), sine, cosine);
  s = static_cast<double>(sine);
  c = static_cast<double>(cosine);
}
inline double DoubleTrigonometry<4>::atan2(double y, double x) {
  return static_cast<double>(math::atan2(static_cast<float>(y), static_cast<float>(x)));
}

}  // namespace detail
}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
