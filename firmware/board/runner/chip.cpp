#include "chip.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <random>
#include <stdexcept>

namespace auvest_board {

namespace {

// Data addresses, the same on every AVR that simavr has and board.hpp supports.
constexpr avr_io_addr_t kGpior0 = 0x3e;
constexpr avr_io_addr_t kGpior1 = 0x4a;
constexpr avr_io_addr_t kGpior2 = 0x4b;
constexpr avr_io_addr_t kSmcr = 0x53;
constexpr avr_io_addr_t kMcusr = 0x54;
constexpr avr_io_addr_t kWdtcsr = 0x60;
constexpr uint8_t kSleepEnable = 0x01;
constexpr uint8_t kSleepMode = 0x0e;
constexpr uint8_t kWatchdogEnable = 0x08;
constexpr uint8_t kWatchdogChange = 0x10;

constexpr uint8_t kFinishMark = 0xff;
constexpr uint8_t kFailMark = 0xfe;

// simavr's log has no user data: one chip per process.
Chip* logging_chip = nullptr;

std::string hex(unsigned value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%04x", value);
  return text;
}

/// Arduino's core lets all timers but the first count up and down to 255, a mode that simavr lacks:
/// there they would overflow at every tick, which took a third of the time of a run, and in sleep
/// nearly all. Here they count up only.
void let_timers_count_to_255(avr_t* avr) {
  for (avr_io_t* part = avr->io_port; part != nullptr; part = part->next) {
    if (std::strcmp(part->kind, "timer") != 0) continue;
    avr_timer_wgm_t& mode = reinterpret_cast<avr_timer_t*>(part)->wgm_op[1];
    if (mode.kind != avr_timer_wgm_none) continue;
    mode.kind = avr_timer_wgm_normal;
    mode.size = 8;
  }
}

avr_t* make_avr(const ChipOptions& options) {
  avr_t* avr = avr_make_mcu_by_name(options.mcu.c_str());
  if (avr == nullptr) throw std::runtime_error("--mcu: simavr knows no " + options.mcu);
  avr_init(avr);
  let_timers_count_to_255(avr);
  avr->frequency = options.frequency;
  // simavr reports an access outside of the memory and then does it: give it room for any address.
  constexpr size_t kAddressSpace = 0x10000;
  constexpr size_t kFlashAddressSpace = 0x1000000 + 2;
  avr->data = static_cast<uint8_t*>(std::realloc(avr->data, kAddressSpace));
  avr->flash = static_cast<uint8_t*>(std::realloc(avr->flash, kFlashAddressSpace));
  if (avr->data == nullptr || avr->flash == nullptr) throw std::bad_alloc();
  return avr;
}

/// Null if the chip has no such pin.
avr_irq_t* find_pin(avr_t* avr, const std::string& pin) {
  if (pin.size() != 6 || pin.compare(0, 4, "PORT") != 0 || pin[5] < '0' || pin[5] > '7') {
    return nullptr;
  }
  const auto port = static_cast<uint32_t>(pin[4]);
  return avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), pin[5] - '0');
}

}  // namespace

const char* name(Reason reason) {
  switch (reason) {
    case Reason::kFinished:
      return "finished";
    case Reason::kElapsed:
      return "elapsed";
    case Reason::kStopped:
      return "stopped";
    case Reason::kCut:
      return "cut";
    case Reason::kFailed:
      return "failed";
    case Reason::kCrashed:
      return "crashed";
    case Reason::kReset:
      return "reset";
    case Reason::kIllegalAccess:
      return "illegal access";
    case Reason::kStackOverflow:
      return "stack overflow";
    case Reason::kLimit:
      return "limit";
  }
  return "";
}

bool is_failure(Reason reason) {
  return reason != Reason::kFinished && reason != Reason::kElapsed && reason != Reason::kStopped &&
         reason != Reason::kCut;
}

// ---- Set-up -------------------------------------------------------------------------------------

