// Instruments on the other end of Serial. The chip asks one of them for a sample by its number; the
// answer is believed only if it is whole, from this instrument, for this sample and in time.
//
//     chip to instrument   $PING,17*hh
//     instrument to chip   $SONAR,17,4.125,1.0923*hh     sample, two numbers
#pragma once

#include <Arduino.h>
#include <auvest.h>
#include <stdlib.h>
#include <string.h>

#include "auvest_text_line.h"
#include "auvest_wake_timer.h"

namespace auvest_board {

class SerialInstruments {
 public:
  using Answer = auvest::Vector<float, 2>;

  /// What comes from here on belongs to a new sample: an answer that is still under way does not.
  void begin(uint32_t sample) {
    while (Serial.available() > 0) Serial.read();
    line_.forget();
    sample_ = sample;
  }

  /// Sends a request of this name.
  void ask(const char* name) {
    LineOut<24> request;
    request.start(name);
    request.field(sample_);
    request.finish();
    request.send();
  }

  /// Sleeps until an answer of this name is here or `limit` has come, and sends `line` meanwhile.
  /// False: there is none, and `answer` is as it was.
  template <class Line>
  bool await(const char* name, uint32_t limit, Answer& answer, Line& line) {
    for (;;) {
      wake_timer::sleep_until([&] { return Serial.available() > 0 || line.sendable(); }, limit);
      line.send_some();
      while (Serial.available() > 0) {
        const LineIn::Result result = line_.take(static_cast<char>(Serial.read()));
        if (result == LineIn::Result::kMore) continue;
        if (result == LineIn::Result::kLine && parse(line_.text(), name, answer)) return true;
        ++refused_;
      }
      if (wake_timer::reached(limit)) return false;
    }
  }

  /// Lines so far that were corrupt, or no answer to what was asked.
  uint32_t refused() const { return refused_; }

 private:
  bool parse(const char* text, const char* name, Answer& answer) const {
    const size_t size = strlen(name);
    if (strncmp(text, name, size) != 0 || text[size] != ',') return false;
    char* end;
    if (strtoul(text + size + 1, &end, 10) != sample_) return false;
    Answer numbers;
    for (int i = 0; i < 2; ++i) {
      if (*end != ',') return false;
      const char* const begin = end + 1;
      numbers(i) = static_cast<float>(strtod(begin, &end));
      if (end == begin || !auvest::math::is_finite(numbers(i))) return false;
    }
    if (*end != '\0') return false;
    answer = numbers;
    return true;
  }

  uint32_t sample_ = 0;
  uint32_t refused_ = 0;
  LineIn line_;
};

}  // namespace auvest_board
