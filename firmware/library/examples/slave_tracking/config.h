// The settings of this sketch: the scenario of the SLATF paper, section 7, noise level 3.
#pragma once

#include <auvest.h>

/// How the slave moves: by the speed of its log and the heading of its compass.
using Motion = auvest::CompassMotion<float>;

/// How the master moves, but for what it has planned (master_plan.h).
using Master = auvest::PiecewiseAcceleration<float>;

/// Joint particles with one covariance: 36 bytes each, with a gate and a way back to a master that
/// is lost. The paper's SLATF 2.0, with 132 bytes each, has no RAM for these, and is too sure of
/// itself: for it name Slatf2<Motion, Master, 1, auvest::SystematicResampling,
/// auvest::OneLane<float>, auvest::NoSafeguards>, 48 particles and no gate.
using Filter = auvest::SlatfShared<Motion, Master, 1>;

/// Particles. With 64 the echo is taken in and told before the next reading, a second after the
/// ping; the RAM has room for 100, which need pings whose echoes come back within 0.3 s.
constexpr int kParticles = 64;

/// Another seed, other random numbers. Fixed: a run can be repeated on the desk, to the bit.
constexpr uint32_t kSeed = 1;

/// Standard deviations: of the readings (m/s, rad), of the echoes (m, rad).
constexpr float kSigmaSpeed = 2;
constexpr float kSigmaHeading = 0.3f;
constexpr float kSigmaRange = 1;
constexpr float kSigmaBearing = 0.06f;

/// Seconds between two readings, and readings per ping.
constexpr float kPeriod = 1;
constexpr uint32_t kReadingsPerPing = 2;

/// What is taken for a reading until the first one comes: m/s, rad.
constexpr float kCruiseSpeed = 5.1444f;
constexpr float kCruiseHeading = 0.5235988f;

constexpr uint8_t kTriggerPin = 8;

/// From the moment of the sample to the last character of the answer, s. Sound needs 0.6 s for
/// 450 m and back.
constexpr float kReadingTimeout = 0.1f;
constexpr float kEchoTimeout = 0.6f;

/// No reading or echo can be beyond these: m/s; m, sound has not come back from further in time;
/// and what the range changes by, m/s, but for the noise of two echoes.
constexpr float kFastest = 20;
constexpr float kLargestRange = 750 * kEchoTimeout;
constexpr float kFastestApproach = 30;

/// An echo whose NIS is beyond it says nothing to a particle: 13.8 loses one good one in 1,000. 0:
/// every echo counts, as in the paper; without Safeguards there is no way back from a gate.
constexpr float kGate = 13.8f;

/// Floats are sent as their bits, 8 hexadecimal digits. false: with 3 decimals, to be read in the
/// Serial Monitor.
constexpr bool kExactText = true;

/// RAM that is kept for the stack and for what Arduino itself takes, bytes. The sketch prints what
/// it has left unused.
constexpr size_t kStackReserve = 2048;