Chip::Chip(Program& program, World& world, const ChipOptions& options)
    : program_(program),
      world_(world),
      seed_(options.seed),
      at_limit_(options.at_limit),
      input_(options.input),
      raw_(options.raw) {
  logging_chip = this;
  avr_global_logger_set(on_log);
  avr_ = make_avr(options);
  elf_firmware_t& firmware = program.firmware();
  if (firmware.flashbase + firmware.flashsize > avr_->flashend + 1) {
    throw std::runtime_error("the program does not fit into the flash of the " + options.mcu);
  }
  firmware.frequency = options.frequency;
  avr_load_firmware(avr_, &firmware);

  static_end_ = program.static_end();
  static const uint8_t kNoHeap[2] = {0, 0};
  const uint16_t variable = program.heap_end_variable();
  heap_end_variable_ = variable != 0 ? avr_->data + variable : kNoHeap;
  lowest_ = window_lowest_ = stack_pointer();

  uart_ = std::make_unique<Uart>(avr_, [this](Cycle when, uint8_t byte) { on_serial(when, byte); });
  eeprom_ = std::make_unique<Eeprom>(avr_, options.eeprom);
  connect_registers();
  start_by(options.cause);
  if (options.cut != 0) cut_after(options.cut);
  for (const std::string& pin : options.watched_pins) watch(pin);
  avr_cycle_timer_register(
      avr_, options.limit,
      [](avr_t*, avr_cycle_count_t, void* self) -> avr_cycle_count_t {
        auto* chip = static_cast<Chip*>(self);
        chip->stop(chip->at_limit_, "the time allowed is over" + chip->where());
        return 0;
      },
      this);
}

void Chip::connect_registers() {
  avr_register_io_write(
      avr_, kGpior0,
      [](avr_t* avr, avr_io_addr_t address, uint8_t value, void* self) {
        avr->data[address] = value;
        static_cast<Chip*>(self)->mark(value);
      },
      this);
  avr_register_io_write(
      avr_, kGpior1,
      [](avr_t* avr, avr_io_addr_t address, uint8_t value, void* self) {
        avr->data[address] = value;
        static_cast<Chip*>(self)->output_.push_back(static_cast<char>(value));
      },
      this);
  avr_register_io_read(
      avr_, kGpior2,
      [](avr_t*, avr_io_addr_t, void* self) { return static_cast<Chip*>(self)->next_input(); },
      this);
}

uint8_t Chip::next_input() {
  if (raw_ && input_read_ == input_.size()) {
    const std::string written = output_.substr(output_told_);
    output_told_ = output_.size();
    tell({Event::Kind::kInput, avr_->cycle, written, false});
  }
  if (input_read_ == input_.size()) {
    stop(Reason::kIllegalAccess, "read past the end of the input stream");
    return 0;
  }
  return static_cast<uint8_t>(input_[input_read_++]);
}

/// A watchdog that has reset the chip goes on, with its shortest time.
void Chip::start_by(ResetCause cause) {
  avr_->data[kMcusr] = static_cast<uint8_t>(cause);
  if (cause != ResetCause::kWatchdog) return;
  const auto& watchdog = avr_->io[AVR_DATA_TO_IO(kWdtcsr)].w;
  for (const uint8_t value : {uint8_t(kWatchdogChange | kWatchdogEnable), kWatchdogEnable}) {
    watchdog.c(avr_, kWdtcsr, value, watchdog.param);
  }
}

/// Replaces a cut that was planned before.
void Chip::cut_after(Cycle delay) {
  avr_cycle_timer_register(
      avr_, delay,
      [](avr_t*, avr_cycle_count_t, void* self) -> avr_cycle_count_t {
        auto* chip = static_cast<Chip*>(self);
        chip->stop(Reason::kCut, "the power was cut" + chip->where());
        return 0;
      },
      this);
}

void Chip::watch(const std::string& pin) {
  if (pin == "all") {
    for (char port = 'A'; port <= 'L'; ++port) {
      for (char bit = '0'; bit <= '7'; ++bit) {
        const std::string each = std::string("PORT") + port + bit;
        if (find_pin(avr_, each) != nullptr) watch(each);
      }
    }
    return;
  }
  avr_irq_t* irq = find_pin(avr_, pin);
  if (irq == nullptr) throw std::runtime_error("--watch: " + pin + " is not a pin like PORTB7");
  pins_.push_back(std::make_unique<Pin>(Pin{this, pin, false}));
  avr_irq_register_notify(
      irq,
      [](avr_irq_t*, uint32_t value, void* parameter) {
        auto* watched = static_cast<Pin*>(parameter);
        const bool level = (value & 1) != 0;
        if (level == watched->level) return;
        watched->level = level;
        Chip* chip = watched->chip;
        chip->pin_changes_.push_back({chip->avr_->cycle, watched->name, level});
        chip->tell({Event::Kind::kPin, chip->avr_->cycle, watched->name, level});
      },
      pins_.back().get());
}

