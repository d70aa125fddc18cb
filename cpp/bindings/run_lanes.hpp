// Steps of many runs in the lanes of an instruction set, each compiled in a file of its own.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "desk/lanes.hpp"
#include "instruction_sets.hpp"

namespace auvest {
namespace bindings {

/// In runs_sse2.cpp and wide_runs_<set>.cpp.
template <InstructionSet set, class Scalar>
desk::LaneSteps<Scalar> run_lanes();

/// The steps of a set by its name, put into `steps`; null for none.
template <class Scalar>
const desk::LaneSteps<Scalar>* steps_of(const std::string& lanes, desk::LaneSteps<Scalar>& steps) {
  const std::vector<std::string> sets = instruction_sets(true);
  if (std::find(sets.begin(), sets.end(), lanes) == sets.end()) {
    throw std::invalid_argument("lanes must be one of slat_lanes(True)");
  }
#if AUVEST_VECTOR_LANES
  if (lanes == "sse2") steps = run_lanes<InstructionSet::kSse2, Scalar>();
  if (lanes == "avx2") steps = run_lanes<InstructionSet::kAvx2, Scalar>();
  if (lanes == "avx512") steps = run_lanes<InstructionSet::kAvx512, Scalar>();
#endif
  return lanes == "scalar" ? nullptr : &steps;
}

}  // namespace bindings
}  // namespace auvest
