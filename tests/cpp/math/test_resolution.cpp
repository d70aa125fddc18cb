// Whether a format is fine enough: against the distance to the next number.
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <limits>

#include "auvest/math/resolution.hpp"

namespace {

using auvest::math::is_coarse;

template <class Scalar>
void check_against_the_next_number() {
  const Scalar infinity = std::numeric_limits<Scalar>::infinity();
  int coarse = 0;
  int fine = 0;
  for (int exponent = -30; exponent <= 90; ++exponent) {
    for (const double mantissa : {1.0, 1.001, 1.5, 1.999}) {
      for (const double sign : {1.0, -1.0}) {
        const Scalar x = Scalar(sign * std::ldexp(mantissa, exponent));
        const Scalar next = std::nextafter(std::fabs(x), infinity) - std::fabs(x);
        const double half = 0.5 * double(next);
        for (const double times : {1e-9, 1.0, 7.9, 11.4, 1e9}) {
          const double sigma = times * half;
          const Scalar variance = Scalar(sigma * sigma);
          if (!(sigma > 0.002)) continue;      // no sigma counts as less than a millimetre
          const bool expected = times < 7.95;  // a tenth, to within the rounding of exponents
          CAPTURE(x);
          CAPTURE(times);
          CHECK(is_coarse(x, variance) == expected);
          ++(expected ? coarse : fine);
        }
      }
    }
  }
  CHECK(coarse > 500);
  CHECK(fine > 500);
}

}  // namespace

TEST_CASE("coarse: half a unit in the last place against an eighth to an eleventh of sigma") {
  check_against_the_next_number<float>();
  check_against_the_next_number<double>();
}

TEST_CASE("coarse: northings of UTM in float are, for all that is known to a decimetre or better") {
  CHECK(is_coarse(3948996.0f, 0.01f));
  CHECK(is_coarse(388096.0f, 0.01f));
  CHECK_FALSE(is_coarse(3948996.0f, 100.0f));
  CHECK_FALSE(is_coarse(3948996.0, 1e-6));
  CHECK_FALSE(is_coarse(4000.0f, 0.0001f));
  CHECK_FALSE(is_coarse(0.0f, 1e-30f));
}

TEST_CASE("coarse: within 4 km of the origin nothing is, however sure a filter is") {
  for (const float variance : {0.0f, 1e-30f, 1e-12f, 1e-7f}) {
    CHECK_FALSE(is_coarse(4095.9f, variance));
    CHECK(is_coarse(-4096.1f, variance) == (variance < 1e-6f));
    CHECK_FALSE(is_coarse(4e6, double(variance)));
    CHECK(is_coarse(1e13, double(variance)));
  }
}
