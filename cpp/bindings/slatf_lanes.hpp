// make_slatf() for the file of one instruction set, which is compiled with the flags of that set,
// says LanesOf and instantiates make_slatf().
//
// Inline functions that do not carry the instruction set in their types are compiled in each of
// these files too, and the linker keeps the first it meets: files for the baseline must come before
// those for more (see CMakeLists.txt, which checks the module).
#pragma once

#include "slatf_setup.hpp"

namespace auvest {
namespace bindings {

template <InstructionSet set, class Scalar>
struct LanesOf;  // ::Type

template <InstructionSet set, class Motion, class Master>
SlatfPointer<Motion> make_slatf(const SlatfSetup<Motion, Master>& setup) {
  using Scalar = typename Motion::Scalar;
  using Lanes = typename LanesOf<set, Scalar>::Type;
  constexpr int kMasters = AnySlat<Scalar, Motion::kStates>::kMasters;
  using First = Slatf1<Motion, Master, kMasters, AnyResampling, Lanes>;
  using Second = Slatf2<Motion, Master, kMasters, AnyResampling, Lanes>;
  if (setup.version == 1) return SlatfPointer<Motion>(new SlatfModel<First>(setup));
  return SlatfPointer<Motion>(new SlatfModel<Second>(setup));
}

}  // namespace bindings
}  // namespace auvest
