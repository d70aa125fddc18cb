/// USART0 in asynchronous mode, as the ATmega2560's datasheet has it (section 22).
///
/// simavr's own is replaced because its time is wrong: it counts a parity bit in every frame, has
/// no transmit buffer, and receives into 64 places where the chip has three.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>

#include "simavr.hpp"

namespace auvest_board {

class Uart {
 public:
  /// Called with each byte that the chip sent, when its stop bit has passed.
  using Listener = std::function<void(Cycle when, uint8_t byte)>;

  Uart(avr_t* avr, Listener listener);
  Uart(const Uart&) = delete;
  Uart& operator=(const Uart&) = delete;

  /// Sends bytes to the chip without gaps: at its own baud rate, beginning at `start` or, if the
  /// line is busy then, when it is free.
  void send(Cycle start, const std::string& bytes);
  /// Hands over what is on its way out; for the end of the run.
  void drain();
  /// Bytes that the chip lost because it did not read them in time.
  uint64_t overruns() const { return overruns_; }

 private:
  struct Transfer {
    Cycle start;
    std::string bytes;
    size_t sent = 0;
  };

  Cycle frame_cycles() const;
  bool status(avr_regbit_t flag) const { return avr_regbit_get(avr_, flag) != 0; }

  void write_data(uint8_t byte);
  uint8_t read_data();
  void write_status(uint8_t value);
  void write_control(uint8_t value);

  void begin_frame(Cycle start, uint8_t byte);
  static Cycle frame_sent(avr_t*, Cycle when, void* self);
  Cycle frame_sent(Cycle when);
  void await_frame();
  static Cycle receive(avr_t*, Cycle when, void* self);
  void frame_received();
  /// Brings flags and interrupt requests in line with the buffers.
  void refresh();

  avr_t* avr_;
  avr_uart_t* registers_;  ///< simavr's: which register and vector is where on this chip
  Listener listener_;

  bool sending_ = false;
  uint8_t send_shift_ = 0;
  Cycle send_end_ = 0;
  bool send_buffer_full_ = false;
  uint8_t send_buffer_ = 0;

  std::deque<Transfer> incoming_;  ///< ordered by their start
  bool receiving_ = false;         ///< a frame is on the line
  Cycle receive_start_ = 0;        ///< of the next frame, or of the one on the line
  Cycle receive_end_ = 0;          ///< of the last frame that began
  std::deque<uint8_t> received_;   ///< two buffers and the shift register
  uint64_t overruns_ = 0;
};

}  // namespace auvest_board
