// The sonar on the other end of Serial: a pulse on a pin triggers it, a line says which sample it
// is, and its answer is believed only if it is whole, for this sample and in time.
//
//     chip to sonar   $PING,17*hh
//     sonar to chip   $SONAR,17,4.125,1.0923*hh     sample, range [m], bearing [rad]
#pragma once

#include <Arduino.h>
#include <auvest.h>
#include <stdlib.h>
#include <string.h>

#include "text_line.h"
#include "wake_timer.h"

class SerialSonar {
 public:
  using Measurement = auvest::Vector<float, 2>;

  explicit SerialSonar(uint8_t trigger_pin) : pin_(trigger_pin) {}

  void begin() {
    pinMode(pin_, OUTPUT);
    digitalWrite(pin_, LOW);
  }

  /// Starts a measurement. An answer that is still under way belongs to an earlier one.
  void trigger(uint32_t sample) {
    digitalWrite(pin_, HIGH);
    delayMicroseconds(10);
    digitalWrite(pin_, LOW);
    while (Serial.available() > 0) Serial.read();
    line_.forget();
    sample_ = sample;
    LineOut<24> request;
    request.start("PING");
    request.field(sample);
    request.finish();
    request.send();
  }

  /// Sleeps until the answer is here or `limit` has come, and sends `line` meanwhile. False: there
  /// is no measurement.
  template <class Line>
  bool await(uint32_t limit, Measurement& z, Line& line) {
    for (;;) {
      wake_timer::sleep_until([&] { return Serial.available() > 0 || line.sendable(); }, limit);
      line.send_some();
      while (Serial.available() > 0) {
        const LineIn::Result result = line_.take(static_cast<char>(Serial.read()));
        if (result == LineIn::Result::kMore) continue;
        if (result == LineIn::Result::kLine && parse(line_.text(), z)) return true;
        ++refused_;
      }
      if (wake_timer::reached(limit)) return false;
    }
  }

  /// Lines so far that were corrupt, or an answer to another sample.
  uint32_t refused() const { return refused_; }

 private:
  bool parse(const char* text, Measurement& z) const {
    if (strncmp(text, "SONAR,", 6) != 0) return false;
    char* end;
    if (strtoul(text + 6, &end, 10) != sample_) return false;
    for (int i = 0; i < 2; ++i) {
      if (*end != ',') return false;
      const char* const begin = end + 1;
      z(i) = static_cast<float>(strtod(begin, &end));
      if (end == begin || !auvest::math::is_finite(z(i))) return false;
    }
    return *end == '\0';
  }

  uint8_t pin_;
  uint32_t sample_ = 0;
  uint32_t refused_ = 0;
  LineIn line_;
};
