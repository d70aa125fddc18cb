// The replay on a board without files, the ATmega2560 or one of QEMU (firmware/qemu): its input
// stream gives the record, its output stream takes the trace.
#include "board.hpp"
#include AUVEST_REPLAY

namespace {

struct Board {
  std::uint32_t read() {
    std::uint32_t word = 0;
    for (std::uint8_t i = 0; i < 4; ++i) word |= static_cast<std::uint32_t>(board::read()) << 8 * i;
    return word;
  }

  void write(std::uint32_t word) {
    for (std::uint8_t i = 0; i < 4; ++i) {
      board::write(static_cast<std::uint8_t>(word));
      word >>= 8;
    }
  }
};

}  // namespace

int main() {
  Board stream;
  auvest::parity::replay(stream);
  board::finish();
}
