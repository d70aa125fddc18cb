// bench [ROWS ANSWERS]: rows from a file, answers into another; without names, one line after the
// other from standard input to standard output. The Cortex-M programs are this source too: newlib
// reaches the files through semihosting.
#include <cstdint>
#include <cstdio>

namespace port {

std::FILE* rows = stdin;
std::FILE* answers = stdout;

void put(char character) {
  std::fputc(character, answers);
  if (character == '\n' && answers == stdout) std::fflush(answers);
}
void begin() {}
void end() {}
std::uint32_t microseconds() { return 0; }  // the computer's time says nothing about a chip

}  // namespace port

#include "bench.hpp"

int main(int argc, char** argv) {
  if (argc == 3) {
    port::rows = std::fopen(argv[1], "rb");
    port::answers = std::fopen(argv[2], "wb");
  }
  if (port::rows == nullptr || port::answers == nullptr) {
    std::fprintf(stderr, "bench: cannot open %s\n", port::rows == nullptr ? argv[1] : argv[2]);
    return 1;
  }
  bench::say('B');
  for (int character; (character = std::fgetc(port::rows)) != EOF;) {
    bench::take(static_cast<char>(character));
  }
  if (std::fclose(port::answers) != 0) {
    std::fprintf(stderr, "bench: the answers cannot be written\n");
    return 1;
  }
  return 0;
}
