// SLATF one particle at a time.
#include "slatf_lanes.hpp"

namespace auvest {
namespace bindings {

template <class Scalar>
struct LanesOf<InstructionSet::kScalar, Scalar> {
  using Type = OneLane<Scalar>;
};

constexpr InstructionSet kSet = InstructionSet::kScalar;
template SlatfPointer<CompassMotion<float>> make_slatf<kSet>(
    const SlatfSetup<CompassMotion<float>>&);
template SlatfPointer<UnicycleMotion<float>> make_slatf<kSet>(
    const SlatfSetup<UnicycleMotion<float>>&);
template SlatfPointer<CompassMotion<double>> make_slatf<kSet>(
    const SlatfSetup<CompassMotion<double>>&);
template SlatfPointer<UnicycleMotion<double>> make_slatf<kSet>(
    const SlatfSetup<UnicycleMotion<double>>&);

}  // namespace bindings
}  // namespace auvest
