// expect: the measurement model is of another number type than the filter
#include "auvest/auvest.hpp"

void update(auvest::RobustEkf<auvest::SpeedHeading<float>>& filter) {
  const auvest::LeaderRange<double, 2> beacon;
  filter.update(auvest::Vector<double, 1>(1.0), beacon);
}
