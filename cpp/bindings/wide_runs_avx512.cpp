// Runs of filters side by side, 16 floats or 8 doubles in each register of AVX-512.
#if defined(__x86_64__) && __has_include(<xsimd/xsimd.hpp>)

#if !defined(__clang__)  // GCC bug 105593 in its own intrinsics
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include "desk/lane_steps.hpp"
#include "run_lanes.hpp"

namespace auvest {
namespace bindings {

template <>
desk::LaneSteps<float> run_lanes<InstructionSet::kAvx512>() {
  return lane_steps<xsimd::avx512f, float>();
}

template <>
desk::LaneSteps<double> run_lanes<InstructionSet::kAvx512>() {
  return lane_steps<xsimd::avx512f, double>();
}

}  // namespace bindings
}  // namespace auvest

#endif
