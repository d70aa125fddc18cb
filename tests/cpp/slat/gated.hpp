// The SLAT filters in float with a gate and, where they have particles, 100 of them: one way to
// make them all.
#pragma once

#include <vector>

#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/slatf.hpp"
#include "auvest/slat/slatf_joint.hpp"

namespace slat_test {

template <class Filter>
struct Gated {
  std::vector<float> storage;
  Filter filter;

  explicit Gated(float gate = 16)
      : storage(Filter::Set::storage_size(100)),
        filter(typename Filter::Motion(), typename Filter::Master(), params(gate), storage.data(),
               100) {}

  static typename Filter::Params params(float gate) {
    typename Filter::Params p;
    p.gate = gate;
    return p;
  }
};

template <class Motion, class Master, int Masters>
struct Gated<auvest::EkfSlat<Motion, Master, Masters>> {
  using Filter = auvest::EkfSlat<Motion, Master, Masters>;
  Filter filter;

  explicit Gated(float gate = 16) : filter(Motion(), Master(), params(gate)) {}

  static typename Filter::Params params(float gate) {
    typename Filter::Params p;
    p.gate = gate;
    return p;
  }
};

using FloatCompass = auvest::CompassMotion<float>;
using FloatMaster = auvest::PiecewiseAcceleration<float>;
template <int Masters>
using FloatSlatf1 = auvest::Slatf1<FloatCompass, FloatMaster, Masters>;
template <int Masters>
using FloatSlatf2 = auvest::Slatf2<FloatCompass, FloatMaster, Masters>;
template <int Masters>
using FloatJoint = auvest::SlatfJoint<FloatCompass, FloatMaster, Masters>;
template <int Masters>
using FloatEkf = auvest::EkfSlat<FloatCompass, FloatMaster, Masters>;

}  // namespace slat_test
