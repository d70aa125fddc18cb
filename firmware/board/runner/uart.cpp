#include "uart.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace auvest_board {

namespace {

/// Two places in the receive buffer; a third byte waits in the shift register.
constexpr size_t kReceivePlaces = 3;

avr_uart_t* find_uart0(avr_t* avr) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "uart") == 0) {
      auto* uart = reinterpret_cast<avr_uart_t*>(io);  // io is its first member
      if (uart->name == '0') return uart;
    }
  }
  throw std::runtime_error(std::string("the ") + avr->mmcu + " has no USART0");
}

uint8_t bits(avr_regbit_t flag) { return static_cast<uint8_t>(flag.mask << flag.bit); }

}  // namespace

Uart::Uart(avr_t* avr, Listener listener)
    : avr_(avr), registers_(find_uart0(avr)), listener_(std::move(listener)) {
  auto& data = avr_->io[AVR_DATA_TO_IO(registers_->r_udr)];
  data.w = {this, [](avr_t*, avr_io_addr_t, uint8_t value, void* self) {
              static_cast<Uart*>(self)->write_data(value);
            }};
  data.r = {this, [](avr_t*, avr_io_addr_t, void* self) {
              return static_cast<Uart*>(self)->read_data();
            }};
  auto& status = avr_->io[AVR_DATA_TO_IO(registers_->r_ucsra)];
  status.w = {this, [](avr_t*, avr_io_addr_t, uint8_t value, void* self) {
                static_cast<Uart*>(self)->write_status(value);
              }};
  status.r = {nullptr, nullptr};
  avr_->io[AVR_DATA_TO_IO(registers_->r_ucsrb)].w = {
      this, [](avr_t*, avr_io_addr_t, uint8_t value, void* self) {
        static_cast<Uart*>(self)->write_control(value);
      }};
  // simavr starts with the transmitter on, the chip with it off.
  avr_->data[registers_->r_ucsrb] = 0;
  // Requests are levels: as long as the condition holds, an interrupt follows the return from it.
  for (avr_int_vector_t* vector : {&registers_->rxc, &registers_->udrc}) {
    avr_irq_register_notify(
        vector->irq + AVR_INT_IRQ_RUNNING,
        [](avr_irq_t*, uint32_t running, void* self) {
          if (running == 0) static_cast<Uart*>(self)->refresh();
        },
        this);
  }
}

Cycle Uart::frame_cycles() const {
  const unsigned size = unsigned(avr_regbit_get(avr_, registers_->ucsz) |
                                 avr_regbit_get(avr_, registers_->ucsz2) << 2);
  const unsigned data_bits = size < 4 ? 5 + size : 9;
  constexpr uint8_t kParityOn = 1 << 5;  // UPM01
  const unsigned parity_bits = avr_->data[registers_->r_ucsrc] & kParityOn ? 1 : 0;
  const unsigned stop_bits = status(registers_->usbs) ? 2 : 1;
  const unsigned divisor = unsigned(avr_regbit_get(avr_, registers_->ubrrl) |
                                    avr_regbit_get(avr_, registers_->ubrrh) << 8);
  const unsigned cycles_per_bit = (divisor + 1) * (status(registers_->u2x) ? 8 : 16);
  return Cycle(cycles_per_bit) * (1 + data_bits + parity_bits + stop_bits);
}

// ---- From the chip ------------------------------------------------------------------------------

void Uart::write_data(uint8_t byte) {
  if (!status(registers_->txen) || send_buffer_full_) return;  // the chip ignores it too
  if (sending_) {
    send_buffer_full_ = true;
    send_buffer_ = byte;
  } else {
    begin_frame(avr_->cycle, byte);
    avr_cycle_timer_register(avr_, send_end_ - avr_->cycle, frame_sent, this);
  }
  refresh();
}

void Uart::begin_frame(Cycle start, uint8_t byte) {
  sending_ = true;
  send_shift_ = byte;
  send_end_ = start + frame_cycles();
}

