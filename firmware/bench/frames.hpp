// Rows to a bench and its answers, as lines: $K,wwwwwwww,...,wwwwwwww*hhhhhhhh. K is a letter, each
// w a 32-bit word in hexadecimal digits (a float as its bits), hhhhhhhh the CRC-32 of what stands
// between $ and *, as in every line of auvest (auvest/board/line.hpp). They are taken apart as they
// come: no line is stored.
//
// What includes this has the other end: `void port::put(char)`.
#pragma once

#include <stdint.h>

#include "auvest/board/crc32.hpp"

namespace bench {

/// Takes rows: lines that begin with R, of 1 to `Words` words.
template <uint8_t Words>
class FrameIn {
 public:
  enum class Result : uint8_t { kMore, kFrame, kCorrupt };

  Result take(char character) {
    if (character == '\n') return end();
    if (character == '\r') return Result::kMore;
    begun_ = true;
    if (character == '$') {  // wherever it stands, a frame begins
      sound_ = true;
      in_sum_ = false;
      place_ = 0;
      count_ = 0;
      sum_ = auvest::Crc32();
    } else {
      sound_ = sound_ && fits(character);
    }
    return Result::kMore;
  }

  /// After kFrame: its words.
  uint8_t count() const { return count_; }
  uint32_t word(uint8_t i) const { return words_[i]; }

 private:
  /// The next character of a frame: the letter, or a separator and eight digits again and again.
  bool fits(char character) {
    if (place_ == kSeparator && character == '*' && !in_sum_) {
      in_sum_ = true;
      place_ = kFirstDigit;
      return true;
    }
    if (!in_sum_) sum_.add(static_cast<uint8_t>(character));
    if (place_ == 0) {
      place_ = kSeparator;
      return character == 'R';
    }
    if (place_ == kSeparator) {
      place_ = kFirstDigit;
      return character == ',' && !in_sum_ && count_ < Words;
    }
    const uint8_t digit = value_of(character);
    word_ = word_ << 4 | digit;
    if (++place_ > kLastDigit) {
      place_ = kSeparator;
      if (!in_sum_) words_[count_++] = word_;
    }
    return digit <= 15;
  }

  Result end() {
    const bool whole =
        sound_ && in_sum_ && place_ == kSeparator && count_ > 0 && word_ == sum_.value();
    const bool empty = !begun_;
    begun_ = false;
    sound_ = false;
    if (empty) return Result::kMore;
    return whole ? Result::kFrame : Result::kCorrupt;
  }

  static uint8_t value_of(char digit) {
    if (digit >= '0' && digit <= '9') return static_cast<uint8_t>(digit - '0');
    if (digit >= 'a' && digit <= 'f') return static_cast<uint8_t>(digit - 'a' + 10);
    return 0xff;
  }

  // place_: 0 before the letter.
  static constexpr uint8_t kSeparator = 1;
  static constexpr uint8_t kFirstDigit = 2;
  static constexpr uint8_t kLastDigit = 9;

  uint32_t words_[Words];
  uint32_t word_ = 0;
  auvest::Crc32 sum_;
  uint8_t place_ = 0;
  uint8_t count_ = 0;
  bool begun_ = false;   ///< something has come since the last line
  bool sound_ = false;   ///< since $ all was as it must be
  bool in_sum_ = false;  ///< behind *
};

/// Sends one frame, character by character.
class FrameOut {
 public:
  explicit FrameOut(char kind) {
    port::put('$');
    put(kind);
  }

  void word(uint32_t value) {
    put(',');
    digits(value);
  }

  void end() {
    const uint32_t value = sum_.value();
    put('*');
    digits(value);
    put('\n');
  }

 private:
  void put(char character) {
    sum_.add(static_cast<uint8_t>(character));
    port::put(character);
  }

  void digits(uint32_t value) {
    for (uint8_t i = 0; i < 8; ++i) {
      const uint8_t digit = static_cast<uint8_t>(value >> 28);
      put(static_cast<char>(digit < 10 ? '0' + digit : 'a' + digit - 10));
      value <<= 4;
    }
  }

  auvest::Crc32 sum_;
};

}  // namespace bench
