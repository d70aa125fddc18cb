// expect: the input has another size or number type than the process asks for
#include "auvest/auvest.hpp"

void predict(auvest::Ekf<auvest::SpeedHeading<float>>& filter) {
  filter.predict(1.0f, auvest::Vector<float, 2>(1.5f, 0.3f));
}
