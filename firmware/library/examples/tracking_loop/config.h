// The settings of this sketch.
#pragma once

#include <auvest.h>

/// How the vehicle moves between samples: exactly Eq. (4) of the paper. ExactAcceleration keeps the
/// term with dt^2/2.
using Process = auvest::EulerAcceleration<float>;

/// Which law chooses the interval, within 0.02 s to 1 s: the paper's, Eqs. (7) to (12).
/// CovarianceBudget takes the longest after which the position is still known to 0.1 m.
using IntervalPolicy = auvest::MahalanobisInterval<float>;

/// Spread of the sigma points: Table 1 of the paper.
constexpr float kAlpha = 1e-6f;

constexpr uint8_t kTriggerPin = 8;

/// From the trigger to the last character of the answer, s. Sound needs 13 ms for 10 m and back.
constexpr float kAnswerTimeout = 0.1f;

/// A range beyond it cannot be: sound has not come back from there in time. The filter refuses it.
constexpr float kLargestRange = 750 * kAnswerTimeout;

/// Nor can it change faster, m/s, but for the noise of two of them, m.
constexpr float kFastest = 10;
constexpr float kRangeJitter = 2;

/// A measurement whose NIS is beyond it is refused: 13.8 loses one good one in 1,000. So many
/// refused in a row say that the estimate is wrong, which then knows less, until one is taken.
constexpr float kGate = 13.8f;
constexpr uint8_t kPatience = 5;

/// Floats are sent as their bits, 8 hexadecimal digits. false: with 6 decimals, to be read in the
/// Serial Monitor; small variances then round to nothing.
constexpr bool kExactText = true;

/// How many rows of the lower triangle of P are sent, 1 to 6. Two, the position, make a line of
/// some 180 characters, 16 ms: it fits between samples 20 ms apart. All six need 30 ms.
constexpr int kCovarianceRows = 2;

/// RAM that is kept for the stack, bytes. The sketch prints what it has left unused.
constexpr size_t kStackReserve = 2048;
