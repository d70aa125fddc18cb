/// EEPROM as the ATmega2560's datasheet has it (section 8.3 and table 8-1).
///
/// simavr's own is replaced because a byte there is written at once, whatever the program does
/// next: it knows no byte under way, clears EEPE immediately, raises the ready interrupt once
/// instead of for as long as the memory is ready, and takes no time to read.
#pragma once

#include <cstdint>
#include <string>

#include "simavr.hpp"

namespace auvest_board {

class Eeprom {
 public:
  /// `content`: the first bytes of the memory; the rest is erased, but for what the program's file
  /// has for it. Throws std::runtime_error if it is longer than the memory.
  Eeprom(avr_t* avr, const std::string& content);
  Eeprom(const Eeprom&) = delete;
  Eeprom& operator=(const Eeprom&) = delete;

  /// A byte under way ends as it should; a reset does not stop it.
  void finish();
  /// The power is off: a byte under way is as `arbitrary` says from here on.
  void cut(uint8_t arbitrary);
  std::string content() const;

 private:
  enum class Mode : uint8_t { kEraseAndWrite, kErase, kWrite };

  bool flag(avr_regbit_t bit) const { return avr_regbit_get(avr_, bit) != 0; }
  void control(uint8_t value);
  uint16_t addressed() const;
  void begin();
  /// Holds the ready interrupt at the level that the datasheet gives it.
  void refresh();

  avr_t* avr_;
  avr_eeprom_t* registers_;  ///< simavr's: which register and vector is where, and the bytes
  bool writing_ = false;
  uint16_t place_ = 0;  ///< of the byte under way
  uint8_t byte_ = 0;    ///< what it will be
};

}  // namespace auvest_board
