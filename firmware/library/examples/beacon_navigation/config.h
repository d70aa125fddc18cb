// The settings of this sketch.
#pragma once

#include <auvest.h>

/// Where the beacons are, m.
constexpr float kBeacons[3][2] = {{0, 0}, {120, 0}, {60, 90}};
constexpr uint8_t kBeaconCount = 3;

/// Where the vehicle is at the start, m, and how sure that is.
constexpr float kStart[2] = {10, 10};
constexpr float kSigmaStart = 5;

/// Standard deviations: of speed and heading, m/s and rad in a reading per second; of a range, m.
constexpr float kSigmaSpeed = 0.05f;
constexpr float kSigmaHeading = 0.05f;
constexpr float kSigmaRange = 0.5f;

/// Seconds between two samples: each has a reading, and asks one beacon.
constexpr float kPeriod = 1;

/// What is taken for a reading until the first one comes: m/s, rad.
constexpr float kCruiseSpeed = 1;
constexpr float kCruiseHeading = 0;

/// From the moment of the sample to the last character of the reading, s.
constexpr float kReadingTimeout = 0.1f;

/// Predictions and ranges that are kept, 45 bytes each: with 6, which an UNO has room for, a range
/// may be 3 samples late, and mostly 5. A MEGA2560 has room for a hundred.
constexpr int kKeptEvents = 6;

/// No reading or range can be beyond these: m/s, m/s^2, rad/s, m.
constexpr float kFastest = 3;
constexpr float kHardest = 1;
constexpr float kFastestTurn = 0.8f;
constexpr float kLargestRange = 500;

/// A range this many sigma off is not believed, one beyond the first of them less. Several of them
/// that agree say that the estimate is wrong: then the filter recovers.
constexpr float kDoubt = 1.5f;
constexpr float kGate = 3;

/// Dead reckoning by speed and heading; x is north, y is east, the heading clockwise from north.
struct Process : auvest::SpeedHeading<float> {
  Process() {
    params.sigma_forward = kSigmaSpeed;
    params.sigma_heading = kSigmaHeading;
  }
};

struct Kernel : auvest::Igg<float> {
  Kernel() {
    params.k0 = kDoubt;
    params.k1 = kGate;
  }
};

using Filter = auvest::RobustEkf<Process, Kernel>;

/// Floats are sent as their bits, 8 hexadecimal digits. false: with 3 decimals, to be read in the
/// Serial Monitor.
constexpr bool kExactText = true;

/// RAM that is kept for the stack and for what Arduino itself takes, bytes. The sketch prints what
/// it has left unused.
constexpr size_t kStackReserve = 800;
