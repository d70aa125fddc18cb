// expect: z has not as many numbers as this sensor measures
#include "auvest/auvest.hpp"

void update(auvest::Ukf<auvest::EulerAcceleration<float>>& filter) {
  const auvest::RangeBearing<float, 6> sonar;
  filter.update(auvest::Vector<float, 3>(1.0f, 0.0f, 0.0f), sonar);
}
