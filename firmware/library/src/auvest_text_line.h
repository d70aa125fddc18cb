// Lines of text with a checksum, as NMEA 0183 has it: $...*hh, where hh is the exclusive or of all
// characters between $ and *, two hexadecimal digits.
#pragma once

#include <Arduino.h>
#include <string.h>

#include "auvest_wake_timer.h"

namespace auvest_board {

constexpr uint32_t kBaud = 115200;

/// A line to be sent. Its fields are printed into it like to Serial.
template <size_t Capacity>
class LineOut final : public Print {
 public:
  using Print::write;

  /// Begins a line with the name of its kind.
  void start(const char* name) {
    size_ = sent_ = 0;
    write('$');
    sum_ = 0;
    print(name);
  }

  /// A field that keeps all bits: 8 hexadecimal digits. print(value, 6) would round, and a variance
  /// of 1e-7 would be lost.
  void field(float value) {
    uint8_t bytes[sizeof value];
    memcpy(bytes, &value, sizeof value);
    write(',');
    for (int8_t i = sizeof value - 1; i >= 0; --i) hexadecimal(bytes[i]);
  }

  void field(uint32_t value) {
    write(',');
    print(value);
  }

  void empty_field() { write(','); }

  void finish() {
    const uint8_t sum = sum_;
    write('*');
    hexadecimal(sum);
    print("\r\n");
  }

  size_t write(uint8_t character) override {
    if (size_ == Capacity) return 0;
    text_[size_++] = static_cast<char>(character);
    sum_ ^= character;
    return 1;
  }

  /// Ticks that the UART needs for it: ten bits a character.
  uint32_t duration() const { return size_ * (10 * wake_timer::kTicksPerSecond / kBaud + 1); }

  /// Whether some of it can go out now.
  bool sendable() const { return sent_ != size_ && Serial.availableForWrite() > 0; }

  void send_some() {
    while (sendable()) Serial.write(text_[sent_++]);
  }

  /// Sends what is left, asleep while the UART's buffer is full.
  void send() {
    while (sent_ != size_) {
      wake_timer::sleep_until([this] { return sendable(); });
      send_some();
    }
  }

 private:
  void hexadecimal(uint8_t byte) {
    write("0123456789abcdef"[byte >> 4]);
    write("0123456789abcdef"[byte & 15]);
  }

  char text_[Capacity];
  size_t size_ = 0;
  size_t sent_ = 0;
  uint8_t sum_ = 0;
};

/// Puts received characters together to lines, and refuses what is not whole.
class LineIn {
 public:
  enum class Result : uint8_t { kMore, kLine, kCorrupt };

  Result take(char character) {
    if (character == '$') {  // wherever it stands, a line begins
      const bool cut = size_ != 0;
      size_ = 1;
      text_[0] = '$';
      return cut ? Result::kCorrupt : Result::kMore;
    }
    if (character == '\n') return end();
    if (character == '\r') return Result::kMore;
    if (size_ < kCapacity) text_[size_++] = character;
    return Result::kMore;
  }

  void forget() { size_ = 0; }

  /// After kLine: what stands between $ and *.
  const char* text() const { return text_ + 1; }

 private:
  static constexpr uint8_t kCapacity = 48;

  Result end() {
    const uint8_t size = size_;
    size_ = 0;
    if (size == 0) return Result::kMore;  // an empty line
    if (size < 5 || size == kCapacity || text_[0] != '$' || text_[size - 3] != '*') {
      return Result::kCorrupt;
    }
    uint8_t sum = 0;
    for (uint8_t i = 1; i < size - 3; ++i) sum ^= static_cast<uint8_t>(text_[i]);
    if (sum != (nibble(text_[size - 2]) << 4 | nibble(text_[size - 1]))) return Result::kCorrupt;
    text_[size - 3] = '\0';
    return Result::kLine;
  }

  /// 0..15, or a value that fits no checksum.
  static uint16_t nibble(char digit) {
    if (digit >= '0' && digit <= '9') return static_cast<uint16_t>(digit - '0');
    if (digit >= 'a' && digit <= 'f') return static_cast<uint16_t>(digit - 'a' + 10);
    if (digit >= 'A' && digit <= 'F') return static_cast<uint16_t>(digit - 'A' + 10);
    return 0x100;
  }

  char text_[kCapacity];
  uint8_t size_ = 0;
};

}  // namespace auvest_board
