/// The report of a run as one line of JSON.
#pragma once

#include <cstdint>
#include <string>

#include "chip.hpp"

namespace auvest_board {

std::string report(const Chip& chip, const Outcome& outcome, uint32_t frequency);

}  // namespace auvest_board
