// SLATF with 4 particles in each register of SSE2.
#if defined(__x86_64__) && __has_include(<xsimd/xsimd.hpp>)

#include "auvest/particles/simd_lanes.hpp"  // before the filters, which find its functions
#include "slatf_lanes.hpp"

namespace auvest {
namespace bindings {

template <>
struct LanesOf<InstructionSet::kSse2, float> {
  using Type = SimdLanes<xsimd::sse2>;
};

template SlatfPointer<CompassMotion<float>> make_slatf<InstructionSet::kSse2>(
    const SlatfSetup<CompassMotion<float>>&);
template SlatfPointer<UnicycleMotion<float>> make_slatf<InstructionSet::kSse2>(
    const SlatfSetup<UnicycleMotion<float>>&);

}  // namespace bindings
}  // namespace auvest

#endif
