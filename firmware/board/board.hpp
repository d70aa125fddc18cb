/// What a program on the simulated board (auvest-board) says to its runner, through the three
/// general-purpose I/O registers: a byte costs one instruction and no pin, timer or UART.
///
/// C++11, for the AVRs that have the registers (ATmega48 to ATmega2560). On a real board the
/// writes go nowhere.
#pragma once

#include <avr/io.h>
#include <stdint.h>

namespace board {

/// Keeps the compiler from moving memory accesses, and with them the work to be measured, over it.
inline void barrier() { __asm__ __volatile__("" ::: "memory"); }

/// Begins section 1..100: the runner counts cycles and stack until its `end`. Sections may nest.
inline void begin(uint8_t section) {
  barrier();
  GPIOR0 = static_cast<uint8_t>(2 * section);
  barrier();
}

/// Ends a section. Its cycles lie between the two writes; loading the mark (`ldi`) is one of them.
inline void end(uint8_t section) {
  barrier();
  GPIOR0 = static_cast<uint8_t>(2 * section + 1);
  barrier();
}

/// Ends the run: all is well.
inline void finish() {
  barrier();
  GPIOR0 = 0xff;
}

/// Ends the run: the program found a fault.
inline void fail() {
  barrier();
  GPIOR0 = 0xfe;
}

/// Appends a byte to the output stream (--output).
inline void write(uint8_t byte) {
  GPIOR1 = byte;
  barrier();
}

/// The next byte of the input stream (--input). Past its end the world is asked for more (--raw),
/// or the run ends as a failure.
inline uint8_t read() {
  barrier();
  return GPIOR2;
}

}  // namespace board
