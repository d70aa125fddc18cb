// Steps of many runs in the lanes of an instruction set, each compiled in a file of its own.
#pragma once

#include "desk/lanes.hpp"
#include "instruction_sets.hpp"

namespace auvest {
namespace bindings {

/// In runs_sse2.cpp and wide_runs_<set>.cpp.
template <InstructionSet set, class Scalar>
desk::LaneSteps<Scalar> run_lanes();

}  // namespace bindings
}  // namespace auvest
