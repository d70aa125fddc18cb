// Lines of text with a checksum that a sketch sends, over Serial: $body*hhhhhhhh
// (auvest/board/line.hpp, which also has what it receives).
#pragma once

#include <Arduino.h>
#include <auvest.h>

#include "auvest_wake_timer.h"

namespace auvest_board {

constexpr uint32_t kBaud = 115200;
constexpr uint32_t kMicrosecondsPerTick = 1000000 / wake_timer::kTicksPerSecond;

/// A line on its way out. Its fields are printed into it like to Serial, which they go to at once.
class LineOut : public Print {
 public:
  using Print::write;

  /// Begins a line with the name of its kind.
  void start(const char* name) {
    size_ = 0;
    write('$');
    sum_ = auvest::Crc32();
    print(name);
  }

  /// A field that keeps all bits: 8 hexadecimal digits. print(value, 6) would round, and a variance
  /// of 1e-7 would be lost.
  void field(float value) {
    write(',');
    hexadecimal(&value);
  }

  void field(uint32_t value) {
    write(',');
    print(value);
  }

  /// Seconds, with the ticks as six decimals.
  void field(const wake_timer::Elapsed& time) {
    field(time.seconds);
    const uint32_t microseconds = time.ticks * kMicrosecondsPerTick;
    write('.');
    for (uint32_t unit = 100000; unit > microseconds && unit > 1; unit /= 10) write('0');
    print(microseconds);
  }

  void empty_field() { write(','); }

  void finish() {
    const uint32_t sum = sum_.value();
    write('*');
    hexadecimal(&sum);
    print("\r\n");
  }

  size_t write(uint8_t character) final {
    if (!text_) {
      Serial.write(character);
    } else if (size_ == capacity_) {
      return 0;
    } else {
      text_[size_++] = static_cast<char>(character);
    }
    sum_.add(character);
    return 1;
  }

 protected:
  char* text_ = nullptr;
  size_t capacity_ = 0;
  size_t size_ = 0;

 private:
  /// Four bytes, the last one first.
  void hexadecimal(const void* word) {
    const uint8_t* const bytes = static_cast<const uint8_t*>(word);
    for (int8_t i = 3; i >= 0; --i) {
      write("0123456789abcdef"[bytes[i] >> 4]);
      write("0123456789abcdef"[bytes[i] & 15]);
    }
  }

  auvest::Crc32 sum_;
};

/// A line that is written first and sent when there is time.
template <size_t Capacity>
class StoredLine : public LineOut {
 public:
  StoredLine() {
    text_ = characters_;
    capacity_ = Capacity;
  }
  StoredLine(const StoredLine&) = delete;
  StoredLine& operator=(const StoredLine&) = delete;

  void start(const char* name) {
    sent_ = 0;
    LineOut::start(name);
  }

  /// Ticks that the UART needs for it: ten bits a character.
  uint32_t duration() const { return size_ * (10 * wake_timer::kTicksPerSecond / kBaud + 1); }

  /// Whether some of it can go out now.
  bool sendable() const { return sent_ != size_ && Serial.availableForWrite() > 0; }

  void send_some() {
    while (sendable()) Serial.write(characters_[sent_++]);
  }

  /// Sends what is left, asleep while the UART's buffer is full.
  void send() {
    while (sent_ != size_) {
      wake_timer::sleep_until([this] { return sendable(); });
      send_some();
    }
  }

 private:
  char characters_[Capacity];
  size_t sent_ = 0;
};

/// The line of a sample, whose numbers keep all their bits or, to be read by eye, have so many
/// decimals.
template <size_t Capacity, bool Exact, int Decimals>
class SampleLine final : public StoredLine<Capacity> {
 public:
  void number(float value) {
    if (Exact) {
      this->field(value);
    } else {
      this->empty_field();
      this->print(value, Decimals);
    }
  }

  void optional(bool present, float value) {
    if (present) {
      number(value);
    } else {
      this->empty_field();
    }
  }
};

/// Says how much RAM neither heap nor stack has touched: ram_unused() of auvest_board.h.
inline void remark_ram(size_t unused) {
  Serial.print(F("# bytes of RAM never used: "));
  Serial.print(unused);
  Serial.print(F("\r\n"));
}

}  // namespace auvest_board
