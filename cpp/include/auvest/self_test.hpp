// Does this build keep the bits? Some milliseconds at start-up tell (18 on an ATmega2560).
//
// The headers promise the same float bits on every target, but the compiler's flags and the state
// of the floating-point unit are the user's. config.hpp refuses what the preprocessor can see; this
// finds the rest where it runs: probes that name a cause, then a short trace of the AUKF, near the
// station and away from it, against the bits that it must have.
//
// Flushed subnormals are a failure although no formula relies on a subnormal result: a covariance
// or a deviation that dies out passes through them, and the bits of that record would differ. A
// process comes to flush when any of its libraries was linked with -ffast-math.
//
// The test compiles what its caller compiles, with the caller's flags: call it from the source that
// runs the filter.
#pragma once

#include <cstdint>

#include "auvest/filters/aukf.hpp"
#include "auvest/math/bits.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// What a self-test looks at, in this order.
enum class SelfTestPart : std::uint8_t {
  kNone = 0,
  kRounding,     ///< sums are rounded to nearest, ties to even
  kExpression,   ///< expressions are computed as written, in float: not reordered, not wider
  kContraction,  ///< a product is rounded before it is added: no fused multiply-add
  kSubnormals,   ///< subnormal results and operands are not flushed to zero
  kMath,         ///< sin, cos and atan2 are the library's own
  kPrediction,   ///< golden trace: x and P after predict
  kCorrection,   ///< golden trace: innovation, S and NIS
  kUpdate,       ///< golden trace: x and P after update
  kInterval      ///< golden trace: interval after feedback
};

/// One line of English for each part that can fail, without a full stop.
inline const char* describe(SelfTestPart part) {
  switch (part) {
    case SelfTestPart::kNone:
      return "ok";
    case SelfTestPart::kRounding:
      return "sums are not rounded to nearest, ties to even";
    case SelfTestPart::kExpression:
      return "float expressions are reordered or kept in a wider type; compile without -ffast-math "
             "and its parts";
    case SelfTestPart::kContraction:
      return "products are fused into sums; compile with -ffp-contract=off";
    case SelfTestPart::kSubnormals:
      return "subnormal numbers are flushed to zero";
    case SelfTestPart::kMath:
      return "sin, cos or atan2 are not the library's own";
    case SelfTestPart::kPrediction:
      return "the prediction has other bits";
    case SelfTestPart::kCorrection:
      return "the innovation, its covariance or the NIS have other bits";
    case SelfTestPart::kUpdate:
      return "the updated estimate or its covariance have other bits";
    case SelfTestPart::kInterval:
      return "the interval has other bits";
  }
  return "unknown part";
}

struct SelfTestResult {
  SelfTestPart failed;  ///< the first part that failed, or kNone
  std::uint8_t index;   ///< of the probe that failed in it; for the golden trace its step, from 0

  bool ok() const { return failed == SelfTestPart::kNone; }
};

namespace detail {

/// The number, as the compiler cannot know it: nothing that follows is computed at compile time.
inline float hidden(float x) {
  volatile float value = x;
  return value;
}

inline float hidden_bits(std::uint32_t bits) {
  volatile std::uint32_t value = bits;
  return math::from_bits(value);
}

/// Hash of bit patterns (FNV-1a over words): one word that differs always changes it.
class BitHash {
 public:
  std::uint32_t value() const { return value_; }

  void add(std::uint32_t word) { value_ = (value_ ^ word) * 16777619u; }
  void add(float x) { add(math::to_bits(x)); }

  template <int Size>
  void add(const Matrix<float, Size, 1>& vector) {
    for (int i = 0; i < Size; ++i) add(vector(i));
  }

  template <int Size>
  void add_lower(const Matrix<float, Size, Size>& matrix) {
    for (int i = 0; i < Size; ++i) {
      for (int j = 0; j <= i; ++j) add(matrix(i, j));
    }
  }

