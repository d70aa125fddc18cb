// Compass and log, and the modem, on the other end of Serial.
//
//     chip to compass and log   $ODO,17*hhhhhhhh
//     compass and log to chip   $MOTION,17,1.52,0.5301*hhhhhhhh   sample, speed [m/s], heading
//     [rad] chip to modem             $INTERROGATE,17,2*hhhhhhhh        sample, beacon modem to
//     chip             $RANGE,17,101.25*hhhhhhhh         sample, range [m]
//
// A reading counts for its sample only. A range comes when sound and modem are through, seconds
// later: the sample says which beacon it is of, and how old it is.
#pragma once

#include <Arduino.h>
#include <auvest.h>
#include <auvest_text_line.h>
#include <auvest_wake_timer.h>

namespace wake_timer = auvest_board::wake_timer;

struct RangeReply {
  uint32_t sample;
  float range_m;
};

class Instruments {
 public:
  static constexpr uint8_t kAsked = 8;  ///< interrogations that are remembered

  /// Asks for the reading of this sample, whose moment is `moment`, and one of the beacons.
  void ask(uint32_t sample, uint32_t moment, uint32_t beacon) {
    sample_ = sample;
    read_ = false;
    Asked& asked = asked_[sample % kAsked];
    if (sample > kAsked && !asked.answered) ++missed_;
    asked.moment = moment;
    asked.answered = false;
    auvest_board::StoredLine<40> request;
    request.start("ODO");
    request.field(sample);
    request.finish();
    request.send();
    request.start("INTERROGATE");
    request.field(sample);
    request.field(beacon);
    request.finish();
    request.send();
  }

  /// Sleeps until `limit`, takes what comes and sends `line` meanwhile. Ends sooner if it is a
  /// reading that is waited for: true, if it is here.
  template <class Line>
  bool listen(uint32_t limit, bool for_reading, Line& line) {
    for (;;) {
      wake_timer::sleep_until([&] { return Serial.available() > 0 || line.sendable(); }, limit);
      line.send_some();
      while (Serial.available() > 0) {
        const auvest::LineIn::Result result = line_.take(static_cast<char>(Serial.read()));
        if (result == auvest::LineIn::Result::kMore) continue;
        if (result != auvest::LineIn::Result::kLine || !take(line_.text())) ++refused_;
      }
      if (for_reading && read_) return true;
      if (wake_timer::reached(limit)) return false;
    }
  }

  /// The last reading: speed [m/s] and heading [rad].
  const float* reading() const { return reading_; }

  /// The first of the ranges that have come. False: there is none.
  bool next(RangeReply& reply) {
    if (replies_ == 0) return false;
    reply = reply_[0];
    --replies_;
    for (uint8_t i = 0; i < replies_; ++i) reply_[i] = reply_[i + 1];
    return true;
  }

  /// How long before `moment` the sample of a reply was, s.
  float age(const RangeReply& reply, uint32_t moment) const {
    return wake_timer::to_seconds(moment - asked_[reply.sample % kAsked].moment);
  }

  uint32_t missed() const { return missed_; }    ///< interrogations without an answer
  uint32_t refused() const { return refused_; }  ///< lines that were corrupt, or no answer

 private:
  static constexpr uint8_t kReplies = 4;

  struct Asked {
    uint32_t moment;
    bool answered = false;
  };

  bool take(const char* text) {
    auvest::LineFields fields(text);
    uint32_t sample;
    float numbers[2];
    if (fields.named("MOTION")) {
      if (!fields.take(sample) || sample != sample_ || !fields.take(numbers[0]) ||
          !fields.take(numbers[1]) || !fields.at_end()) {
        return false;
      }
      reading_[0] = numbers[0];
      reading_[1] = numbers[1];
      return read_ = true;
    }
    if (!fields.named("RANGE") || !fields.take(sample) || !fields.take(numbers[0]) ||
        !fields.at_end()) {
      return false;
    }
    // Answered once: the same range twice would count as two.
    const bool asked = sample != 0 && sample <= sample_ && sample_ - sample < kAsked;
    if (!asked || asked_[sample % kAsked].answered || replies_ == kReplies) return false;
    asked_[sample % kAsked].answered = true;
    reply_[replies_].sample = sample;
    reply_[replies_].range_m = numbers[0];
    ++replies_;
    return true;
  }

  auvest::LineIn line_;
  uint32_t sample_ = 0;
  bool read_ = false;
  float reading_[2];
  Asked asked_[kAsked];
  RangeReply reply_[kReplies];
  uint8_t replies_ = 0;
  uint32_t missed_ = 0;
  uint32_t refused_ = 0;
};