// ---- The run ------------------------------------------------------------------------------------

Outcome Chip::run() {
  tell({Event::Kind::kStart, 0, "", false});
  const avr_flashaddr_t code_end = avr_->codeend;
  const avr_run_t unhindered = avr_->run;  // the watchdog changes it to reset the chip
  while (avr_->state == cpu_Running || avr_->state == cpu_Sleeping) {
    pc_ = avr_->pc;
    const bool asleep = avr_->state == cpu_Sleeping;
    const avr_flashaddr_t next = asleep ? pc_ : avr_run_one(avr_);
    if (timer_is_due()) avr_cycle_timer_process(avr_);
    avr_->pc = next;

    if (avr_->state == cpu_Sleeping) sleep();
    if (avr_->interrupt_state != 0) service_interrupts(asleep);

    const int pointer = stack_pointer();
    if (pointer < window_lowest_ || pointer + 1 < heap_end()) check_stack(pointer);
    if (avr_->pc - 1 >= code_end - 1) {  // 0, or not code
      if (avr_->pc == 0) {
        stop(Reason::kReset,
             "jump to 0 (a null function, or an interrupt without a handler)" + where());
      } else {
        stop(Reason::kCrashed, "jump to " + hex(avr_->pc) + ", where there is no code," + where());
      }
    }
    if (avr_->run != unhindered) stop(Reason::kReset, "reset by the watchdog" + where());
  }
  if (outcome_.reason == Reason::kCut) {
    eeprom_->cut(static_cast<uint8_t>(std::mt19937(seed_)()));
  } else {
    eeprom_->finish();
    if (outcome_.reason != Reason::kStopped) uart_->drain();  // else the world is gone
  }
  close_stack_window(stack_pointer());
  return outcome_;
}

void Chip::stop(Reason reason, const std::string& message) {
  if (stopped_) return;  // the first reason counts
  stopped_ = true;
  avr_->state = cpu_Done;
  outcome_ = {reason, message};
}

std::string Chip::where() const {
  return " at " + program_.place(pc_) + ", cycle " + std::to_string(avr_->cycle);
}

void Chip::tell(const Event& event) {
  const Reaction reaction = world_.react(event);
  for (const Message& message : reaction.messages) {
    uart_->send(event.cycle + message.delay, message.text + '\n');
  }
  if (!reaction.input.empty()) {
    input_.erase(0, input_read_);
    input_read_ = 0;
    input_ += reaction.input;
  }
  if (reaction.cut) {
    const Cycle when = event.cycle + reaction.cut_delay;
    cut_after(when > avr_->cycle ? when - avr_->cycle : 0);
  }
  if (reaction.stop) stop(Reason::kStopped, "stopped from outside");
}

void Chip::on_serial(Cycle when, uint8_t byte) {
  const char character = static_cast<char>(byte);
  serial_.push_back(character);
  if (character != '\n') {
    line_.push_back(character);
    return;
  }
  if (!line_.empty() && line_.back() == '\r') line_.pop_back();
  std::string line;
  line.swap(line_);
  tell({Event::Kind::kLine, when, line, false});
}

/// Asked after each instruction: a call of simavr would take a third of the instruction's time.
bool Chip::timer_is_due() const {
  const avr_cycle_timer_slot_t* next = avr_->cycle_timers.timer;
  return next != nullptr && next->when <= avr_->cycle;
}

