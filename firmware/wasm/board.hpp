/// What a program in WebAssembly says to its host: the interface of firmware/board/board.hpp, as
/// functions that the host gives (replay.mjs). No cycles are counted.
#pragma once

#include <stdint.h>

namespace board {

#define AUVEST_HOST(name) __attribute__((import_module("board"), import_name(name)))

inline void begin(uint8_t) {}
inline void end(uint8_t) {}

/// Ends the run: all is well.
AUVEST_HOST("finish") void finish();

/// Ends the run: the program found a fault.
AUVEST_HOST("fail") void fail();

/// Appends a byte to the trace.
AUVEST_HOST("write") void write(uint8_t byte);

/// The next byte of the record. Reading past its end ends the run as a failure.
AUVEST_HOST("read") uint8_t read();

#undef AUVEST_HOST

}  // namespace board
