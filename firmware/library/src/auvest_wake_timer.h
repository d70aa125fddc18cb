// A clock on Timer1, and a sleep that ends when something is ready (Arduino MEGA2560). It takes
// Timer1's interrupts: include it in one file of a sketch.
//
// One tick is 4 us at 16 MHz. A moment is a number of ticks in 32 bits, which wrap after 4.8 hours:
// differences of moments stay right below half of that.
#pragma once

#include <Arduino.h>
#include <avr/sleep.h>

namespace auvest_board {
namespace wake_timer {

constexpr uint32_t kTicksPerSecond = F_CPU / 64;

constexpr uint32_t to_ticks(float seconds) {
  return static_cast<uint32_t>(seconds * kTicksPerSecond + 0.5f);
}

constexpr float to_seconds(uint32_t ticks) {
  return static_cast<float>(ticks) * (1.0f / kTicksPerSecond);
}

static volatile uint16_t overflows = 0;
static uint32_t asleep = 0;  ///< ticks; the interrupts that end a sleep count as sleep

/// Starts at 0. Stops millis() and delay(), whose interrupt would wake the chip each millisecond.
inline void begin() {
  noInterrupts();
  TIMSK0 = 0;
  TCCR1A = 0;
  TCCR1B = _BV(CS11) | _BV(CS10);  // count up from 0 to 65535, one tick per 64 cycles
  TCNT1 = 0;
  TIFR1 = _BV(TOV1) | _BV(OCF1A);
  TIMSK1 = _BV(TOIE1) | _BV(OCIE1A);
  set_sleep_mode(SLEEP_MODE_IDLE);  // the deepest in which Timer1 and the UART run
  interrupts();
}

/// Ticks since the start that do not wrap: whole seconds and the rest.
struct Elapsed {
  uint32_t seconds = 0;
  uint32_t ticks = 0;

  void add(uint32_t more) {
    ticks += more;
    while (ticks >= kTicksPerSecond) {
      ticks -= kTicksPerSecond;
      ++seconds;
    }
  }

  float in_seconds() const { return static_cast<float>(seconds) + to_seconds(ticks); }
};

/// The present moment. Interrupts must be off.
inline uint32_t now_unguarded() {
  const uint16_t low = TCNT1;
  uint16_t high = overflows;
  if ((TIFR1 & _BV(TOV1)) && low < 0x8000u) ++high;  // wrapped, and not yet counted
  return (static_cast<uint32_t>(high) << 16) | low;
}

inline uint32_t now() {
  noInterrupts();
  const uint32_t ticks = now_unguarded();
  interrupts();
  return ticks;
}

/// Ticks awake since the last call.
inline uint32_t take_awake() {
  static uint32_t taken = 0;
  noInterrupts();
  const uint32_t awake = now_unguarded() - asleep;
  interrupts();
  const uint32_t since = awake - taken;
  taken = awake;
  return since;
}

inline bool reached_unguarded(uint32_t moment) {
  return static_cast<int32_t>(now_unguarded() - moment) >= 0;
}

inline bool reached(uint32_t moment) { return static_cast<int32_t>(now() - moment) >= 0; }

/// Sleeps until ready() is true. It is called with interrupts off, after each interrupt: nothing
/// can happen between a "not yet" and the sleep, because sei acts one instruction late.
template <class Ready>
void sleep_until(Ready ready) {
  noInterrupts();
  while (!ready()) {
    const uint16_t before = TCNT1;
    sleep_enable();
    interrupts();
    sleep_cpu();
    sleep_disable();
    noInterrupts();
    asleep += static_cast<uint16_t>(TCNT1 - before);  // an overflow ends a sleep
  }
  interrupts();
}

/// As above, but no longer than until `limit`. (A far one wakes the chip every 65536 ticks.)
template <class Ready>
void sleep_until(Ready ready, uint32_t limit) {
  OCR1A = static_cast<uint16_t>(limit);
  sleep_until([&] { return ready() || reached_unguarded(limit); });
}

inline void sleep_until_moment(uint32_t moment) {
  sleep_until([] { return false; }, moment);
}

}  // namespace wake_timer
}  // namespace auvest_board

ISR(TIMER1_OVF_vect) {
  using auvest_board::wake_timer::overflows;
  overflows = overflows + 1;
}
EMPTY_INTERRUPT(TIMER1_COMPA_vect)  // its only work is to wake the chip
