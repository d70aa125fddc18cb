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
  bool read = false;                            ///< a reading has come
  auvest::Vector<float, 2> u;                   ///< the last: speed [m/s] and heading [rad]
  bool pinged = false;                          ///< the sonar was triggered
  bool heard = false;                           ///< and there is an echo
  auvest::Vector<float, 2> z;                   ///< its range [m] and bearing [rad]
  auvest::Status status = auvest::Status::kOk;  ///< the first that is not kOk
  uint32_t missed = 0;                          ///< readings and echoes that did not come
  uint32_t refused = 0;                         ///< lines received that were of no use
  uint32_t implausible = 0;                     ///< readings and echoes beyond their limits
  uint32_t late = 0;                            ///< samples taken after their deadline
  uint32_t awake = 0;                           ///< ticks since the line before
};

/// Echoes beyond the gate and masters born again since the start; none without Safeguards.
struct Refusals {
  template <class Guard>
  static uint32_t gated(const Guard& guard) {
    return static_cast<uint32_t>(guard.report().refused);
  }
  template <class Guard>
  static uint32_t rebirths(const Guard& guard) {
    return static_cast<uint32_t>(guard.report().rebirths);
  }
  static uint32_t gated(const auvest::NoSafeguards&) { return 0; }
  static uint32_t rebirths(const auvest::NoSafeguards&) { return 0; }
};

class Telemetry {
  static constexpr size_t kNumbers = 18;
  static constexpr size_t kCapacity = 104 + kNumbers * (kExactText ? 9 : 10);

 public:
  using Line = auvest_board::SampleLine<kCapacity, kExactText, 3>;

  /// Names the columns, those of whole numbers with #; to be sent once, before the first line.
  static void introduce() {
    auvest_board::LineOut line;
    line.start("COLUMNS");
    line.print(
        F(",SLAVE,sample#,time_s,dt_s,speed_m_s,heading_rad,range_m,bearing_rad,"
          "x_m,y_m,P00_m2,P10_m2,P11_m2,master_x_m,master_y_m,master_vx_m_s,master_vy_m_s,"
          "master_P00_m2,master_P10_m2,master_P11_m2,n_eff,resamplings#,"
          "status#,missed#,refused#,implausible#,gated#,rebirths#,"
          "late#,awake_us#"));
    line.finish();
    Serial.flush();
  }

  /// The estimates only after a ping: they take a tenth of a second.
  void write(const Sample& sample, const Filter& filter) {
    line_.start("SLAVE");
    line_.field(sample.number);
    line_.field(sample.time);
    line_.number(sample.dt);
    for (int i = 0; i < 2; ++i) line_.optional(sample.read, sample.u(i));
    for (int i = 0; i < 2; ++i) line_.optional(sample.heard, sample.z(i));
    if (sample.pinged) {
      write_slave(filter.slave());
      write_master(filter.master(0));
    } else {
      for (int i = 0; i < 12; ++i) line_.empty_field();
    }
    line_.optional(sample.heard, filter.effective_size());
    line_.field(static_cast<uint32_t>(filter.resamplings()));
    line_.field(static_cast<uint32_t>(sample.status));
    line_.field(sample.missed);
    line_.field(sample.refused);
    line_.field(sample.implausible);
    line_.field(Refusals::gated(filter.safeguards()));
    line_.field(Refusals::rebirths(filter.safeguards()));
    line_.field(sample.late);
    line_.field(sample.awake * auvest_board::kMicrosecondsPerTick);
    line_.finish();
  }

  Line& line() { return line_; }

 private:
  void write_slave(const Filter::SlaveBelief& slave) {
    for (int i = 0; i < 2; ++i) line_.number(slave.x(i));
    write_position_covariance(slave.P);
  }

  void write_master(const Filter::MasterBelief& master) {
    for (int i = 0; i < 4; ++i) line_.number(master.x(i));
    write_position_covariance(master.P);
  }

  template <class Covariance>
  void write_position_covariance(const Covariance& P) {
    line_.number(P(0, 0));
    line_.number(P(1, 0));
    line_.number(P(1, 1));
  }

  Line line_;
};
