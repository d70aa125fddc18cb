// SLATF one particle at a time.
#include "slatf_lanes.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template SlatfInterface<CompassMotion<float>>* make_slatf<bindings::InstructionSet::kScalar>(
    const SlatfSetup<CompassMotion<float>>&);
template SlatfInterface<UnicycleMotion<float>>* make_slatf<bindings::InstructionSet::kScalar>(
    const SlatfSetup<UnicycleMotion<float>>&);
template SlatfInterface<CompassMotion<double>>* make_slatf<bindings::InstructionSet::kScalar>(
    const SlatfSetup<CompassMotion<double>>&);
template SlatfInterface<UnicycleMotion<double>>* make_slatf<bindings::InstructionSet::kScalar>(
    const SlatfSetup<UnicycleMotion<double>>&);

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
