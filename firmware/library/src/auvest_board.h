// RAM of an AVR board: how much there is, and how much of it the stack has ever touched.
//
// Included by a sketch, this header fills the free RAM with a pattern before main() runs. What the
// stack then overwrites stays overwritten:
//
//     Serial.println(auvest_board::stack_used());   // bytes, the deepest so far
//     Serial.println(auvest_board::ram_unused());   // bytes that neither heap nor stack touched
#pragma once

#include <avr/io.h>
#include <stddef.h>
#include <stdint.h>

extern "C" {
extern uint8_t __heap_start;  // first byte behind .bss: the linker's
extern uint8_t* __brkval;     // end of the heap once malloc was used: avr-libc's
// Without malloc in the program the linker leaves it at address 0.
#pragma weak __brkval
}

namespace auvest_board {

constexpr size_t kRam = RAMEND - RAMSTART + 1;  ///< bytes of RAM on this chip
constexpr uint8_t kPattern = 0xc5;

/// Whether global objects of this size leave the stack its reserve; for a static_assert.
constexpr bool fits(size_t objects, size_t stack_reserve) {
  return objects <= kRam && stack_reserve <= kRam - objects;
}

// Runs after the start-up code has set the stack pointer and before it fills .data and .bss. It has
// no frame and calls nothing: the stack is empty, so all of the RAM above .bss can be painted.
__attribute__((naked, used, section(".init3"))) static void paint_free_ram() {
  asm volatile(
      "    ldi r30, lo8(__heap_start)\n"
      "    ldi r31, hi8(__heap_start)\n"
      "    ldi r24, %0\n"
      "    ldi r25, hi8(%1)\n"
      "1:  st Z+, r24\n"
      "    cpi r30, lo8(%1)\n"
      "    cpc r31, r25\n"
      "    brlo 1b\n"
      :
      : "i"(kPattern), "i"(RAMEND + 1));
}

/// First byte behind the heap, or behind .bss while malloc was not used.
inline const uint8_t* free_begin() { return &__brkval && __brkval ? __brkval : &__heap_start; }

/// Bytes between the heap and the deepest stack so far.
inline size_t ram_unused() {
  const uint8_t* byte = free_begin();
  while (byte <= reinterpret_cast<const uint8_t*>(RAMEND) && *byte == kPattern) ++byte;
  return static_cast<size_t>(byte - free_begin());
}

/// Bytes of the deepest stack so far. A frame's last bytes count only if they were written.
inline size_t stack_used() {
  return static_cast<size_t>(reinterpret_cast<const uint8_t*>(RAMEND) + 1 - free_begin()) -
         ram_unused();
}

}  // namespace auvest_board
