// Depth of a vehicle in space: z of a state that begins with [x, y, z].
//
//     z = x_2 + e,   var e = sigma^2
//
// z is counted as the state counts it: a depth where the state's z points down, a height (minus
// the depth) where it points up. What a pressure sensor says of the water above it must already be
// metres, with the pressure of the air and the sensor's place in the vehicle taken off.
//
// Linear, so the deviations are exact; the states before z are moved through their correlation
// with it only.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/models/measurement_model.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Whatever the number of states.
template <class Scalar>
struct DepthParams {
  Scalar sigma_m = Scalar(0.1);

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("sigma_m", sigma_m);
  }
};

template <class Scalar_, int N>
struct Depth : MeasurementModel<Depth<Scalar_, N>, Scalar_, N, 1, 3> {
  using Base = MeasurementModel<Depth<Scalar_, N>, Scalar_, N, 1, 3>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;
  static constexpr bool kClosedForm = true;

  using Params = DepthParams<Scalar>;

  Params params;

  explicit Depth(const Params& p = Params()) : params(p) {}

  struct Expansion {
    Measurement centre;

    const Measurement& value() const { return centre; }

    Jacobian H() const {
      Jacobian jacobian;
      jacobian(0, 0) = jacobian(0, 1) = Scalar(0);
      jacobian(0, 2) = Scalar(1);
      return jacobian;
    }

    AUVEST_INLINE void deviations(const ObservedState& e, Measurement& sum,
                                  Measurement& difference) const {
      sum(0) = Scalar(0);
      difference(0) = e(2) + e(2);
    }
  };

  AUVEST_INLINE Expansion about(const State& x) const {
    Expansion point;
    point.centre(0) = x(2);
    return point;
  }

  Measurement h(const State& x) const { return about(x).centre; }
  Jacobian H(const State& x) const { return about(x).H(); }

  Noise R() const {
    Noise noise;
    noise(0, 0) = params.sigma_m * params.sigma_m;
    return noise;
  }

  Status check() const {
    return math::is_positive(params.sigma_m) ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
