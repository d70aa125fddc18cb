// The settings of this sketch.
#pragma once

#include <auvest.h>

/// When the next fix is asked for. MahalanobisInterval is the AUKF paper's law, CovarianceBudget
/// asks before the position is known worse than to a bound.
using IntervalPolicy = auvest::FixedInterval<float>;

/// Predictions and fixes that are kept for a fix that comes late: 16 are 1.3 s at ten predictions
/// and two fixes a second. 50 bytes of RAM each.
constexpr int kKeptEvents = 16;

/// Seconds between two samples, and between two fixes.
constexpr float kPeriod = 0.1f;
constexpr float kFixInterval = 0.5f;

/// From the moment of the sample to the last character of the last reading, s. What has not come by
/// then is silent in this period.
constexpr float kReadingTimeout = 0.04f;

/// What is flown (plan.h): speed through the water, m/s, and depth, m.
constexpr float kSpeed = 1.5f;
constexpr float kDepth = 5;
/// The next leg begins this much before a corner; the plan is over this much before its end, m.
constexpr float kSwitch = 12;
constexpr float kEnd = 2;

/// Standard deviations of the USBL: m, rad. Its station is at (0, 0).
constexpr float kSigmaRange = 0.3f;
constexpr float kSigmaBearing = 0.0174532925f;

/// How long the last reading stands for a silent gyro, log or depth gauge, and the gyro for a
/// silent compass, s; and how well the position must be known, sqrt(P_xx + P_yy), m. What the
/// vehicle does beyond is said in auvest/mission/pilot.hpp.
constexpr float kHold = 1;
constexpr float kCompassHold = 30;
constexpr float kLost = 20;

/// Samples per line of telemetry. Each costs 5 ms awake.
constexpr uint32_t kSamplesPerLine = 5;

/// RAM that is kept for the stack and for what Arduino itself takes, bytes. The sketch prints what
/// it has left unused.
constexpr size_t kStackReserve = 2048;
