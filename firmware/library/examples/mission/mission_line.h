// What the sketch and the vehicle say to each other: lines $body*hhhhhhhh over Serial
// (auvest/board/line.hpp). This header is all that knows their bodies; auvest has them in
// python/auvest/mission_line.py.
//
//     from the vehicle
//     START,x,y,heading              where it is put into the water [m], [rad]: once, at first
//     COMPASS,sample,heading,pitch   [rad]
//     GYRO,sample,q,r                pitch rate, yaw rate [rad/s]
//     LOG,sample,u,v                 through the water, ahead and to starboard [m/s]
//     DEPTH,sample,z                 [m]
//     FIX,sample,range,bearing,delay [m], [rad]; the sample that asked for it, and the seconds
//                                    from then until what was measured was so
//     to the vehicle
//     READY                          once a second until it is told where it starts
//     SENSE,sample,ping              readings, please; ping is 1 where a fix is wanted too
//     STEER,sample,rudder,planes,propeller   [rad], [rad], [rev/s]; floats by their bits
//
// Numbers are as auvest/board/line.hpp says: no exponents, and the desk gets the same bits.
//
// A reading is believed if its line is whole and of this sample; a fix if it is of this sample or
// an earlier one. All other lines are refused and counted.
#pragma once

#include <Arduino.h>
#include <auvest.h>
#include <auvest_text_line.h>
#include <auvest_wake_timer.h>

namespace wake_timer = auvest_board::wake_timer;

/// Where the vehicle begins.
struct MissionStart {
  float x_m, y_m, heading_rad;
};

/// A fix, as it came.
struct MissionFix {
  auvest::Vector<float, 2> z;  ///< range [m] and bearing [rad]
  uint32_t sample;             ///< that asked for it
  float delay_s;               ///< from then until it was so
};

class MissionLine {
 public:
  using Readings = auvest::PilotReadings<float>;
  static constexpr uint8_t kAllHeard =
      auvest::kCompassHeard | auvest::kGyroHeard | auvest::kLogHeard | auvest::kDepthHeard;
  /// Fixes that may come within one period; of more, the last are refused.
  static constexpr uint8_t kFixes = 2;
  /// Ticks for which characters are gathered, 1.5 ms, 17 of them; and how many are enough, of the
  /// 64 for which Arduino has room.
  static constexpr uint32_t kGather = wake_timer::to_ticks(0.0015f);
  static constexpr int kFull = 32;

  /// What comes from here on belongs to a new sample. A line under way is read to its end: it may
  /// be a late fix.
  void begin(uint32_t sample) {
    sample_ = sample;
    readings_.heard = 0;
  }

  /// Readings that come from here on are too late.
  void close() { readings_.heard = kAllHeard; }

  void announce() {
    auvest_board::StoredLine<24> line;
    line.start("READY");
    line.finish();
    line.send();
  }

  void ask(bool ping) {
    auvest_board::StoredLine<32> line;
    line.start("SENSE");
    line.field(sample_);
    line.field(static_cast<uint32_t>(ping));
    line.finish();
    line.send();
  }

  void steer(const auvest::TorpedoCommand<float>& command) {
    auvest_board::StoredLine<64> line;
    line.start("STEER");
    line.field(sample_);
    line.field(command.rudder_rad);
    line.field(command.stern_planes_rad);
    line.field(command.propeller_rev_s);
    line.finish();
    line.send();
  }

  /// Reads what comes until `limit`, asleep in between, and sends `line` meanwhile. True as soon as
  /// done() is.
  template <class Done, class Line>
  bool await(Done done, uint32_t limit, Line& line) {
    for (;;) {
      wake_timer::sleep_until([&] { return Serial.available() > 0 || line.sendable(); }, limit);
      // To look at every character costs ten times what its interrupt does: they are gathered.
      const uint32_t gathered = wake_timer::now() + kGather;
      if (!wake_timer::reached(limit - kGather)) {
        wake_timer::sleep_until([] { return Serial.available() >= kFull; }, gathered);
      }
      line.send_some();
      while (Serial.available() > 0) {
        const auvest::LineIn::Result result = line_.take(static_cast<char>(Serial.read()));
        if (result == auvest::LineIn::Result::kMore) continue;
        if (result != auvest::LineIn::Result::kLine || !parse(line_.text())) ++refused_;
        if (done()) return true;
      }
      if (wake_timer::reached(limit)) return false;
    }
  }

  bool started() const { return started_; }
  const MissionStart& start() const { return start_; }
  bool all_heard() const { return readings_.heard == kAllHeard; }
  const Readings& readings() const { return readings_; }  ///< of this sample

  uint8_t fixes() const { return fixes_; }
  const MissionFix& fix(uint8_t i) const { return fix_[i]; }
  void forget_fixes() { fixes_ = 0; }

  /// Lines so far that were corrupt, or of no use.
  uint32_t refused() const { return refused_; }

 private:
  bool parse(const char* text) {
    auvest::LineFields fields(text);
    float n[3];
    uint32_t sample;
    if (fields.named("COMPASS")) {
      if (!numbers(fields, &sample, n, 2) || !hear(sample, auvest::kCompassHeard)) return false;
      readings_.heading_rad = n[0];
      readings_.pitch_rad = n[1];
    } else if (fields.named("GYRO")) {
      if (!numbers(fields, &sample, n, 2) || !hear(sample, auvest::kGyroHeard)) return false;
      readings_.pitch_rate_rad_s = n[0];
      readings_.yaw_rate_rad_s = n[1];
    } else if (fields.named("LOG")) {
      if (!numbers(fields, &sample, n, 2) || !hear(sample, auvest::kLogHeard)) return false;
      readings_.speed_m_s = n[0];
      readings_.sway_m_s = n[1];
    } else if (fields.named("DEPTH")) {
      if (!numbers(fields, &sample, n, 1) || !hear(sample, auvest::kDepthHeard)) return false;
      readings_.depth_m = n[0];
    } else if (fields.named("FIX")) {
      if (!numbers(fields, &sample, n, 3) || fixes_ == kFixes || sample > sample_) return false;
      MissionFix& fix = fix_[fixes_++];
      fix.z(0) = n[0];
      fix.z(1) = n[1];
      fix.sample = sample;
      fix.delay_s = n[2];
    } else if (fields.named("START")) {
      if (started_ || !numbers(fields, nullptr, n, 3)) return false;
      start_.x_m = n[0];
      start_.y_m = n[1];
      start_.heading_rad = n[2];
      started_ = true;
    } else {
      return false;
    }
    return true;
  }

  /// Only once per sample: of two readings the first counts.
  bool hear(uint32_t sample, uint8_t sensor) {
    if (sample != sample_ || (readings_.heard & sensor)) return false;
    readings_.heard |= sensor;
    return true;
  }

  /// A sample number, if one is asked for, and so many numbers; nothing else.
  static bool numbers(auvest::LineFields& fields, uint32_t* sample, float* n, uint8_t count) {
    if (sample && !fields.take(*sample)) return false;
    for (uint8_t i = 0; i < count; ++i) {
      if (!fields.take(n[i])) return false;
    }
    return fields.at_end();
  }

  uint32_t sample_ = 0;
  uint32_t refused_ = 0;
  bool started_ = false;
  MissionStart start_ = {0, 0, 0};
  Readings readings_;
  MissionFix fix_[kFixes];
  uint8_t fixes_ = 0;
  auvest::LineIn line_;
};
