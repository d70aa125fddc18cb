// Range to a leader of known position, [MEKF 4] and [MEKF 5] of the M-estimation EKF paper (Li, Du,
// Fan, Chen, Mao, Luo 2020), in the plane. Position are the first two of the N states.
//
//     z = |(x, y) - leader| + e,   var e = sigma_range^2 + sigma_leader^2
//
// Differs from [MEKF 4]: the print repeats one component of x; it means components 1 and 2.
// Differs from [MEKF 5]: the leader's position is uncertain too, alike in all directions, and so
// the range.
//
// Seen across the line of sight, at distance r, a circle bends: with v = n' P n, n normal to it,
// the second-order term of h has the mean v / (2 r) and the variance v^2 / (2 r^2). Both are
// nothing in ordinary tracking; after a recovery, where sqrt(v) is not small beside r, a filter
// without them is soon sure of a wrong position.
//
// There is one model per message, any number of leaders: the position is the one the leader had
// when the range was taken. At the leader itself the range has no slope and moves nothing.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/resolution.hpp"
#include "auvest/models/measurement_model.hpp"
#include "auvest/models/range_limits.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Whatever the number of states.
template <class Scalar>
struct LeaderRangeParams : RangeLimits<Scalar> {
  Scalar leader_x_m = Scalar(0);
  Scalar leader_y_m = Scalar(0);
  Scalar sigma_range_m = Scalar(1);   ///< s_e of [MEKF 5]
  Scalar sigma_leader_m = Scalar(0);  ///< of the leader's position, per axis

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("leader_x_m", leader_x_m);
    v("leader_y_m", leader_y_m);
    v("sigma_range_m", sigma_range_m);
    v("sigma_leader_m", sigma_leader_m);
    RangeLimits<Scalar>::visit(v);
  }
};

template <class Scalar_, int N>
struct LeaderRange : MeasurementModel<LeaderRange<Scalar_, N>, Scalar_, N, 1, 2> {
  using Base = MeasurementModel<LeaderRange<Scalar_, N>, Scalar_, N, 1, 2>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;
  static constexpr bool kClosedForm = true;
  static constexpr int kPlace = 2;
  static constexpr bool kCircle = true;

  using Params = LeaderRangeParams<Scalar>;

  Params params;

  explicit LeaderRange(const Params& p = Params()) : params(p) {}

  /// Moves the leader to (p[0], p[1]) [m].
  void place(const Scalar* p) {
    params.leader_x_m = p[0];
    params.leader_y_m = p[1];
  }

  /// Where the leader stands [m].
  void centre(Scalar* p) const {
    p[0] = params.leader_x_m;
    p[1] = params.leader_y_m;
  }

  struct Expansion {
    Scalar range, inverse;  // inverse: 1 / range; 0 at the leader
    Scalar ux, uy;          // unit vector from the leader; 0 at the leader
    Measurement centre;

    const Measurement& value() const { return centre; }

    Jacobian H() const {
      Jacobian jacobian;
      jacobian(0, 0) = ux;
      jacobian(0, 1) = uy;
      return jacobian;
    }

    /// In closed form, as derived in range_bearing.hpp.
    AUVEST_INLINE void deviations(const ObservedState& e, Measurement& sum,
                                  Measurement& difference) const {
      using math::sqrt;
      const Scalar one = Scalar(1);
      const Scalar p = (ux * e(0) + uy * e(1)) * inverse;
      const Scalar q = (ux * e(1) - uy * e(0)) * inverse;
      const Scalar qq = q * q;
      const Scalar uu = p * p + qq;
      if (uu < Scalar(0.25) * math::machine_epsilon<Scalar>()) {
        sum(0) = range * qq;
        difference(0) = (range + range) * p;
        return;
      }
      const Scalar w = one - uu;
      const Scalar a_plus = sqrt((one + p) * (one + p) + qq);
      const Scalar a_minus = sqrt((one - p) * (one - p) + qq);
      const Scalar a_sum = a_plus + a_minus;
      const Scalar product = a_plus * a_minus;
      const bool inside = w > Scalar(0);
      const Scalar g = inside ? Scalar(4) * qq / (product + w) : product - w;  // [UKF R3]
      sum(0) = (range + range) * g / (a_sum + Scalar(2));                      // [UKF R2]
      difference(0) = Scalar(4) * range * p / a_sum;                           // [UKF R1]
    }
  };

  AUVEST_INLINE Expansion about(const State& x) const {
    using math::sqrt;
    const Scalar dx = x(0) - params.leader_x_m;
    const Scalar dy = x(1) - params.leader_y_m;
    Expansion point;
    point.range = sqrt(dx * dx + dy * dy);  // [MEKF 4]
    point.centre(0) = point.range;
    point.inverse = point.range > Scalar(1e-15) ? Scalar(1) / point.range : Scalar(0);
    point.ux = dx * point.inverse;
    point.uy = dy * point.inverse;
    return point;
  }

  /// The range without noise.
  Measurement h(const State& x) const { return about(x).centre; }
  Jacobian H(const State& x) const { return about(x).H(); }

  Noise R() const {
    Noise noise;
    // [MEKF 5]
    noise(0, 0) =
        params.sigma_range_m * params.sigma_range_m + params.sigma_leader_m * params.sigma_leader_m;
    return noise;
  }

  Status admits(const Measurement& z) const { return params.admits(z(0)); }

  void second_order(const Expansion& point, const Matrix<Scalar, 2, 2>& root,
                    Measurement& innovation, Noise& noise) const {
    const Scalar first = point.ux * root(1, 0) - point.uy * root(0, 0);  // L' n, n = (-uy, ux)
    const Scalar second = point.ux * root(1, 1);
    const Scalar twice = (first * first + second * second) * point.inverse;
    const Scalar bend = Scalar(0.5) * twice;
    innovation(0) = innovation(0) - bend;
    noise(0, 0) = noise(0, 0) + twice * bend;
  }

  Status check() const {
    const bool valid = math::is_finite(params.leader_x_m) && math::is_finite(params.leader_y_m) &&
                       math::is_positive(params.sigma_range_m) &&
                       math::is_nonnegative(params.sigma_leader_m) && params.valid();
    if (!valid) return Status::kBadParameter;
    const Scalar variance = R()(0, 0);
    const bool far = math::is_coarse(params.leader_x_m, variance) ||
                     math::is_coarse(params.leader_y_m, variance);
    return far ? Status::kFarFromOrigin : Status::kOk;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
