/// Cycles and stack of the sections that a program marks with board::begin and board::end.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "simavr.hpp"

namespace auvest_board {

constexpr int kMaxSection = 100;

struct Section {
  std::vector<Cycle> cycles;  ///< of each pass
  int stack = 0;              ///< deepest, bytes below the stack pointer at the beginning

  bool open = false;
  Cycle begun = 0;
  int stack_pointer = 0;  ///< at the beginning
};

class Sections {
 public:
  /// False if the section is open already.
  bool begin(int id, Cycle now, int stack_pointer);
  /// False if it is not open.
  bool end(int id, Cycle now);
  /// The stack pointer was as low as this since the last call: all open sections went that deep.
  void reached(int lowest);

  const Section& operator[](int id) const { return sections_[static_cast<size_t>(id)]; }

 private:
  std::array<Section, kMaxSection + 1> sections_;
};

}  // namespace auvest_board
