// The chip's side of the line, on the desk: takes what is received, and says what it believes.
//
// Standard input has cases: two numbers of 4 bytes, the sample that is asked for and a size, and so
// many bytes. Of each the output has 12 bytes: how many lines of it were believed, and the numbers
// of the last.
#include <cstdint>
#include <cstdio>

#include "auvest/board/line.hpp"

int main() {
  auvest::LineIn line;
  std::uint32_t head[2];
  while (std::fread(head, sizeof head, 1, stdin) == 1) {
    line.forget();  // as before every sample
    std::uint32_t believed = 0;
    float numbers[2] = {0, 0};
    for (std::uint32_t i = 0; i < head[1]; ++i) {
      const int character = std::getchar();
      if (character == EOF) return 1;
      if (line.take(static_cast<char>(character)) != auvest::LineIn::Result::kLine) continue;
      if (auvest::read_answer(line.text(), "SONAR", head[0], numbers)) ++believed;
    }
    std::fwrite(&believed, sizeof believed, 1, stdout);
    std::fwrite(numbers, sizeof numbers, 1, stdout);
  }
  return 0;
}
