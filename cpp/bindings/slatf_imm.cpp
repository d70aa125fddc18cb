// SLATF with an Imm as Master, one particle at a time.
#include "slatf_lanes.hpp"

namespace auvest {
namespace bindings {

template <class Scalar>
struct LanesOf<InstructionSet::kScalar, Scalar> {
  using Type = OneLane<Scalar>;
};

template <class Motion>
using ImmSetup = SlatfSetup<Motion, ThreeModels<typename Motion::Scalar>>;

constexpr InstructionSet kSet = InstructionSet::kScalar;
template SlatfPointer<CompassMotion<float>> make_slatf<kSet>(const ImmSetup<CompassMotion<float>>&);
template SlatfPointer<UnicycleMotion<float>> make_slatf<kSet>(
    const ImmSetup<UnicycleMotion<float>>&);
template SlatfPointer<CompassMotion<double>> make_slatf<kSet>(
    const ImmSetup<CompassMotion<double>>&);
template SlatfPointer<UnicycleMotion<double>> make_slatf<kSet>(
    const ImmSetup<UnicycleMotion<double>>&);

}  // namespace bindings
}  // namespace auvest