 private:
  std::uint32_t value_ = 2166136261u;
};

inline SelfTestResult probe_arithmetic() {
  const float one = hidden(1.0f);
  const float ulp = hidden(1.1920929e-07f);       // of 1: 2^-23
  const float half_ulp = hidden(5.9604645e-08f);  // 2^-24
  const float above = one + ulp;
  // By their bits: a wider type would round here, when the sum is stored.
  const bool rounding[] = {
      math::to_bits(one + 0.5f * half_ulp) == math::to_bits(one),
      math::to_bits(one + 1.5f * half_ulp) == math::to_bits(above),
      math::to_bits(one + half_ulp) == math::to_bits(one),
      math::to_bits(above + half_ulp) == math::to_bits(above + ulp),
  };
  for (std::uint8_t i = 0; i < 4; ++i) {
    if (!rounding[i]) return SelfTestResult{SelfTestPart::kRounding, i};
  }
  const float nan = hidden_bits(0x7fc00000u);
  const bool expression[] = {
      (one + hidden(5.9604645e-08f)) - one == 0.0f,
      math::to_bits(hidden(5.0f) / 3.0f) == 0x3fd55555u,  // 5 (1/3) ends in 6
      math::to_bits(hidden_bits(0x80000000u) + 0.0f) == 0u,
      nan != nan,
  };
  for (std::uint8_t i = 0; i < 4; ++i) {
    if (!expression[i]) return SelfTestResult{SelfTestPart::kExpression, i};
  }
  // (1 + u)(1 - u) - 1 is 0 if the product is rounded, -u^2 if not.
  if (above * hidden(0.99999988f) - one != 0.0f) {
    return SelfTestResult{SelfTestPart::kContraction, 0};
  }
  const float least_normal = hidden_bits(0x00800000u);
  const float subnormal = hidden_bits(0x00400000u);
  if (math::to_bits(0.5f * least_normal) != 0x00400000u) {
    return SelfTestResult{SelfTestPart::kSubnormals, 0};
  }
  if (math::to_bits(2.0f * subnormal) != 0x00800000u) {
    return SelfTestResult{SelfTestPart::kSubnormals, 1};
  }
  return SelfTestResult{SelfTestPart::kNone, 0};
}

/// sin, cos and atan2 of angles of all sizes and quadrants.
inline std::uint32_t hash_of_math() {
  BitHash hash;
  float angle = hidden(0.3f);
  for (std::uint8_t i = 0; i < 4; ++i) {
    const float sine = math::sin(angle);
    const float cosine = math::cos(angle);
    hash.add(sine);
    hash.add(cosine);
    hash.add(math::atan2(sine * angle, cosine));
    angle = angle * -7.0f;
  }
  return hash.value();
}

/// The golden trace: the AUKF with the paper's alpha, first near the station, then away from it.
/// Calls sink(part, step, hash) for each part of each step until it returns false.
template <class Sink>
inline void golden_trace(Sink&& sink) {
  using Process = EulerAcceleration<float>;
  using Filter = Aukf<Process>;
  using Sensor = RangeBearing<float, 6>;
  Filter::Params points = Filter::default_params();
  points.alpha = hidden(1e-6f);
  Filter filter(Ukf<Process>(Process(), points));
  const Sensor sensor;
  Filter::State x0;
  Filter::Covariance p0;
  p0.setZero();
  for (int i = 0; i < 6; ++i) {
    x0(i) = hidden(1.1f) / static_cast<float>(i + 1);
    p0(i, i) = hidden(0.2f) / static_cast<float>(i + 1);
  }
  Status status = filter.reset(x0, p0);

  Sensor::Measurement z;
  Filter::Position reference;
  z(0) = hidden(1.6f);
  z(1) = hidden(-0.9f);
  reference(0) = x0(0);
  reference(1) = x0(1);
  for (std::uint8_t step = 0;; ++step) {
    const auto report = [&](SelfTestPart part, BitHash hash) {
      hash.add(static_cast<std::uint32_t>(status));
      return sink(part, step, hash.value());
    };
    status = filter.predict(filter.interval());
    BitHash predicted;
    predicted.add(filter.x());
    predicted.add_lower(filter.belief().P);
    if (!report(SelfTestPart::kPrediction, predicted)) return;

    const Correction<float, 2> correction = filter.update(z, sensor);
    status = correction.status;
    BitHash corrected;
    corrected.add(correction.innovation);
    corrected.add_lower(correction.S);
    corrected.add(correction.nis);
    if (!report(SelfTestPart::kCorrection, corrected)) return;

    BitHash updated;
    updated.add(filter.x());
    updated.add_lower(filter.belief().P);
    if (!report(SelfTestPart::kUpdate, updated)) return;

    z(0) = z(0) + 0.05f;
    z(1) = z(1) + 0.1f;
    reference(0) = reference(0) + 0.05f;
    reference(1) = reference(1) + 0.2f;
    status = filter.feedback(reference);
    BitHash chosen;
    chosen.add(filter.interval());
    if (!report(SelfTestPart::kInterval, chosen)) return;
  }
}

const std::uint8_t kGoldenSteps = 2;
const std::uint8_t kGoldenParts = 4;

// Written by `python -m firmware.parity.golden`.
const std::uint32_t kGoldenMath = 0xd99fb037u;

struct GoldenCheck {
  SelfTestResult result;

  bool operator()(SelfTestPart part, std::uint8_t step, std::uint32_t hash) {
    // Written by `python -m firmware.parity.golden`: a row per step.
    static const std::uint32_t kGolden[kGoldenSteps][kGoldenParts] = {
        {0xfe5319c1u, 0xb405a468u, 0x92e18d24u, 0xb5cc4215u},
        {0x9aab5f2du, 0x2538699au, 0x8d1af55bu, 0xec9f7f11u},
    };
    const int column = static_cast<int>(part) - static_cast<int>(SelfTestPart::kPrediction);
    if (hash != kGolden[step][column]) {
      result = SelfTestResult{part, step};
      return false;
    }
    return part != SelfTestPart::kInterval || step + 1 < kGoldenSteps;
  }
};

}  // namespace detail

/// Tells whether this build and this processor, as it is set up now, keep the library's bits.
AUVEST_OUTLINE inline SelfTestResult self_test() {
  const SelfTestResult arithmetic = detail::probe_arithmetic();
  if (!arithmetic.ok()) return arithmetic;
  if (detail::hash_of_math() != detail::kGoldenMath) {
    return SelfTestResult{SelfTestPart::kMath, 0};
  }
  detail::GoldenCheck check = {SelfTestResult{SelfTestPart::kNone, 0}};
  detail::golden_trace(check);
  return check.result;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
