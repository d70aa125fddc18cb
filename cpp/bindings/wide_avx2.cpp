// SLATF with 8 particles in each register of AVX2.
#if defined(__x86_64__) && __has_include(<xsimd/xsimd.hpp>)

#include "auvest/particles/simd_lanes.hpp"  // before the filters, which find its functions
#include "slatf_lanes.hpp"

namespace auvest {
namespace bindings {

using Lanes = SimdLanes<xsimd::avx2>;

template <>
SlatInterface<float, 2>* make_wide_slatf<InstructionSet::kAvx2>(const void* setup) {
  return slatf_in<Lanes>(arrived<SlatfSetup<CompassMotion<float>>>(setup));
}

template <>
SlatInterface<float, 3>* make_wide_slatf<InstructionSet::kAvx2>(const void* setup) {
  return slatf_in<Lanes>(arrived<SlatfSetup<UnicycleMotion<float>>>(setup));
}

}  // namespace bindings
}  // namespace auvest

#endif
