// Why the chip has started, and for the how-manieth time: the first line that a sketch sends.
//
//     $BOOT,boots,cause*hhhhhhhh
//
// The desk sees from it that the board was reset under way. `cause` is the chip's register MCUSR:
// 1 power came on, 2 the reset pin (a desk that opens the port pulls it), 4 the supply was too low,
// 8 the watchdog. It is 0 behind a bootloader that clears the register.
//
// The count lies in the last 16 bytes of the EEPROM, in two places that are written in turn, each
// with its CRC-32: if power fails while one is written, the other counts. A byte of EEPROM bears
// 100,000 writes, so 200,000 starts.
#pragma once

#include <Arduino.h>
#include <auvest.h>
#include <avr/eeprom.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "auvest_text_line.h"

namespace auvest_board {

static uint8_t reset_cause __attribute__((section(".noinit")));

// Runs before main(). The register keeps a cause until it is cleared, and a watchdog that has reset
// the chip goes on with its shortest time.
__attribute__((naked, used, section(".init3"))) static void keep_reset_cause() {
  reset_cause = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

class BootCount {
 public:
  /// Counts this start; to be called once. Takes some 30 ms.
  uint32_t next() {
    const uint32_t first = stored(0);
    const uint32_t second = stored(1);
    const uint32_t count = (first > second ? first : second) + 1;
    const Slot slot = {count, sum_of(count)};
    eeprom_update_block(&slot, place(count & 1), sizeof slot);
    return count;
  }

 private:
  struct Slot {
    uint32_t count;
    uint32_t sum;
  };

  static Slot* place(uint8_t i) {
    return reinterpret_cast<Slot*>(E2END + 1 - 2 * sizeof(Slot)) + i;
  }

  static uint32_t sum_of(uint32_t count) {
    auvest::Crc32 sum;
    for (uint8_t shift = 0; shift < 32; shift += 8) sum.add(static_cast<uint8_t>(count >> shift));
    return sum.value();
  }

  /// 0 where nothing whole is stored. Erased memory, all ones, has the sum of what it is.
  static uint32_t stored(uint8_t i) {
    Slot slot;
    eeprom_read_block(&slot, place(i), sizeof slot);
    return slot.count != 0xffffffff && slot.sum == sum_of(slot.count) ? slot.count : 0;
  }
};

/// Sends the line, and gives the count. After Serial.begin(), before all else.
inline uint32_t announce_boot() {
  const uint32_t count = BootCount().next();
  LineOut line;
  line.start("BOOT");
  line.field(count);
  line.field(static_cast<uint32_t>(reset_cause));
  line.finish();
  return count;
}

}  // namespace auvest_board