void Chip::sleep() {
  const uint8_t control = avr_->data[kSmcr];
  if (!(control & kSleepEnable)) {
    avr_->state = cpu_Running;  // sleep without the enable bit does nothing
  } else if (control & kSleepMode) {
    stop(Reason::kCrashed,
         "a sleep deeper than idle stops timers and UART: not simulated," + where());
  } else if (!avr_->sreg[S_I]) {
    stop(Reason::kCrashed, "sleep with interrupts disabled, for ever" + where());
  } else {
    // There is one: that of the limit.
    const Cycle until_next_timer = avr_->cycle_timers.timer->when - avr_->cycle;
    avr_->cycle += until_next_timer;
    cycles_asleep_ += until_next_timer;
  }
}

void Chip::service_interrupts(bool woken) {
  const uint8_t depth = avr_->interrupts.running_ptr;
  avr_service_interrupts(avr_);
  if (avr_->interrupts.running_ptr <= depth) return;
  // simavr takes no time for it. The datasheet: pushing the program counter takes four cycles, or
  // five on chips with more than 128 KB, and five more if the chip was asleep (section 7.8.1).
  avr_->cycle += 2u + avr_->address_size + (woken ? 5u : 0u);
}

// ---- Stack --------------------------------------------------------------------------------------

int Chip::heap_end() const {
  return std::max(static_end_, heap_end_variable_[0] | heap_end_variable_[1] << 8);
}

int Chip::heap_bytes() const { return heap_end() - static_end_; }

/// The stack pointer is written in two instructions; between them it is neither the old nor the
/// new one: `out SPH, r29; out SREG, r0; out SPL, r28`.
bool Chip::stack_pointer_half_written() const {
  const auto is_out_spl = [this](avr_flashaddr_t pc) {
    const int opcode = avr_->flash[pc] | avr_->flash[pc + 1] << 8;
    return (opcode & 0xfe0f) == 0xbe0d;
  };
  return is_out_spl(avr_->pc) || is_out_spl(avr_->pc + 2);
}

void Chip::check_stack(int stack_pointer) {
  if (stack_pointer_half_written()) return;
  window_lowest_ = std::min(window_lowest_, stack_pointer);
  if (stack_pointer + 1 < heap_end()) {
    stop(Reason::kStackOverflow, "stack pointer " + hex(unsigned(stack_pointer)) +
                                     " is inside the data, which ends at " +
                                     hex(unsigned(heap_end())) + "," + where());
  }
}

void Chip::close_stack_window(int stack_pointer) {
  sections_.reached(window_lowest_);
  lowest_ = std::min(lowest_, window_lowest_);
  window_lowest_ = stack_pointer;
}

void Chip::mark(uint8_t value) {
  close_stack_window(stack_pointer());
  const int section = value / 2;
  if (value == kFinishMark) {
    stop(Reason::kFinished, "");
  } else if (value == kFailMark) {
    stop(Reason::kFailed, "the program reports a failure" + where());
  } else if (section < 1 || section > kMaxSection) {
    stop(Reason::kCrashed, "unknown mark " + std::to_string(value) + where());
  } else if (value % 2 == 0) {
    // The write takes one cycle, which belongs to the mark.
    if (!sections_.begin(section, avr_->cycle + 1, stack_pointer())) {
      stop(Reason::kCrashed,
           "begin of section " + std::to_string(section) + ", which is open," + where());
    }
  } else if (!sections_.end(section, avr_->cycle)) {
    stop(Reason::kCrashed,
         "end of section " + std::to_string(section) + ", which is not open," + where());
  }
}

// ---- What simavr finds --------------------------------------------------------------------------

void Chip::on_log(avr_t*, int level, const char* format, va_list arguments) {
  if (level != LOG_ERROR) return;
  char text[256];
  std::vsnprintf(text, sizeof text, format, arguments);
  logging_chip->on_error(text);
}

void Chip::on_error(const std::string& text) {
  const size_t address = text.find("Address ");
  if (text.find("Invalid Opcode") != std::string::npos) {
    stop(Reason::kCrashed, "illegal instruction" + where());
  } else if (address != std::string::npos) {
    const bool write = text.find("write") != std::string::npos;
    stop(Reason::kIllegalAccess, (write ? "write to 0x" : "read from 0x") +
                                     text.substr(address + 8, 4) + ", the memory ends at " +
                                     hex(avr_->ramend) + "," + where());
  }
}

}  // namespace auvest_board
