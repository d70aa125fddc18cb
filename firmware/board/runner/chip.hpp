/// The simulated chip: runs a program instruction by instruction and watches what the real chip
/// would let pass in silence.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "eeprom.hpp"
#include "program.hpp"
#include "sections.hpp"
#include "simavr.hpp"
#include "uart.hpp"
#include "world.hpp"

namespace auvest_board {

enum class Reason {
  kFinished,  ///< board::finish()
  kElapsed,   ///< the time asked for has passed
  kStopped,   ///< by the world
  kCut,       ///< the power went off
  kFailed,    ///< board::fail()
  kCrashed,
  kReset,
  kIllegalAccess,
  kStackOverflow,
  kLimit,  ///< still running after the time allowed
};

/// How the report calls it.
const char* name(Reason reason);
bool is_failure(Reason reason);

struct Outcome {
  Reason reason;
  std::string message;
};

/// Why the chip starts, as MCUSR says it.
enum class ResetCause : uint8_t { kPowerOn = 1, kExternal = 2, kBrownOut = 4, kWatchdog = 8 };

struct PinChange {
  Cycle cycle;
  std::string pin;
  bool level;
};

struct ChipOptions {
  std::string mcu = "atmega2560";
  uint32_t frequency = 16000000;  ///< Hz
  Cycle limit = 0;
  Reason at_limit = Reason::kLimit;
  std::vector<std::string> watched_pins;  ///< "PORTB7", or "all"
  std::string input;                      ///< for board::read
  bool raw = false;  ///< where `input` ends the world is asked, and told what was written
  ResetCause cause = ResetCause::kPowerOn;
  std::string eeprom;  ///< what it holds at the start; see Eeprom
  Cycle cut = 0;       ///< when the power goes off, if it does (not 0)
  uint32_t seed = 1;   ///< of the value that a byte of EEPROM under way then has
};

class Chip {
 public:
  /// Throws std::runtime_error for an unknown chip or pin, or if the program does not fit.
  Chip(Program& program, World& world, const ChipOptions& options);
  Chip(const Chip&) = delete;
  Chip& operator=(const Chip&) = delete;

  /// Runs to the end, once.
  Outcome run();

  Cycle cycles() const { return avr_->cycle; }
  Cycle cycles_asleep() const { return cycles_asleep_; }
  int ram_end() const { return avr_->ramend; }
  /// First address after the static data.
  int static_end() const { return static_end_; }
  int lowest_stack_pointer() const { return lowest_; }
  /// Bytes between the end of the static data and the end of the heap.
  int heap_bytes() const;
  const Sections& sections() const { return sections_; }
  const std::vector<PinChange>& pin_changes() const { return pin_changes_; }
  const std::string& output() const { return output_; }  ///< from board::write
  const std::string& serial() const { return serial_; }  ///< all bytes sent by USART0
  uint64_t serial_overruns() const { return uart_->overruns(); }
  std::string eeprom() const { return eeprom_->content(); }

 private:
  struct Pin {
    Chip* chip;
    std::string name;
    bool level;
  };

  void watch(const std::string& pin);
  void start_by(ResetCause cause);
  void cut_after(Cycle delay);
  void connect_registers();
  uint8_t next_input();
  void tell(const Event& event);
  void on_serial(Cycle when, uint8_t byte);
  void stop(Reason reason, const std::string& message);

  int stack_pointer() const { return avr_->data[R_SPL] | avr_->data[R_SPH] << 8; }
  int heap_end() const;
  void mark(uint8_t value);
  void close_stack_window(int stack_pointer);
  void check_stack(int stack_pointer);
  bool stack_pointer_half_written() const;
  bool timer_is_due() const;
  void sleep();
  void service_interrupts(bool woken);
  std::string where() const;

  static void on_log(avr_t* avr, int level, const char* format, va_list arguments);
  void on_error(const std::string& text);

  Program& program_;
  World& world_;
  avr_t* avr_;
  std::unique_ptr<Uart> uart_;
  std::unique_ptr<Eeprom> eeprom_;
  uint32_t seed_;
  Reason at_limit_;
  bool stopped_ = false;
  Outcome outcome_{Reason::kCrashed, "simavr stopped"};

  avr_flashaddr_t pc_ = 0;  ///< of the instruction being executed
  Cycle cycles_asleep_ = 0;
  int static_end_;
  const uint8_t* heap_end_variable_;
  int lowest_;         ///< stack pointer of the whole run
  int window_lowest_;  ///< stack pointer since the last mark
  Sections sections_;

  std::vector<std::unique_ptr<Pin>> pins_;
  std::vector<PinChange> pin_changes_;
  std::string input_;
  size_t input_read_ = 0;
  bool raw_;
  std::string output_;
  size_t output_told_ = 0;
  std::string serial_;
  std::string line_;
};

}  // namespace auvest_board
