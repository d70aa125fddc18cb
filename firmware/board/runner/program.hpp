/// The program to run: an ELF file for an AVR, with the symbols that bound its memory.
#pragma once

#include <cstdint>
#include <string>

#include "simavr.hpp"

namespace auvest_board {

class Program {
 public:
  /// Throws std::runtime_error if the file is not an AVR program.
  explicit Program(const std::string& path);

  elf_firmware_t& firmware() { return firmware_; }
  /// First address after .data, .bss and .noinit: the heap grows up from it, the stack down to it.
  uint16_t static_end() const { return static_end_; }
  /// Address of malloc's `__brkval` (zero until the first malloc, then the end of the heap), or 0.
  uint16_t heap_end_variable() const { return heap_end_variable_; }
  /// "0x0123 in function", for messages.
  std::string place(avr_flashaddr_t pc) const;

 private:
  /// 0 if the program has no such symbol.
  uint16_t data_symbol(const char* name) const;

  elf_firmware_t firmware_{};
  uint16_t static_end_ = 0;
  uint16_t heap_end_variable_ = 0;
};

}  // namespace auvest_board
