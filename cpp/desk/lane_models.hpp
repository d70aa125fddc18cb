// The models of the core in lanes: their own text, but for what branches on a number there. Where
// lanes differ, both ways are computed and each lane takes its own.
//
// The branches stay in the core: what a chip's compiler makes of a choice without them is larger
// and slower.
#pragma once

#include "auvest/math/simd.hpp"  // before the models, which find its functions
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/speed_heading.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Value, int N>
struct LaneRangeBearing : RangeBearing<Value, N> {
  using Base = RangeBearing<Value, N>;
  using Base::params;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;

  struct Expansion : Base::Expansion {
    using Base::Expansion::inverse_square;
    using Base::Expansion::offset;
    using Base::Expansion::range;

    AUVEST_INLINE void deviations(const ObservedState& e, Measurement& sum,
                                  Measurement& difference) const {
      const Value one = Value(1);
      const Value p = math::dot(offset, e.data(), 2) * inverse_square;
      const Value q = math::cross(offset, e.data()) * inverse_square;
      const Value two_q = q + q;
      const Value two_range = range + range;
      const Value pp = p * p;
      const Value qq = q * q;
      const Value uu = pp + qq;
      const math::Mask<Value> tiny = uu < Value(0.25) * math::machine_epsilon<Value>();
      sum(0) = range * qq;
      difference(0) = two_range * p;
      sum(1) = -(p * two_q);
      difference(1) = two_q;
      if (all(tiny)) return;
      const Value w = one - uu;
      const Value a_plus = sqrt((one + p) * (one + p) + qq);
      const Value a_minus = sqrt((one - p) * (one - p) + qq);
      const Value a_sum = a_plus + a_minus;
      const Value a_product = a_plus * a_minus;
      const Value g = select(w > Value(0), two_q * two_q / (a_product + w), a_product - w);
      sum(0) = select(tiny, sum(0), two_range * g / (a_sum + Value(2)));
      difference(0) = select(tiny, difference(0), two_range * (p + p) / a_sum);
      sum(1) = select(tiny, sum(1), atan2(sum(1), (one - pp) + qq));
      difference(1) = select(tiny, difference(1), atan2(two_q, w));
    }
  };

  AUVEST_INLINE Expansion about(const State& x) const {
    Expansion point;
    static_cast<typename Base::Expansion&>(point) = Base::about(x);
    return point;
  }

  AUVEST_INLINE math::Mask<Value> admits(const Measurement& z) const {
    return z(0) >= params.smallest_range_m && z(0) <= params.largest_range_m;
  }

  AUVEST_INLINE void second_order(const Expansion& point, const Matrix<Value, 2, 2>& root,
                                  Measurement& innovation, Noise& noise) const {
    const Value first = point.offset[0] * root(1, 0) - point.offset[1] * root(0, 0);
    const Value second = point.offset[0] * root(1, 1);
    const Value inverse = Value(1) / point.range;
    const Value twice = (first * first + second * second) * point.inverse_square * inverse;
    const Value bend = Value(0.5) * twice;
    const math::Mask<Value> bent = twice * bend > Value(9) * noise(0, 0);
    innovation(0) = select(bent, innovation(0) - bend, innovation(0));
    noise(0, 0) = select(bent, noise(0, 0) + twice * bend, noise(0, 0));
  }

  /// Where it is true; innovation and noise have a meaning there.
  AUVEST_INLINE math::Mask<Value> near_field(const Expansion& point, const Matrix<Value, N, N>& P,
                                             const Measurement& z, Measurement& innovation,
                                             Noise& noise) const {
    const Value reach = params.near_field * params.near_field * (P(0, 0) + P(1, 1));
    const math::Mask<Value> near = !(point.square > reach + Value(1e-30));
    if (any(near)) this->as_position(point, z, innovation, noise);
    return near;
  }

  AUVEST_INLINE Value* station() { return &params.station_x_m; }
};

template <class Value, int N>
struct LaneLeaderRange : LeaderRange<Value, N> {
  using Base = LeaderRange<Value, N>;
  using Base::params;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;

  struct Expansion : Base::Expansion {
    using Base::Expansion::inverse;
    using Base::Expansion::range;
    using Base::Expansion::ux;
    using Base::Expansion::uy;

    AUVEST_INLINE void deviations(const ObservedState& e, Measurement& sum,
                                  Measurement& difference) const {
      const Value one = Value(1);
      const Value p = (ux * e(0) + uy * e(1)) * inverse;
      const Value q = (ux * e(1) - uy * e(0)) * inverse;
      const Value qq = q * q;
      const Value uu = p * p + qq;
      const math::Mask<Value> tiny = uu < Value(0.25) * math::machine_epsilon<Value>();
      sum(0) = range * qq;
      difference(0) = (range + range) * p;
      if (all(tiny)) return;
      const Value w = one - uu;
      const Value a_plus = sqrt((one + p) * (one + p) + qq);
      const Value a_minus = sqrt((one - p) * (one - p) + qq);
      const Value a_sum = a_plus + a_minus;
      const Value product = a_plus * a_minus;
      const Value g = select(w > Value(0), Value(4) * qq / (product + w), product - w);
      sum(0) = select(tiny, sum(0), (range + range) * g / (a_sum + Value(2)));
      difference(0) = select(tiny, difference(0), Value(4) * range * p / a_sum);
    }
  };

  AUVEST_INLINE Expansion about(const State& x) const {
    const Value dx = x(0) - params.leader_x_m;
    const Value dy = x(1) - params.leader_y_m;
    Expansion point;
    point.range = sqrt(dx * dx + dy * dy);
    point.centre(0) = point.range;
    point.inverse = select(point.range > Value(1e-15), Value(1) / point.range, Value(0));
    point.ux = dx * point.inverse;
    point.uy = dy * point.inverse;
    return point;
  }

  AUVEST_INLINE math::Mask<Value> admits(const Measurement& z) const {
    return z(0) >= params.smallest_range_m && z(0) <= params.largest_range_m;
  }

  AUVEST_INLINE math::Mask<Value> near_field(const Expansion&, const Matrix<Value, N, N>&,
                                             const Measurement&, Measurement&, Noise&) const {
    return Value(1) < Value(0);
  }

  AUVEST_INLINE Value* station() { return &params.leader_x_m; }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
