// What an instrument can have measured. A checksum says that a number is the one that was sent, not
// that it is true: a sonar sends 0 or 9999 for "no echo", a compass jumps where a motor starts. A
// filter that takes such a number is where no vehicle is.
//
//     const ReadingLimits<float> limits(0, 500, 3, 2);    // m, m, m/s, m
//     range.wait(dt);                                     // for each step
//     if (range.admits(z, limits)) range.take(z);
//
// Changes count from the last reading that was taken, and what is allowed grows with the time since
// then: a wrong one, even the first, shuts nobody out for long.
#pragma once

#include <limits>

#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct ReadingLimits {
  Scalar smallest, largest;
  Scalar fastest;    ///< it changes in a second
  Scalar jitter;     ///< and, by its noise, from one reading to the next
  bool comes_round;  ///< an angle [rad]: its change is the shorter way

  ReadingLimits(Scalar smallest_value, Scalar largest_value, Scalar fastest_change, Scalar noise)
      : smallest(smallest_value),
        largest(largest_value),
        fastest(fastest_change),
        jitter(noise),
        comes_round(false) {}

  /// Of an angle, written from 0 to 2 pi or from -pi to pi.
  static ReadingLimits angle(Scalar fastest_change, Scalar noise) {
    const Scalar turn = math::two_pi<Scalar>() + Scalar(1e-3);  // as rounded as it may be written
    ReadingLimits limits(-turn, turn, fastest_change, noise);
    limits.comes_round = true;
    return limits;
  }
};

template <class Scalar>
class PlausibleReading {
 public:
  /// Time goes by.
  void wait(Scalar dt) { since_ = since_ + dt; }

  bool admits(Scalar value, const ReadingLimits<Scalar>& limits) const {
    if (!math::within(value, limits.smallest, limits.largest)) return false;
    Scalar change = value - last_;
    if (limits.comes_round) change = math::wrap(change);
    return !(math::absolute(change) > limits.jitter + limits.fastest * since_);
  }

  /// Changes count from this value, now.
  void take(Scalar value) {
    last_ = value;
    since_ = Scalar(0);
  }

 private:
  Scalar last_ = Scalar(0);
  Scalar since_ = std::numeric_limits<Scalar>::infinity();  // never
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
