// Range to a leader of known position, Eqs. (4)-(5) of the M-estimation EKF paper (Li, Du, Fan,
// Chen, Mao, Luo 2020), in the plane. Position are the first two of the N states.
//
//     z = |(x, y) - leader| + e,   var e = sigma_range^2 + sigma_leader^2
//
// Differs from Eq. (4): the print repeats one component of x; it means components 1 and 2. Differs
// from Eq. (5): the leader's position is uncertain too, alike in all directions, and so the range.
//
// There is one model per message, any number of leaders: the position is the one the leader had
// when the range was taken. At the leader itself the range has no slope and moves nothing.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/models/measurement_model.hpp"

namespace auvest {

template <class Scalar_, int N>
struct LeaderRange : MeasurementModel<LeaderRange<Scalar_, N>, Scalar_, N, 1, 2> {
  using Base = MeasurementModel<LeaderRange<Scalar_, N>, Scalar_, N, 1, 2>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::State;

  struct Params {
    Scalar leader_x_m = Scalar(0);
    Scalar leader_y_m = Scalar(0);
    Scalar sigma_range_m = Scalar(1);   ///< s_e, Eq. (5)
    Scalar sigma_leader_m = Scalar(0);  ///< of the leader's position, per axis
  };

  Params params;

  explicit LeaderRange(const Params& p = Params()) : params(p) {}

  /// Eq. (4) without noise.
  Measurement h(const State& x) const {
    Measurement z;
    z(0) = distance(x);
    return z;
  }

  Jacobian H(const State& x) const {
    const Scalar range = distance(x);
    const bool apart = range > Scalar(1e-15);
    Jacobian jacobian;
    jacobian(0, 0) = apart ? (x(0) - params.leader_x_m) / range : Scalar(0);
    jacobian(0, 1) = apart ? (x(1) - params.leader_y_m) / range : Scalar(0);
    return jacobian;
  }

  /// Eq. (5).
  Noise R() const {
    Noise noise;
    noise(0, 0) =
        params.sigma_range_m * params.sigma_range_m + params.sigma_leader_m * params.sigma_leader_m;
    return noise;
  }

  Status check() const {
    const bool valid = math::is_finite(params.leader_x_m) && math::is_finite(params.leader_y_m) &&
                       math::is_positive(params.sigma_range_m) &&
                       math::is_nonnegative(params.sigma_leader_m);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  Scalar distance(const State& x) const {
    using math::sqrt;
    const Scalar dx = x(0) - params.leader_x_m;
    const Scalar dy = x(1) - params.leader_y_m;
    return sqrt(dx * dx + dy * dy);
  }
};

}  // namespace auvest
