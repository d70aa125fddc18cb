#include "sections.hpp"

#include <algorithm>

namespace auvest_board {

bool Sections::begin(int id, Cycle now, int stack_pointer) {
  Section& section = sections_[static_cast<size_t>(id)];
  if (section.open) return false;
  section.open = true;
  section.begun = now;
  section.stack_pointer = stack_pointer;
  return true;
}

bool Sections::end(int id, Cycle now) {
  Section& section = sections_[static_cast<size_t>(id)];
  if (!section.open) return false;
  section.open = false;
  section.cycles.push_back(now - section.begun);
  return true;
}

void Sections::reached(int lowest) {
  for (Section& section : sections_) {
    if (section.open) section.stack = std::max(section.stack, section.stack_pointer - lowest);
  }
}

}  // namespace auvest_board
