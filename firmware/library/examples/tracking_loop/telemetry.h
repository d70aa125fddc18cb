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
  bool measured = false;                        ///< there is a z
  auvest::Vector<float, 2> z;                   ///< range [m] and bearing [rad]
  auvest::Vector<float, 2> desired;             ///< position [m]
  float nis = 0;                                ///< of z; below 0: the filter has not looked at it
  auvest::Status status = auvest::Status::kOk;  ///< the first that is not kOk
  uint32_t missed = 0;                          ///< samples without a measurement
  uint32_t refused = 0;                         ///< lines received that were of no use
  uint32_t late = 0;                            ///< samples taken after their deadline
  uint32_t awake = 0;                           ///< ticks since the line before
};

class Telemetry {
  static_assert(kCovarianceRows >= 1 && kCovarianceRows <= 6, "P has 1 to 6 rows to send");
  static constexpr size_t kNumbers = 13 + kCovarianceRows * (kCovarianceRows + 1) / 2;
  static constexpr size_t kCapacity = 88 + kNumbers * (kExactText ? 9 : 14);

 public:
  using Line = auvest_board::SampleLine<kCapacity, kExactText, 6>;

  /// Names the columns, those of whole numbers with #; to be sent once, before the first line.
  static void introduce() {
    auvest_board::LineOut line;
    line.start("COLUMNS");
    line.print(
        F(",AUV,sample#,time_s,dt_s,range_m,bearing_rad,desired_x_m,desired_y_m,"
          "x_m,y_m,vx_m_s,vy_m_s,ax_m_s2,ay_m_s2"));
    for (int i = 0; i < kCovarianceRows; ++i) {
      for (int j = 0; j <= i; ++j) {
        line.print(F(",P"));
        line.print(i);
        line.print(j);
        line.print(F("_m2"));
        const int per_seconds = i / 2 + j / 2;
        if (per_seconds > 0) line.print(F("_s"));
        if (per_seconds > 1) line.print(per_seconds);
      }
    }
    line.print(F(",nis,interval_s,status#,missed#,refused#,late#,awake_us#"));
    line.finish();
    Serial.flush();
  }

  template <class Filter>
  void write(const Sample& sample, const Filter& filter) {
    line_.start("AUV");
    line_.field(sample.number);
    line_.field(sample.time);
    line_.number(sample.dt);
    for (int i = 0; i < 2; ++i) line_.optional(sample.measured, sample.z(i));
    for (int i = 0; i < 2; ++i) line_.number(sample.desired(i));
    for (int i = 0; i < 6; ++i) line_.number(filter.x()(i));
    for (int i = 0; i < kCovarianceRows; ++i) {
      for (int j = 0; j <= i; ++j) line_.number(filter.belief().P(i, j));
    }
    line_.optional(sample.nis >= 0, sample.nis);
    line_.number(filter.interval());
    line_.field(static_cast<uint32_t>(sample.status));
    line_.field(sample.missed);
    line_.field(sample.refused);
    line_.field(sample.late);
    line_.field(sample.awake * auvest_board::kMicrosecondsPerTick);
    line_.finish();
  }

  Line& line() { return line_; }

 private:
  Line line_;
};
