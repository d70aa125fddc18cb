// What the slave knows of the master when communication breaks: where it is, and what it will do.
#pragma once

#include <auvest.h>

/// It goes straight, then turns.
struct MasterPlan {
  float speed = 5.1444f;           ///< 10 kn, m/s
  float heading = 0.26179939f;     ///< pi/12
  float turn_from = 240;           ///< s
  float turn_rate = 0.026179939f;  ///< pi/120 rad/s

  auvest::Vector<float, 2> velocity(float time_s) const {
    const float turning = time_s > turn_from ? time_s - turn_from : 0.0f;
    float sine, cosine;
    auvest::math::sincos(heading + turn_rate * turning, sine, cosine);
    return auvest::Vector<float, 2>(speed * cosine, speed * sine);
  }

  /// Its planned velocity change between two times, u of Eq. (4), m/s.
  auvest::Vector<float, 2> change(float from_s, float to_s) const {
    const auvest::Vector<float, 2> before = velocity(from_s);
    const auvest::Vector<float, 2> after = velocity(to_s);
    return auvest::Vector<float, 2>(after(0) - before(0), after(1) - before(1));
  }

  /// Its state as it was told last: to 1 m, 0.05 m/s and 1e-4 m/s^2.
  auvest::Belief<float, 6> start() const {
    const float sigma[] = {1.0f, 0.05f, 1e-4f};
    auvest::Belief<float, 6> belief;
    auvest::math::set_zero(belief.x);
    auvest::math::set_zero(belief.P);
    belief.x(1) = 300;
    const auvest::Vector<float, 2> v = velocity(0);
    for (int axis = 0; axis < 2; ++axis) {
      belief.x(2 + axis) = v(axis);
      for (int k = 0; k < 3; ++k) belief.P(2 * k + axis, 2 * k + axis) = sigma[k] * sigma[k];
    }
    return belief;
  }
};
