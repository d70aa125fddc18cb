// doctest::Approx with a tolerance that is relative to the expected value, and nothing else: its
// own default also accepts epsilon * 1, whatever the value.
#pragma once

#include <doctest/doctest.h>

inline doctest::Approx close_to(double expected, double relative) {
  return doctest::Approx(expected).epsilon(relative).scale(0);
}
