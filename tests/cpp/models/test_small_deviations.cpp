// Deviations in closed form keep their digits where a difference of two measurements has none.
#include <doctest/doctest.h>

#include "close.hpp"

#include "auvest/models/leader_range.hpp"
#include "auvest/models/range_bearing.hpp"

namespace {

using auvest::Vector;

TEST_CASE("ranges: second differences of small steps keep their digits") {
  // From (3, 4), at a range of 5, by steps across the line of sight: the range grows by
  // 5 (sqrt(1 + q^2) - 1) = 5 q^2 / 2 on both sides, to q^2 of itself.
  const Vector<double, 2> at(3, 4);
  auvest::RangeBearing<double, 2>::Params sonar;
  sonar.station_x_m = sonar.station_y_m = 0;
  const auto seen = auvest::RangeBearing<double, 2>(sonar).about(at);
  const auto heard = auvest::LeaderRange<double, 2>().about(at);
  for (const double q : {1e-4, 1e-5, 1e-6, 1e-7}) {
    const Vector<double, 2> step(-4 * q, 3 * q);
    Vector<double, 2> sum;
    Vector<double, 2> difference;
    seen.deviations(step, sum, difference);
    CHECK(sum(0) == close_to(5 * q * q, q * q + 1e-15));
    Vector<double, 1> range_sum;
    Vector<double, 1> range_difference;
    heard.deviations(step, range_sum, range_difference);
    CHECK(range_sum(0) == close_to(5 * q * q, q * q + 1e-15));
  }
}

}  // namespace
