// CRC-32 as Ethernet, zlib and gzip have it: the checksum of a line.
//
// The polynomial 0x04c11db7, bits reflected, all ones at the beginning, inverted at the end. Every
// burst of up to 32 bits and up to four wrong bits in a line of 350 characters are noticed; of all
// else one in 2^32 is not.
#pragma once

#include <cstdint>

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// What a byte does to the rest, of its lower four bits and of its upper four: bit by bit, eight
/// times, the rest is halved, and the polynomial added where the bit that falls out is 1.
const std::uint32_t kCrcOfLowerBits[16] AUVEST_IN_FLASH = {
    0x00000000, 0x77073096, 0xee0e612c, 0x990951ba, 0x076dc419, 0x706af48f, 0xe963a535, 0x9e6495a3,
    0x0edb8832, 0x79dcb8a4, 0xe0d5e91e, 0x97d2d988, 0x09b64c2b, 0x7eb17cbd, 0xe7b82d07, 0x90bf1d91,
};
const std::uint32_t kCrcOfUpperBits[16] AUVEST_IN_FLASH = {
    0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
    0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c, 0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c,
};

/// Some 60 cycles a byte on an AVR, and 128 bytes of flash.
class Crc32 {
 public:
  void add(std::uint8_t byte) {
    const std::uint8_t index = static_cast<std::uint8_t>(rest_ ^ byte);
    rest_ = (rest_ >> 8) ^ AUVEST_FROM_FLASH(kCrcOfLowerBits + (index & 15)) ^
            AUVEST_FROM_FLASH(kCrcOfUpperBits + (index >> 4));
  }

  std::uint32_t value() const { return ~rest_; }

 private:
  std::uint32_t rest_ = 0xffffffffu;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
