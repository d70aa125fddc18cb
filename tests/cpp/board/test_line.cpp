// Crc32, LineIn and LineFields: published check values, and lines that are not what was sent.

#include <doctest/doctest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "auvest/board/crc32.hpp"
#include "auvest/board/line.hpp"

using auvest::Crc32;
using auvest::LineFields;
using auvest::LineIn;
using auvest::read_answer;

namespace {

std::uint32_t crc_of(const std::string& text) {
  Crc32 sum;
  for (const char c : text) sum.add(static_cast<std::uint8_t>(c));
  return sum.value();
}

std::string framed(const std::string& body) {
  const char* const digits = "0123456789abcdef";
  const std::uint32_t sum = crc_of(body);
  std::string line = "$" + body + "*";
  for (int shift = 28; shift >= 0; shift -= 4) line += digits[sum >> shift & 15];
  return line;
}

/// The bodies that are taken of what is received, and how often something is refused.
struct Heard {
  std::vector<std::string> bodies;
  int refused = 0;

  explicit Heard(const std::string& received) {
    LineIn in;
    for (const char c : received) {
      const LineIn::Result result = in.take(c);
      if (result == LineIn::Result::kLine) bodies.push_back(in.text());
      if (result == LineIn::Result::kCorrupt) ++refused;
    }
  }
};

bool answered(const std::string& body, float (&numbers)[2]) {
  return read_answer(body.c_str(), "SONAR", 17, numbers);
}

}  // namespace

TEST_CASE("Crc32: the check value of every catalogue, and zlib's of other texts") {
  CHECK(crc_of("123456789") == 0xcbf43926u);
  CHECK(crc_of("") == 0);
  CHECK(crc_of(std::string(1, '\0')) == 0xd202ef8du);
  CHECK(crc_of("The quick brown fox jumps over the lazy dog") == 0x414fa339u);
}

TEST_CASE("Crc32: as the polynomial says, bit by bit") {
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    for (const std::uint32_t before : {0u, 0xffffffffu, 0x12345678u}) {
      // A CRC that has come so far, and one byte more.
      std::uint32_t rest = before ^ byte;
      for (int bit = 0; bit < 8; ++bit) rest = (rest >> 1) ^ ((rest & 1) ? 0xedb88320u : 0u);
      const std::uint32_t step = auvest::kCrcOfLowerBits[(before ^ byte) & 15] ^
                                 auvest::kCrcOfUpperBits[((before ^ byte) >> 4) & 15];
      CHECK(rest == ((before >> 8) ^ step));
    }
  }
}

TEST_CASE("LineIn: whole lines are taken, whatever comes between them") {
  const std::string one = framed("SONAR,1,2,3");
  const Heard heard("garbage" + one + "\r\n\r\n" + framed("X") + "\n$cut" + one + "\n" + one);
  CHECK(heard.bodies == std::vector<std::string>{"SONAR,1,2,3", "X", "SONAR,1,2,3"});
  CHECK(heard.refused == 2);  // the garbage, and the line that was cut

  std::string large = one;
  for (std::size_t i = large.find('*'); i < large.size(); ++i) {
    large[i] = static_cast<char>(large[i] >= 'a' ? large[i] - 'a' + 'A' : large[i]);
  }
  CHECK(Heard(large + "\n").bodies.size() == 1);
}

TEST_CASE("LineIn: no line with one or two characters changed, lost or doubled is taken") {
  const std::string line = framed("SONAR,17,0.700000,1.107149");
  int tried = 0;
  const auto refused = [&tried](const std::string& text) {
    ++tried;
    return Heard(text + "\n").bodies.empty();
  };
  for (std::size_t i = 1; i < line.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string changed = line;
      changed[i] = static_cast<char>(changed[i] ^ 1 << bit);
      // The digits of the checksum may be of either case.
      if (i > line.find('*') && bit == 5 && line[i] >= 'a') continue;
      // A line's end within it leaves a checksum without a body, or the other way round.
      CHECK_MESSAGE(refused(changed), changed);
    }
    for (std::size_t k = i; k < line.size(); ++k) {
      std::string lost = line;
      lost.erase(k, 1);
      if (k != i) lost.erase(i, 1);
      CHECK_MESSAGE(refused(lost), lost);
      std::string doubled = line;
      doubled.insert(k, 1, line[k]);
      if (k != i) doubled.insert(i, 1, line[i]);
      CHECK_MESSAGE(refused(doubled), doubled);
    }
  }
  CHECK(tried > 1000);
}

TEST_CASE("LineIn: what does not fit is refused, and the next line is taken") {
  const std::string longest = framed(std::string(45, 'x'));  // 55 characters
  CHECK(Heard(longest + "\n").bodies.size() == 1);
  const Heard heard(framed(std::string(46, 'x')) + "\n" + longest + "\n");
  CHECK(heard.bodies.size() == 1);
  CHECK(heard.refused == 1);
  CHECK(Heard("$*00000000\n").refused == 1);  // of nothing, whose sum is 0
  CHECK(Heard("*00000000\n").refused == 1);
  CHECK(Heard("$SONAR,17,1,2*4f\n").refused == 1);
}

TEST_CASE("LineFields: numbers are digits over a power of ten") {
  float numbers[2] = {-1, -1};
  CHECK(answered("SONAR,17,0.1,-12.345", numbers));
  CHECK(numbers[0] == 1.0f / 10.0f);
  CHECK(numbers[1] == -(12345.0f / 1000.0f));
  CHECK(answered("SONAR,000000017,.5,7.", numbers));
  CHECK(numbers[0] == 0.5f);
  CHECK(numbers[1] == 7.0f);
  CHECK(answered("SONAR,17,123456789,-0.00000001", numbers));
  CHECK(numbers[0] == 123456789.0f);
  CHECK(numbers[1] == -(1.0f / 1e8f));
}

TEST_CASE("read_answer: what is anything else is refused, and the numbers stay") {
  float numbers[2] = {-1, -1};
  for (const char* const body : {"SONAR",
                                 "SONAR,17",
                                 "SONAR,17,1",
                                 "SONAR,17,1,2,3",
                                 "SONAR,17,1,2,",
                                 "SONAR,18,1,2",
                                 "SONAR,-17,1,2",
                                 "SONAR,17.0,1,2",
                                 "SONAR,0000000017,1,2",
                                 "SONARS,17,1,2",
                                 "SONA,17,1,2",
                                 ",17,1,2",
                                 "SONAR,17,,2",
                                 "SONAR,17,-,2",
                                 "SONAR,17,.,2",
                                 "SONAR,17,1.2.3,2",
                                 "SONAR,17,--1,2",
                                 "SONAR,17,+1,2",
                                 "SONAR,17,1e3,2",
                                 "SONAR,17,nan,2",
                                 "SONAR,17,inf,2",
                                 "SONAR,17, 1,2",
                                 "SONAR,17,1 ,2",
                                 "SONAR,17,1234567890,2",
                                 "SONAR,17,1.000000000,2",
                                 "SONAR,17,1,0x2",
                                 ""}) {
    CHECK_MESSAGE(!answered(body, numbers), body);
  }
  CHECK(numbers[0] == -1);
  CHECK(numbers[1] == -1);
}
