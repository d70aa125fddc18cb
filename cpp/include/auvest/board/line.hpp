// Lines of text that cannot lie: $body*hhhhhhhh, where hhhhhhhh is the CRC-32 of the characters of
// the body, eight hexadecimal digits. The body is a name and fields, separated by commas.
//
// A number is digits with or without a sign and a point, nothing else: there is no way to write
// NaN, infinity or an exponent. One becomes a float as digits / 10^decimals, two floats divided
// once: a chip and a desk get the same bits. auvest has the same in python/auvest/telemetry.py.
#pragma once

#include <cstdint>

#include "auvest/board/crc32.hpp"
#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Puts received characters together to lines, and refuses what is not whole.
class LineIn {
 public:
  enum class Result : std::uint8_t { kMore, kLine, kCorrupt };

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
  static constexpr std::uint8_t kCapacity = 56;
  static constexpr std::uint8_t kChecksum = 9;  ///< *hhhhhhhh

  Result end() {
    const std::uint8_t size = size_;
    size_ = 0;
    if (size == 0) return Result::kMore;  // an empty line
    if (size < 2 + kChecksum || size == kCapacity || text_[0] != '$') return Result::kCorrupt;
    char* const star = text_ + (size - kChecksum);
    if (*star != '*') return Result::kCorrupt;
    std::uint32_t given = 0;
    for (std::uint8_t i = 1; i < kChecksum; ++i) {
      const std::uint8_t digit = value_of(star[i]);
      if (digit > 15) return Result::kCorrupt;
      given = given << 4 | digit;
    }
    Crc32 sum;
    for (const char* c = text_ + 1; c != star; ++c) sum.add(static_cast<std::uint8_t>(*c));
    if (sum.value() != given) return Result::kCorrupt;
    *star = '\0';
    return Result::kLine;
  }

  /// 0..15; more, if it is no digit.
  static std::uint8_t value_of(char digit) {
    if (digit >= '0' && digit <= '9') return static_cast<std::uint8_t>(digit - '0');
    if (digit >= 'a' && digit <= 'f') return static_cast<std::uint8_t>(digit - 'a' + 10);
    if (digit >= 'A' && digit <= 'F') return static_cast<std::uint8_t>(digit - 'A' + 10);
    return 0xff;
  }

  char text_[kCapacity];
  std::uint8_t size_ = 0;
};

/// The fields of a line's body, one after the other.
class LineFields {
 public:
  /// `body` must live as long as this is asked.
  explicit LineFields(const char* body) : rest_(body) {}

  /// Whether the body begins with this name; if so, what follows are the fields.
  bool named(const char* name) {
    const char* text = rest_;
    while (*name != '\0') {
      if (*text++ != *name++) return false;
    }
    if (*text != ',' && *text != '\0') return false;
    rest_ = text;
    return true;
  }

  /// The next field, if it is a whole number of up to nine digits.
  bool take(std::uint32_t& count) {
    Decimal number;
    if (!take(number) || number.negative || number.decimals != kNoPoint) return false;
    count = number.digits;
    return true;
  }

  /// The next field, if it is a number of up to nine digits.
  bool take(float& value) {
    Decimal number;
    if (!take(number)) return false;
    float power = 1;  // exact up to 10^10
    for (std::int8_t n = number.decimals; n > 0; --n) power *= 10;
    const float size = static_cast<float>(number.digits) / power;
    value = number.negative ? -size : size;
    return true;
  }

  /// Whether no field is left.
  bool at_end() const { return *rest_ == '\0'; }

 private:
  static constexpr std::int8_t kNoPoint = -1;

  struct Decimal {
    std::uint32_t digits;
    std::int8_t decimals;
    bool negative;
  };

  bool take(Decimal& number) {
    if (*rest_ != ',') return false;
    const char* text = rest_ + 1;
    number.digits = 0;
    number.decimals = kNoPoint;
    number.negative = *text == '-';
    if (number.negative) ++text;
    std::uint8_t size = 0;
    for (;; ++text) {
      if (*text == '.' && number.decimals == kNoPoint) {
        number.decimals = 0;
      } else if (*text >= '0' && *text <= '9') {
        if (++size > 9) return false;
        number.digits = 10 * number.digits + static_cast<std::uint8_t>(*text - '0');
        if (number.decimals != kNoPoint) ++number.decimals;
      } else {
        break;
      }
    }
    if (size == 0) return false;
    rest_ = text;
    return true;
  }

  const char* rest_;
};

/// Reads an instrument's answer to a request for this sample: "NAME,sample,number,number". False,
/// with `numbers` as they were, if it is anything else.
inline bool read_answer(const char* body, const char* name, std::uint32_t sample,
                        float (&numbers)[2]) {
  LineFields fields(body);
  std::uint32_t of;
  float first, second;
  const bool good = fields.named(name) && fields.take(of) && of == sample && fields.take(first) &&
                    fields.take(second) && fields.at_end();
  if (good) {
    numbers[0] = first;
    numbers[1] = second;
  }
  return good;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
