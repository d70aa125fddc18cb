// Instruments on the other end of Serial. The chip asks one of them for a sample by its number; the
// answer is believed only if it is whole, from this instrument, for this sample and in time.
//
//     chip to instrument   $PING,17*hhhhhhhh
//     instrument to chip   $SONAR,17,4.125,1.0923*hhhhhhhh     sample, two numbers
//
// Numbers are as auvest/board/line.hpp says: up to nine digits, no exponent.
#pragma once

#include <Arduino.h>
#include <auvest.h>

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
    StoredLine<32> request;
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
        const auvest::LineIn::Result result = line_.take(static_cast<char>(Serial.read()));
        if (result == auvest::LineIn::Result::kMore) continue;
        float numbers[2];
        if (result == auvest::LineIn::Result::kLine &&
            auvest::read_answer(line_.text(), name, sample_, numbers)) {
          answer = Answer(numbers[0], numbers[1]);
          return true;
        }
        ++refused_;
      }
      if (wake_timer::reached(limit)) return false;
    }
  }

  /// Lines so far that were corrupt, or no answer to what was asked.
  uint32_t refused() const { return refused_; }

 private:
  uint32_t sample_ = 0;
  uint32_t refused_ = 0;
  auvest::LineIn line_;
};

}  // namespace auvest_board
