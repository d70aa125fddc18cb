// The sonar on the other end of Serial: a pulse on a pin triggers it, a line says which sample it
// is, and its answer, range [m] and bearing [rad], comes as a line.
#pragma once

#include <Arduino.h>
#include <auvest_instruments.h>

class SerialSonar {
 public:
  using Measurement = auvest_board::SerialInstruments::Answer;

  explicit SerialSonar(uint8_t trigger_pin) : pin_(trigger_pin) {}

  void begin() {
    pinMode(pin_, OUTPUT);
    digitalWrite(pin_, LOW);
  }

  /// Starts a measurement.
  void trigger(uint32_t sample) {
    digitalWrite(pin_, HIGH);
    delayMicroseconds(10);
    digitalWrite(pin_, LOW);
    serial_.begin(sample);
    serial_.ask("PING");
  }

  /// Sleeps until the answer is here or `limit` has come, and sends `line` meanwhile. False: there
  /// is no measurement.
  template <class Line>
  bool await(uint32_t limit, Measurement& z, Line& line) {
    return serial_.await("SONAR", limit, z, line);
  }

  /// Lines so far that were corrupt, or an answer to another sample.
  uint32_t refused() const { return serial_.refused(); }

 private:
  uint8_t pin_;
  auvest_board::SerialInstruments serial_;
};
