// expect: the process of this filter has no input
#include "auvest/auvest.hpp"

void predict(auvest::Ukf<auvest::EulerAcceleration<float>>& filter) {
  filter.predict(1.0f, auvest::Vector<float, 2>(1.5f, 0.3f));
}
