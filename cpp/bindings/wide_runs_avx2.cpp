// Runs of filters side by side, 8 floats or 4 doubles in each register of AVX2.
#if defined(__x86_64__) && __has_include(<xsimd/xsimd.hpp>)

#include "desk/lane_steps.hpp"
#include "run_lanes.hpp"

namespace auvest {
namespace bindings {

template <>
desk::LaneSteps<float> run_lanes<InstructionSet::kAvx2>() {
  return lane_steps<xsimd::avx2, float>();
}

template <>
desk::LaneSteps<double> run_lanes<InstructionSet::kAvx2>() {
  return lane_steps<xsimd::avx2, double>();
}

}  // namespace bindings
}  // namespace auvest

#endif
