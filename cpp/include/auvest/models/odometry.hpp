// Dead reckoning by increments: state [x, y, theta] (m, rad), input the motion since the last step
// in the frame of the pose then: [forward, left, turn] (m, rad) for angles from +x towards +y with
// y to the left, [forward, starboard, turn] for y to starboard.
//
//     (x, y) += R(theta) (forward, sideways),   theta += turn
//
// The noise is that of real logs: a part that goes with the distance (scale, slip) and a part that
// goes with time (drift, current), alike in all directions; the heading's goes with time (drift of
// the gyro) and, where told, with the turn (scale of the gyro, slip of wheels).
//
// theta is not wrapped: it counts turns, so that no filter sees a jump.
#pragma once

#include "auvest/math/trigonometry.hpp"
#include "auvest/models/process_model.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct Odometry : ProcessModel<Odometry<Scalar_>, Scalar_, 3> {
  using Base = ProcessModel<Odometry<Scalar_>, Scalar_, 3>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;
  using Input = Vector<Scalar, 3>;  ///< forward, sideways (m), turn (rad)

  struct Params {
    Scalar sigma_distance = Scalar(0.05);  ///< of the distance of one increment [1]
    Scalar sigma_drift = Scalar(0.1);      ///< [m/sqrt(s)]
    Scalar sigma_turn = Scalar(0.001);     ///< [rad/sqrt(s)]
    Scalar sigma_turned = Scalar(0);       ///< of the turn of one increment [1]

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("sigma_distance", sigma_distance);
      v("sigma_drift", sigma_drift);
      v("sigma_turn", sigma_turn);
      v("sigma_turned", sigma_turned);
    }
  };

  Params params;
  Input input;

  explicit Odometry(const Params& p = Params()) : params(p) { math::set_zero(input); }

  State f(const State& x, Scalar) const {
    Scalar step_x, step_y;
    turned(x(2), step_x, step_y);
    State next;
    next(0) = x(0) + step_x;
    next(1) = x(1) + step_y;
    next(2) = x(2) + input(2);
    return next;
  }

  Covariance Phi(const State& x, Scalar) const {
    Covariance phi;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) phi(i, j) = Scalar(i == j ? 1 : 0);
    }
    Scalar step_x, step_y;
    turned(x(2), step_x, step_y);
    phi(0, 2) = -step_y;
    phi(1, 2) = step_x;
    return phi;
  }

  Covariance Q(Scalar dt) const {
    const Scalar square = input(0) * input(0) + input(1) * input(1);
    const Scalar slip = params.sigma_distance * params.sigma_distance * square;
    const Scalar position = slip + dt * params.sigma_drift * params.sigma_drift;
    Covariance q;
    math::set_zero(q);
    q(0, 0) = q(1, 1) = position;
    const Scalar spread = params.sigma_turned * input(2);
    q(2, 2) = dt * params.sigma_turn * params.sigma_turn + spread * spread;
    return q;
  }

  Status check() const {
    const bool valid =
        math::is_nonnegative(params.sigma_distance) && math::is_nonnegative(params.sigma_drift) &&
        math::is_nonnegative(params.sigma_turn) && math::is_nonnegative(params.sigma_turned);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  void turned(Scalar theta, Scalar& step_x, Scalar& step_y) const {
    Scalar sine, cosine;
    math::sincos(theta, sine, cosine);
    step_x = input(0) * cosine - input(1) * sine;
    step_y = input(0) * sine + input(1) * cosine;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
