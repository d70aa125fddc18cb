// As many particles at once as the vector registers of an instruction set hold: SimdLanes<Arch>
// with an architecture of xsimd, such as xsimd::avx2. The same bits as OneLane<float>. Host only.
//
// The file that uses it must be compiled for that instruction set.
#pragma once

// Before the filters, which find these functions by their arguments.
#include "auvest/math/simd.hpp"
#include "auvest/math/twin.hpp"
#include "auvest/particles/lanes.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Two groups of lanes, of which the second lies `Stride` numbers behind the first.
template <class Lanes, int Stride>
struct TwinLanes {
  using Scalar = typename Lanes::Scalar;
  using Value = math::Twin<typename Lanes::Value>;
  using Word = math::TwinWord<typename Lanes::Word>;

  static AUVEST_INLINE Value load(const Scalar* from) {
    return Value(Lanes::load(from), Lanes::load(from + Stride));
  }
  static AUVEST_INLINE void store(Scalar* to, const Value& value) {
    Lanes::store(to, value.a);
    Lanes::store(to + Stride, value.b);
  }
  static AUVEST_INLINE Word index(int first) {
    return Word(Lanes::index(first), Lanes::index(first + Lanes::kWidth));
  }
};

template <class Arch>
struct SimdLanes {
  using Scalar = float;
  using Value = math::FloatBatch<Arch>;
  using Word = math::WordBatch<Arch>;
  static constexpr int kWidth = Value::kWidth;
  static constexpr bool kPairs = true;
  template <int Stride>
  using Pair = TwinLanes<SimdLanes, Stride>;
  static_assert(kBlock % kWidth == 0, "a block holds whole groups of lanes");

  static AUVEST_INLINE Value load(const float* from) {
    return Value(xsimd::batch<float, Arch>::load_unaligned(from));
  }
  static AUVEST_INLINE void store(float* to, const Value& value) { value.v.store_unaligned(to); }
  static AUVEST_INLINE void prefetch(const float* from) { __builtin_prefetch(from, 1); }

  static AUVEST_INLINE Word index(int first) {
    alignas(64) static const uint32_t kCount[kBlock] = {0, 1, 2,  3,  4,  5,  6,  7,
                                                        8, 9, 10, 11, 12, 13, 14, 15};
    return Word(static_cast<uint32_t>(first)) +
           Word(xsimd::batch<uint32_t, Arch>::load_aligned(kCount));
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
