// SLATF with an Imm as Master, one particle at a time.
#include "slatf_lanes.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Motion>
using ImmSetup = SlatfSetup<Motion, ThreeModels<typename Motion::Scalar>>;

template SlatfInterface<CompassMotion<float>>* make_slatf<bindings::InstructionSet::kScalar>(
    const ImmSetup<CompassMotion<float>>&);
template SlatfInterface<UnicycleMotion<float>>* make_slatf<bindings::InstructionSet::kScalar>(
    const ImmSetup<UnicycleMotion<float>>&);
template SlatfInterface<CompassMotion<double>>* make_slatf<bindings::InstructionSet::kScalar>(
    const ImmSetup<CompassMotion<double>>&);
template SlatfInterface<UnicycleMotion<double>>* make_slatf<bindings::InstructionSet::kScalar>(
    const ImmSetup<UnicycleMotion<double>>&);

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
