/// What a program on a board of QEMU says to its runner: the interface of firmware/board/board.hpp,
/// over semihosting (start.cpp). The record is the file record.bin of QEMU's working directory,
/// what is written goes to trace.bin. No cycles are counted: QEMU's time is not the chip's.
#pragma once

#include <stdint.h>

namespace board {

inline void begin(uint8_t) {}
inline void end(uint8_t) {}

/// Ends the run: all is well. The deepest stack, 4 bytes, goes to stack.bin.
void finish();

/// Ends the run: the program found a fault.
void fail();

void write(uint8_t byte);

/// The next byte of the record. Reading past its end ends the run as a failure.
uint8_t read();

}  // namespace board
