// The settings of this sketch.
#pragma once

#include <auvest.h>

/// How the craft moves: at a velocity that white accelerations push.
using Process = auvest::WhiteAcceleration<float, 2>;
using Filter = auvest::RobustEkf<Process>;

/// Another number wherever what is kept has another meaning (another process, other axes): what a
/// sketch of before has left in the EEPROM is then not taken for this one's.
constexpr uint16_t kKind = 1;

constexpr float kPeriod = 0.5f;         ///< from range to range [s]
constexpr float kAnswerTimeout = 0.1f;  ///< from a request to the last character of the answer [s]

/// From checkpoint to checkpoint [s]. With 60 s the EEPROM of a MEGA2560 lives for 6.8 years of
/// being switched on: firmware/README.md of auvest has the formula.
constexpr float kCheckpointPeriod = 60;

/// How long the power is off at most, the bootloader's seconds and tries of less than 0.1 s
/// included [s]. Without a clock that goes on meanwhile, the belief is widened by what the craft
/// may do in that time. Where nothing bounds it, a checkpoint is worth nothing: start anew.
constexpr float kLongestOff = 60;

/// What may be older than this is not worth resuming [s].
constexpr float kOldest = 3600;

/// The beacons, and how well a range to one is known [m].
constexpr float kBeacons[3][2] = {{0, 0}, {80, 0}, {40, 70}};
constexpr float kSigmaRange = 0.5f;
constexpr float kLargestRange = 75;

/// Where the craft is when nothing is known from before, and how well that is known [m], [m/s].
constexpr float kStart[2] = {20, 20};
constexpr float kSigmaStart = 5;
constexpr float kSigmaVelocity = 0.5f;

/// RAM that is kept for the stack, bytes.
constexpr size_t kStackReserve = 700;
