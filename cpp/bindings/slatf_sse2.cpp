// SLATF with 4 particles in each register of SSE2.
#if defined(__x86_64__) && __has_include(<xsimd/xsimd.hpp>)

#include "auvest/particles/simd_lanes.hpp"  // before the filters, which find its functions
#include "slatf_lanes.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

constexpr auto kSet = bindings::InstructionSet::kSse2;

template <>
struct LanesOf<kSet, float> {
  using Type = SimdLanes<xsimd::sse2>;
};

template SlatfInterface<CompassMotion<float>>* make_slatf<kSet>(
    const SlatfSetup<CompassMotion<float>>&);
template SlatfInterface<UnicycleMotion<float>>* make_slatf<kSet>(
    const SlatfSetup<UnicycleMotion<float>>&);

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest

#endif
