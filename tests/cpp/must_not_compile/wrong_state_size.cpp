// expect: the measurement model is for another state
#include "auvest/auvest.hpp"

void update(auvest::Ekf<auvest::ExactAcceleration<float>>& filter) {
  const auvest::RangeBearing<float, 4> sonar;
  filter.update(auvest::Vector<float, 2>(1.0f, 0.0f), sonar);
}