Cycle Uart::frame_sent(avr_t*, Cycle when, void* self) {
  return static_cast<Uart*>(self)->frame_sent(when);
}

Cycle Uart::frame_sent(Cycle when) {
  sending_ = false;
  const uint8_t byte = send_shift_;
  if (send_buffer_full_) {
    send_buffer_full_ = false;
    begin_frame(when, send_buffer_);
  } else {
    avr_raise_interrupt(avr_, &registers_->txc);
  }
  refresh();
  listener_(when, byte);
  return sending_ ? send_end_ : 0;
}

void Uart::drain() {
  if (sending_) listener_(send_end_, send_shift_);
  if (send_buffer_full_) listener_(send_end_ + frame_cycles(), send_buffer_);
}

// ---- To the chip --------------------------------------------------------------------------------

void Uart::send(Cycle start, const std::string& bytes) {
  if (bytes.empty()) return;
  auto later = std::upper_bound(incoming_.begin(), incoming_.end(), start,
                                [](Cycle a, const Transfer& b) { return a < b.start; });
  incoming_.insert(later, {start, bytes});
  if (!receiving_) await_frame();
}

void Uart::await_frame() {
  receive_start_ = std::max(incoming_.front().start, receive_end_);
  const Cycle wait = receive_start_ > avr_->cycle ? receive_start_ - avr_->cycle : 0;
  avr_cycle_timer_register(avr_, wait, receive, this);
}

/// Called when a frame begins, and when it ends.
Cycle Uart::receive(avr_t*, Cycle, void* self) {
  auto* uart = static_cast<Uart*>(self);
  uart->receiving_ = !uart->receiving_;
  if (!uart->receiving_) {
    uart->frame_received();
    return 0;
  }
  uart->receive_end_ = uart->receive_start_ + uart->frame_cycles();
  return uart->receive_end_;
}

void Uart::frame_received() {
  Transfer& transfer = incoming_.front();
  const auto byte = static_cast<uint8_t>(transfer.bytes[transfer.sent++]);
  if (transfer.sent == transfer.bytes.size()) incoming_.pop_front();
  if (!incoming_.empty()) await_frame();

  if (!status(registers_->rxen)) return;
  if (received_.size() < kReceivePlaces) {
    received_.push_back(byte);
  } else {
    ++overruns_;
    avr_->data[registers_->dor.reg] |= bits(registers_->dor);
  }
  refresh();
}

uint8_t Uart::read_data() {
  if (received_.empty()) return avr_->data[registers_->r_udr];
  const uint8_t byte = received_.front();
  received_.pop_front();
  avr_->data[registers_->dor.reg] &= static_cast<uint8_t>(~bits(registers_->dor));
  refresh();
  return byte;
}

// ---- Flags and interrupts -----------------------------------------------------------------------

void Uart::write_status(uint8_t value) {
  uint8_t& status = avr_->data[registers_->r_ucsra];
  if (value & bits(registers_->txc.raised)) {  // written as one: cleared
    avr_clear_interrupt(avr_, &registers_->txc);
  }
  constexpr uint8_t kWritable = 0x03;  // U2X0, MPCM0
  status = static_cast<uint8_t>((status & ~kWritable) | (value & kWritable));
}

void Uart::write_control(uint8_t value) {
  avr_->data[registers_->r_ucsrb] = value;
  if (!status(registers_->rxen)) received_.clear();
  refresh();
}

void Uart::refresh() {
  const std::pair<avr_int_vector_t*, bool> levels[] = {{&registers_->rxc, !received_.empty()},
                                                       {&registers_->udrc, !send_buffer_full_}};
  for (const auto& level : levels) {
    avr_int_vector_t* vector = level.first;
    if (level.second) {
      avr_raise_interrupt(avr_, vector);  // sets the flag, and the request if it is enabled
    } else {
      avr_clear_interrupt(avr_, vector);
      avr_regbit_clear(avr_, vector->raised);  // simavr leaves a level's flag alone
    }
  }
}

}  // namespace auvest_board
