// SLATF with an Imm as Master, one particle at a time.
#include "slatf_lanes.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

constexpr auto kSet = bindings::InstructionSet::kScalar;

template <class Scalar>
struct LanesOf<kSet, Scalar> {
  using Type = OneLane<Scalar>;
};

template <class Motion>
using Setup = SlatfSetup<Motion, ThreeModels<typename Motion::Scalar>>;

template SlatfInterface<CompassMotion<float>>* make_slatf<kSet>(const Setup<CompassMotion<float>>&);
template SlatfInterface<UnicycleMotion<float>>* make_slatf<kSet>(
    const Setup<UnicycleMotion<float>>&);
template SlatfInterface<CompassMotion<double>>* make_slatf<kSet>(
    const Setup<CompassMotion<double>>&);
template SlatfInterface<UnicycleMotion<double>>* make_slatf<kSet>(
    const Setup<UnicycleMotion<double>>&);

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
