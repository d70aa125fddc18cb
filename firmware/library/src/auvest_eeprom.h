// Checkpoints of a filter in the EEPROM (auvest/board/checkpoint.hpp), written by the interrupt
// that comes when the EEPROM is ready for the next byte: the sketch goes on meanwhile.
//
//     auvest_board::EepromCheckpoints<Filter> checkpoints(1);   // another number for another
//     filter AUVEST_EEPROM_INTERRUPT(checkpoints)
//
// The last 16 bytes belong to auvest_boot.h. A byte takes 3.4 ms; it bears 100,000 writes. While
// checkpoints.writing(), the EEPROM is not free for anything else.
#pragma once

#include <auvest.h>
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>

namespace auvest_board {

/// A Store (auvest/board/checkpoint_ring.hpp).
class Eeprom {
 public:
  size_t size() const { return E2END + 1 - kBootCount; }
  uint8_t read(size_t place) const {
    return eeprom_read_byte(reinterpret_cast<const uint8_t*>(place));
  }
  bool busy() const { return !eeprom_is_ready(); }

  /// Called by the interrupt: the byte before is in, and nothing comes between the two bits, of
  /// which the second must follow within four cycles.
  void write(size_t place, uint8_t byte) {
    EEAR = static_cast<uint16_t>(place);
    EEDR = byte;
    EECR = _BV(EERIE);  // erase and write in one
    asm volatile(
        "sbi %0, %1\n"
        "sbi %0, %2\n"
        :
        : "I"(_SFR_IO_ADDR(EECR)), "I"(EEMPE), "I"(EEPE));
  }

  /// The interrupt comes as soon as the EEPROM is ready: now, mostly.
  void wake() {
    asm volatile("" ::: "memory");  // what is to be written is in memory by then
    EECR |= _BV(EERIE);
  }

 private:
  static constexpr size_t kBootCount = 16;
};

template <class Kept>
class EepromCheckpoints : public auvest::Checkpoints<Kept, Eeprom> {
 public:
  /// `kind`: see CheckpointRing.
  explicit EepromCheckpoints(uint16_t kind) : auvest::Checkpoints<Kept, Eeprom>(eeprom_, kind) {}

 private:
  Eeprom eeprom_;
};

}  // namespace auvest_board

/// The interrupt, for the one object of a sketch. (A pointer to it would cost half as much again.)
#define AUVEST_EEPROM_INTERRUPT(checkpoints) \
  ISR(EE_READY_vect) {                       \
    if (!checkpoints.poll()) EECR = 0;       \
  }
