// The instruction sets in whose lanes runs or particles stand, one of them chosen at run time.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

// Lanes are there where xsimd is there to write them.
#if defined(__x86_64__) && __has_include(<xsimd/xsimd.hpp>)
#define AUVEST_VECTOR_LANES 1
#else
#define AUVEST_VECTOR_LANES 0
#endif

namespace auvest {
namespace bindings {

enum class InstructionSet : std::uint8_t { kScalar, kSse2, kAvx2, kAvx512 };

/// Names of those that run here, the widest last; of the particles of a SLATF in this precision.
std::vector<std::string> instruction_sets(bool single_precision);  // in bind_slat.cpp

}  // namespace bindings
}  // namespace auvest
