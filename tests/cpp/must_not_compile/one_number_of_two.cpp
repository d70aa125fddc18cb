// expect: this sensor measures more than one number
#include "auvest/auvest.hpp"

void update(auvest::RobustEkf<auvest::SpeedHeading<float>>& filter) {
  const auvest::RangeBearing<float, 2> sonar;
  filter.update(1.0f, sonar);
}
