#include "eeprom.hpp"

#include <cstring>
#include <stdexcept>

namespace auvest_board {

namespace {

constexpr uint8_t kReadEnable = 1 << 0;      // EERE
constexpr uint8_t kWriteEnable = 1 << 1;     // EEPE
constexpr uint8_t kMasterEnable = 1 << 2;    // EEMPE
constexpr uint8_t kReadyInterrupt = 1 << 3;  // EERIE
constexpr uint8_t kModes = 3 << 4;           // EEPM1, EEPM0
constexpr int kModeShift = 4;

constexpr Cycle kReadHalt = 4;  // cycles that the chip stands still
constexpr Cycle kWriteHalt = 2;
constexpr Cycle kEnableCycles = 1 + 4;  // the write to the register is one

avr_eeprom_t* find_eeprom(avr_t* avr) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "eeprom") == 0) {
      return reinterpret_cast<avr_eeprom_t*>(io);  // io is its first member
    }
  }
  throw std::runtime_error(std::string("the ") + avr->mmcu + " has no EEPROM");
}

}  // namespace

Eeprom::Eeprom(avr_t* avr, const std::string& content) : avr_(avr), registers_(find_eeprom(avr)) {
  if (content.size() > registers_->size) {
    throw std::runtime_error("--eeprom: " + std::to_string(content.size()) + " bytes, the " +
                             avr->mmcu + " has " + std::to_string(registers_->size));
  }
  std::memcpy(registers_->eeprom, content.data(), content.size());
  avr_->io[AVR_DATA_TO_IO(registers_->r_eecr)].w = {
      this, [](avr_t*, avr_io_addr_t, uint8_t value, void* self) {
        static_cast<Eeprom*>(self)->control(value);
      }};
  // The request is a level: as long as it holds, an interrupt follows the return from one.
  avr_irq_register_notify(
      registers_->ready.irq + AVR_INT_IRQ_RUNNING,
      [](avr_irq_t*, uint32_t running, void* self) {
        if (running == 0) static_cast<Eeprom*>(self)->refresh();
      },
      this);
}

uint16_t Eeprom::addressed() const {
  const int address = avr_->data[registers_->r_eearl] | avr_->data[registers_->r_eearh] << 8;
  return static_cast<uint16_t>(address % registers_->size);
}

/// The program writes to EECR.
void Eeprom::control(uint8_t value) {
  uint8_t& control = avr_->data[registers_->r_eecr];
  const bool enabled = (control & kMasterEnable) != 0;
  const uint8_t modes = writing_ ? control : value;  // they cannot change under way
  control = static_cast<uint8_t>((value & (kReadyInterrupt | kMasterEnable)) | (modes & kModes) |
                                 (writing_ ? kWriteEnable : 0));
  if (!enabled && (value & kMasterEnable)) {  // clears itself
    avr_cycle_timer_register(
        avr_, kEnableCycles,
        [](avr_t*, avr_cycle_count_t, void* self) -> avr_cycle_count_t {
          auto* eeprom = static_cast<Eeprom*>(self);
          eeprom->avr_->data[eeprom->registers_->r_eecr] &= static_cast<uint8_t>(~kMasterEnable);
          return 0;
        },
        this);
  }
  if ((value & kReadEnable) && !writing_) {
    avr_->data[registers_->r_eedr] = registers_->eeprom[addressed()];
    avr_->cycle += kReadHalt;
  } else if ((value & kWriteEnable) && enabled && !writing_) {
    begin();
  }
  refresh();
}

void Eeprom::begin() {
  uint8_t& control = avr_->data[registers_->r_eecr];
  const auto mode = static_cast<Mode>((control & kModes) >> kModeShift);
  const uint8_t given = avr_->data[registers_->r_eedr];
  place_ = addressed();
  byte_ = given;
  if (mode == Mode::kErase) byte_ = 0xff;
  if (mode == Mode::kWrite) byte_ = registers_->eeprom[place_] & given;
  writing_ = true;
  control = static_cast<uint8_t>((control | kWriteEnable) & ~kMasterEnable);
  avr_->cycle += kWriteHalt;
  avr_cycle_timer_register_usec(
      avr_, mode == Mode::kEraseAndWrite ? 3400 : 1800,
      [](avr_t*, avr_cycle_count_t, void* self) -> avr_cycle_count_t {
        static_cast<Eeprom*>(self)->finish();
        return 0;
      },
      this);
}

void Eeprom::finish() {
  if (!writing_) return;
  writing_ = false;
  registers_->eeprom[place_] = byte_;
  avr_->data[registers_->r_eecr] &= static_cast<uint8_t>(~kWriteEnable);
  refresh();
}

void Eeprom::cut(uint8_t arbitrary) {
  if (!writing_) return;
  byte_ = arbitrary;
  finish();
}

std::string Eeprom::content() const {
  return {reinterpret_cast<const char*>(registers_->eeprom), registers_->size};
}

void Eeprom::refresh() {
  if (!writing_ && flag(registers_->ready.enable)) {
    avr_raise_interrupt(avr_, &registers_->ready);
  } else {
    avr_clear_interrupt(avr_, &registers_->ready);
  }
}

}  // namespace auvest_board
