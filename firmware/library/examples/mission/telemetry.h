// A line of text about a sample, and the comment that names its columns.
//
// auvest reads it back in python/auvest/telemetry.py.
#pragma once

#include <Arduino.h>
#include <auvest.h>
#include <auvest_text_line.h>
#include <auvest_wake_timer.h>

/// What a sample was besides the state of the pilot. Counters run from the start.
struct Sample {
  uint32_t number = 0;
  auvest_board::wake_timer::Elapsed time;       ///< of the sample, since the start
  float dt = 0;                                 ///< predicted over [s]
  uint8_t heard = 0;                            ///< PilotSensor bits
  uint8_t fixes = 0;                            ///< taken by the filter in this sample
  float nis = 0;                                ///< of the last of them
  auvest::Status status = auvest::Status::kOk;  ///< the first that is not kOk
  uint32_t missed = 0;                          ///< readings that did not come
  uint32_t refused = 0;                         ///< lines received that were of no use
  uint32_t late = 0;                            ///< samples taken after their deadline
  uint32_t awake = 0;                           ///< ticks since the line before
};

class Telemetry {
  static constexpr size_t kNumbers = 11;
  static constexpr size_t kCapacity = 112 + kNumbers * 9;

 public:
  using Line = auvest_board::StoredLine<kCapacity>;

  /// Names the columns, those of whole numbers with #; to be sent once, before the first line.
  static void introduce() {
    auvest_board::LineOut line;
    line.start("COLUMNS");
    line.print(
        F(",MISSION,sample#,time_s,dt_s,heard#,fixes#,mode#,leg#,x_m,y_m,current_x_m_s,"
          "current_y_m_s,P00_m2,P10_m2,P11_m2,heading_rad,cross_m,nis,"
          "status#,missed#,implausible#,refused#,late#,awake_us#"));
    line.finish();
    Serial.flush();
  }

  template <class Pilot>
  void write(const Sample& sample, const Pilot& pilot) {
    line_.start("MISSION");
    line_.field(sample.number);
    line_.field(sample.time);
    line_.field(sample.dt);
    line_.field(static_cast<uint32_t>(sample.heard));
    line_.field(static_cast<uint32_t>(sample.fixes));
    line_.field(static_cast<uint32_t>(pilot.mode()));
    line_.field(static_cast<uint32_t>(pilot.path().leg()));
    for (int i = 0; i < 4; ++i) line_.field(pilot.filter().x()(i));
    const auto& P = pilot.filter().belief().P;
    line_.field(P(0, 0));
    line_.field(P(1, 0));
    line_.field(P(1, 1));
    line_.field(pilot.heading_rad());
    line_.field(pilot.cross_track_m());
    if (sample.fixes > 0) {
      line_.field(sample.nis);
    } else {
      line_.empty_field();
    }
    line_.field(static_cast<uint32_t>(sample.status));
    line_.field(sample.missed);
    line_.field(pilot.implausible());
    line_.field(sample.refused);
    line_.field(sample.late);
    line_.field(sample.awake * auvest_board::kMicrosecondsPerTick);
    line_.finish();
  }

  Line& line() { return line_; }

 private:
  Line line_;
};
