// The lines of this sketch: what was resumed, what is being kept, and one for each sample.
#pragma once

#include <Arduino.h>
#include <auvest.h>
#include <auvest_text_line.h>
#include <auvest_wake_timer.h>

#include "config.h"

namespace wake_timer = auvest_board::wake_timer;

/// What a sample was besides the state of the filter.
struct Sample {
  uint32_t number = 0;
  wake_timer::Elapsed time;                     ///< of the sample
  bool measured = false;                        ///< there is a range
  float range = 0;                              ///< [m]
  uint32_t beacon = 0;                          ///< that it is to
  auvest::Status status = auvest::Status::kOk;  ///< the first that is not kOk
  uint32_t awake = 0;                           ///< ticks since the line before
};

/// How long ago a checkpoint was made [s].
struct Age {
  float least;
  float most;
};

class Telemetry {
 public:
  using Line = auvest_board::StoredLine<160>;

  /// Names the columns; to be sent once, before the first line.
  static void introduce() {
    auvest_board::LineOut line;
    line.start("COLUMNS");
    line.print(
        F(",CRAFT,sample#,time_s,range_m,beacon#,x_m,y_m,vx_m_s,vy_m_s,P00_m2,P10_m2,P11_m2,"
          "status#,awake_us#"));
    line.finish();
  }

  /// $RESUME,sequence,seconds,sum,least,most,status,x,y: from which checkpoint (its CRC-32 as 8
  /// hexadecimal digits), how old it is, and where the craft was. Sequence 0: from none.
  static void resumed(const auvest::Resumed& resumed, uint32_t sum, const Age& age,
                      const Filter& filter) {
    auvest_board::LineOut line;
    line.start("RESUME");
    line.field(resumed.sequence);
    line.field(resumed.time.seconds);
    line.field(auvest::math::from_bits(sum));
    line.field(age.least);
    line.field(age.most);
    line.field(static_cast<uint32_t>(resumed.status));
    for (int i = 0; i < 2; ++i) line.field(filter.x()(i));
    line.finish();
  }

  /// $SAVE,sequence,sum: a checkpoint has begun.
  static void saving(uint32_t sequence, uint32_t sum) {
    auvest_board::LineOut line;
    line.start("SAVE");
    line.field(sequence);
    line.field(auvest::math::from_bits(sum));
    line.finish();
  }

  void write(const Sample& sample, const Filter& filter) {
    line_.start("CRAFT");
    line_.field(sample.number);
    line_.field(sample.time);
    if (sample.measured) {
      line_.field(sample.range);
      line_.field(sample.beacon);
    } else {
      line_.empty_field();
      line_.empty_field();
    }
    for (int i = 0; i < 4; ++i) line_.field(filter.x()(i));
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j <= i; ++j) line_.field(filter.belief().P(i, j));
    }
    line_.field(static_cast<uint32_t>(sample.status));
    line_.field(sample.awake * auvest_board::kMicrosecondsPerTick);
    line_.finish();
  }

  Line& line() { return line_; }

 private:
  Line line_;
};
