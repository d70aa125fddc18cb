// replay RECORD TRACE: a record from a file, its trace into a file. The Cortex-M programs are this
// source too: newlib reaches the files through semihosting.
#include <cstdio>

#include AUVEST_REPLAY

namespace {

struct Files {
  std::FILE* record;
  std::FILE* trace;
  bool sound;

  std::uint32_t read() {
    unsigned char bytes[4] = {0, 0, 0, 0};
    sound = std::fread(bytes, 1, 4, record) == 4 && sound;
    std::uint32_t word = 0;
    for (int i = 3; i >= 0; --i) word = word << 8 | bytes[i];
    return word;
  }

  void write(std::uint32_t word) {
    unsigned char bytes[4];
    for (int i = 0; i < 4; ++i) bytes[i] = static_cast<unsigned char>(word >> 8 * i);
    sound = std::fwrite(bytes, 1, 4, trace) == 4 && sound;
  }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: replay RECORD TRACE\n", stderr);
    return 2;
  }
  Files files = {std::fopen(argv[1], "rb"), std::fopen(argv[2], "wb"), true};
  if (files.record == nullptr || files.trace == nullptr) {
    std::fprintf(stderr, "replay: cannot open %s\n", files.record == nullptr ? argv[1] : argv[2]);
    return 1;
  }
  auvest::parity::replay(files);
  if (std::fclose(files.trace) != 0 || !files.sound) {
    std::fprintf(stderr, "replay: %s ends early or %s cannot be written\n", argv[1], argv[2]);
    return 1;
  }
  return 0;
}
