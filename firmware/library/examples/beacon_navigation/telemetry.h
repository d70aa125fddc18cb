// One line of text per sample, and the line that names its columns.
//
// auvest reads it back in python/auvest/telemetry.py.
#pragma once

#include <Arduino.h>
#include <auvest.h>
#include <auvest_text_line.h>
#include <auvest_wake_timer.h>

#include "config.h"

namespace wake_timer = auvest_board::wake_timer;

/// What a sample was besides the state of the filter. Counters run from the start.
struct Sample {
  uint32_t number = 0;
  wake_timer::Elapsed time;                     ///< of the sample, since the start
  float dt = 0;                                 ///< predicted over [s]
  bool read = false;                            ///< a reading has come, and can be true
  auvest::Vector<float, 3> u;                   ///< the last: speed ahead, to starboard, heading
  bool heard = false;                           ///< a range has come
  bool corrected = false;                       ///< and the filter has taken it
  uint32_t beacon = 0;                          ///< of the range
  float range_m = 0;                            ///< as it came
  float age = 0;                                ///< [s]
  float nis = 0;                                ///< of the range, as the filter was then
  float weight = 0;                             ///< 0 beyond the gate, 1 without doubt
  auvest::Status status = auvest::Status::kOk;  ///< the first that is not kOk
  uint32_t missed = 0;                          ///< readings and ranges that did not come
  uint32_t refused = 0;                         ///< lines received that were of no use
  uint32_t implausible = 0;                     ///< readings and ranges beyond their limits
  uint32_t gated = 0;                           ///< ranges beyond the gate
  uint32_t late = 0;                            ///< samples taken after their deadline
  uint32_t awake = 0;                           ///< ticks since the line before
};

class Telemetry {
  static constexpr size_t kNumbers = 12;
  static constexpr size_t kCapacity = 96 + kNumbers * (kExactText ? 9 : 10);

 public:
  using Line = auvest_board::SampleLine<kCapacity, kExactText, 3>;

  /// Names the columns, those of whole numbers with #; to be sent once, before the first line.
  static void introduce() {
    auvest_board::LineOut line;
    line.start("COLUMNS");
    line.print(
        F(",NAV,sample#,time_s,dt_s,speed_m_s,heading_rad,beacon#,range_m,age_s,x_m,y_m,"
          "P00_m2,P10_m2,P11_m2,nis,weight,status#,missed#,refused#,implausible#,gated#,late#,"
          "awake_us#"));
    line.finish();
    Serial.flush();
  }

  void write(const Sample& sample, const Filter& filter) {
    line_.start("NAV");
    line_.field(sample.number);
    line_.field(sample.time);
    line_.number(sample.dt);
    line_.optional(sample.read, sample.u(0));
    line_.optional(sample.read, sample.u(2));
    if (sample.heard) {
      line_.field(sample.beacon);
    } else {
      line_.empty_field();
    }
    line_.optional(sample.heard, sample.range_m);
    line_.optional(sample.heard, sample.age);
    for (int i = 0; i < 2; ++i) line_.number(filter.x()(i));
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j <= i; ++j) line_.number(filter.belief().P(i, j));
    }
    line_.optional(sample.corrected, sample.nis);
    line_.optional(sample.corrected, sample.weight);
    line_.field(static_cast<uint32_t>(sample.status));
    line_.field(sample.missed);
    line_.field(sample.refused);
    line_.field(sample.implausible);
    line_.field(sample.gated);
    line_.field(sample.late);
    line_.field(sample.awake * auvest_board::kMicrosecondsPerTick);
    line_.finish();
  }

  Line& line() { return line_; }

 private:
  Line line_;
};
