// SLATF with 16 particles in each register of AVX-512.
#if defined(__x86_64__) && __has_include(<xsimd/xsimd.hpp>)

#if !defined(__clang__)  // GCC bug 105593 in its own intrinsics
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include "auvest/particles/simd_lanes.hpp"  // before the filters, which find its functions
#include "slatf_lanes.hpp"

namespace auvest {
namespace bindings {

template <>
struct LanesOf<InstructionSet::kAvx512, float> {
  using Type = SimdLanes<xsimd::avx512f>;
};

template SlatfPointer<CompassMotion<float>> make_slatf<InstructionSet::kAvx512>(
    const SlatfSetup<CompassMotion<float>>&);
template SlatfPointer<UnicycleMotion<float>> make_slatf<InstructionSet::kAvx512>(
    const SlatfSetup<UnicycleMotion<float>>&);

}  // namespace bindings
}  // namespace auvest

#endif
