// SlatfJoint for Python: with room for one master, or for all.
#include "slatf_setup.hpp"

namespace auvest {
namespace bindings {

template <class Motion>
SlatfPointer<Motion> make_slatf_joint(const SlatfJointSetup<Motion>& setup) {
  using Master = PiecewiseAcceleration<typename Motion::Scalar>;
  constexpr int kMasters = AnySlat<typename Motion::Scalar, Motion::kStates>::kMasters;
  using One = SlatfJoint<Motion, Master, 1, AnyResampling>;
  using All = SlatfJoint<Motion, Master, kMasters, AnyResampling>;
  if (setup.max_masters == 1) return SlatfPointer<Motion>(new SlatfModel<One>(setup));
  return SlatfPointer<Motion>(new SlatfModel<All>(setup));
}

template SlatfPointer<CompassMotion<float>> make_slatf_joint(
    const SlatfJointSetup<CompassMotion<float>>&);
template SlatfPointer<UnicycleMotion<float>> make_slatf_joint(
    const SlatfJointSetup<UnicycleMotion<float>>&);
template SlatfPointer<CompassMotion<double>> make_slatf_joint(
    const SlatfJointSetup<CompassMotion<double>>&);
template SlatfPointer<UnicycleMotion<double>> make_slatf_joint(
    const SlatfJointSetup<UnicycleMotion<double>>&);

}  // namespace bindings
}  // namespace auvest
