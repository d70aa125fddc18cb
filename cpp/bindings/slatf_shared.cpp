// SlatfShared for Python: with room for one master, or for all.
#include "slatf_setup.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Motion>
SlatfInterface<Motion>* make_slatf_shared(const SlatfSharedSetup<Motion>& setup) {
  using Master = PiecewiseAcceleration<typename Motion::Scalar>;
  constexpr int kMasters = bindings::kMostMasters;
  using One = SlatfShared<Motion, Master, 1, AnyResampling>;
  using All = SlatfShared<Motion, Master, kMasters, AnyResampling>;
  if (setup.max_masters == 1) return new SlatfModel<One>(setup);
  return new SlatfModel<All>(setup);
}

template SlatfInterface<CompassMotion<float>>* make_slatf_shared(
    const SlatfSharedSetup<CompassMotion<float>>&);
template SlatfInterface<UnicycleMotion<float>>* make_slatf_shared(
    const SlatfSharedSetup<UnicycleMotion<float>>&);
template SlatfInterface<CompassMotion<double>>* make_slatf_shared(
    const SlatfSharedSetup<CompassMotion<double>>&);
template SlatfInterface<UnicycleMotion<double>>* make_slatf_shared(
    const SlatfSharedSetup<UnicycleMotion<double>>&);

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
