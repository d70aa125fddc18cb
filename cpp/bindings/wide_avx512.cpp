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

using Lanes = SimdLanes<xsimd::avx512f>;

template <>
SlatInterface<float, 2>* make_wide_slatf<InstructionSet::kAvx512>(const void* setup) {
  return slatf_in<Lanes>(arrived<SlatfSetup<CompassMotion<float>>>(setup));
}

template <>
SlatInterface<float, 3>* make_wide_slatf<InstructionSet::kAvx512>(const void* setup) {
  return slatf_in<Lanes>(arrived<SlatfSetup<UnicycleMotion<float>>>(setup));
}

}  // namespace bindings
}  // namespace auvest

#endif
