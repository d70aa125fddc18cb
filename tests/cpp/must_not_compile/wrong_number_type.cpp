// expect: z is of another number type than the sensor
#include "auvest/auvest.hpp"

void update(auvest::Ekf<auvest::SpeedHeading<float>>& filter) {
  const auvest::LeaderRange<float, 2> beacon;
  filter.update(auvest::Vector<double, 1>(1.0), beacon);
}
