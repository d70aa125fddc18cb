// Thrusters at fixed places and in fixed directions: tau = T f, a column [e; r x e] per thruster.
// Each follows its normalised input through a thrust curve and a first-order lag of its thrust.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "auvest/vehicle/flow.hpp"
#include "auvest/vehicle/lag.hpp"

namespace auvest {

template <class Scalar_, int Count, class Curve_>
struct Thrusters {
  using Scalar = Scalar_;
  using Curve = Curve_;
  using Matrix6 = Matrix<Scalar, 6, Count>;
  static constexpr int kCount = Count;

  /// Place [m] and direction of the thrust (a unit vector).
  struct Mount {
    Scalar x_m = Scalar(0), y_m = Scalar(0), z_m = Scalar(0);
    Scalar forward = Scalar(0), starboard = Scalar(0), down = Scalar(0);

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("x_m", x_m);
      v("y_m", y_m);
      v("z_m", z_m);
      v("forward", forward);
      v("starboard", starboard);
      v("down", down);
    }
  };

  struct Params {
    Mount mounts[Count];
    typename Curve::Params curve;
    Scalar time_constant_s = Scalar(0);  ///< T > 0, of the thrust
    Scalar rate_limit_n_s = Scalar(0);   ///< largest rate of the thrust; 0: none

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      static const char* const kNames[] = {"thruster_1", "thruster_2", "thruster_3", "thruster_4",
                                           "thruster_5", "thruster_6", "thruster_7", "thruster_8"};
      static_assert(Count <= 8, "eight have a name");
      for (int i = 0; i < Count; ++i) v(kNames[i], mounts[i]);
      v("curve", curve);
      v("time_constant_s", time_constant_s);
      v("rate_limit_n_s", rate_limit_n_s);
    }
  };

  Params params;
  Curve curve;
  Lag<Scalar> lag;  // of the thrust, within what the curve gives

  explicit Thrusters(const Params& p) : params(p), curve(p.curve), lag(lag_params(p, curve)) {
    for (int i = 0; i < Count; ++i) {
      const Mount& m = p.mounts[i];
      // [HULL T1]
      matrix_(0, i) = m.forward;
      matrix_(1, i) = m.starboard;
      matrix_(2, i) = m.down;
      matrix_(3, i) = m.y_m * m.down - m.z_m * m.starboard;
      matrix_(4, i) = m.z_m * m.forward - m.x_m * m.down;
      matrix_(5, i) = m.x_m * m.starboard - m.y_m * m.forward;
    }
  }

  /// T, 6 x Count.
  const Matrix6& matrix() const { return matrix_; }

  /// The thrusts [N] that inputs ask for.
  template <class Value>
  void demands(const Value* inputs, Value* thrusts) const {
    for (int i = 0; i < Count; ++i) thrusts[i] = curve.thrust(inputs[i]);
  }

  /// tau <- tau + T f.
  template <class Freedom, class Value>
  AUVEST_OUTLINE void add_to(Value* tau, const Value* thrusts, Freedom) const {
    AUVEST_UNROLL
    for (int i = 0; i < 6; ++i) {
      if (!Freedom::keeps(i)) continue;
      AUVEST_UNROLL
      for (int j = 0; j < Count; ++j) {
        if (matrix_(i, j) != Scalar(0)) tau[i] = tau[i] + Value(matrix_(i, j)) * thrusts[j];
      }
    }
  }

  /// Directions must be unit vectors to a thousandth.
  Status check() const {
    for (int i = 0; i < Count; ++i) {
      const Mount& m = params.mounts[i];
      const Scalar length = m.forward * m.forward + m.starboard * m.starboard + m.down * m.down;
      const bool valid = math::within(length, Scalar(0.998), Scalar(1.002)) &&
                         math::is_finite(m.x_m) && math::is_finite(m.y_m) && math::is_finite(m.z_m);
      if (!valid) return Status::kBadParameter;
    }
    const Status status = curve.check();
    return status == Status::kOk ? lag.check() : status;
  }

 private:
  static typename Lag<Scalar>::Params lag_params(const Params& p, const Curve& reach) {
    typename Lag<Scalar>::Params of_thrust;
    of_thrust.low = reach.lowest();
    of_thrust.high = reach.highest();
    of_thrust.time_constant_s = p.time_constant_s;
    of_thrust.rate_limit = p.rate_limit_n_s;
    return of_thrust;
  }

  Matrix6 matrix_;
};

}  // namespace auvest
