// make_slatf() for a file that says LanesOf and instantiates it, and for wide_<set>.cpp what takes
// its place there.
#pragma once

#include "slatf_setup.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <bindings::InstructionSet set, class Scalar>
struct LanesOf;  // ::Type
template <class Scalar>
struct LanesOf<bindings::InstructionSet::kScalar, Scalar> {
  using Type = OneLane<Scalar>;
};

template <class Lanes, class Setup>
SlatfInterface<typename Setup::Motion>* slatf_in(const Setup& setup) {
  using Motion = typename Setup::Motion;
  using Master = typename Setup::Master;
  constexpr int kMasters = bindings::kMostMasters;
  using First = Slatf1<Motion, Master, kMasters, AnyResampling, Lanes>;
  using Second = Slatf2<Motion, Master, kMasters, AnyResampling, Lanes>;
  if (setup.version == 1) return new SlatfModel<First>(setup);
  return new SlatfModel<Second>(setup);
}

template <bindings::InstructionSet set, class Motion, class Master>
SlatfInterface<Motion>* make_slatf(const SlatfSetup<Motion, Master>& setup) {
  return slatf_in<typename LanesOf<set, typename Motion::Scalar>::Type>(setup);
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
