// The other end of the line of a bench on an Arduino: the serial port, or, on the simulated board
// and much faster, its input and output streams.
#pragma once

#include <Arduino.h>

#if AUVEST_BENCH_SERIAL

#if defined(__AVR__)
#include <avr/sleep.h>
#endif

namespace port {

inline char get() {
  while (Serial.available() == 0) {
#if defined(__AVR__)
    // A character that comes just before this waits for the next tick of Arduino's clock, 1 ms.
    set_sleep_mode(SLEEP_MODE_IDLE);
    sleep_mode();
#endif
  }
  return static_cast<char>(Serial.read());
}
inline void put(char character) { Serial.write(static_cast<uint8_t>(character)); }
inline void begin() {}
inline void end() {}
inline uint32_t microseconds() { return micros(); }

}  // namespace port

#else

#include "board.hpp"

namespace port {

inline char get() { return static_cast<char>(board::read()); }
inline void put(char character) { board::write(static_cast<uint8_t>(character)); }
inline void begin() { board::begin(1); }
inline void end() { board::end(1); }
inline uint32_t microseconds() { return micros(); }

}  // namespace port

#endif
