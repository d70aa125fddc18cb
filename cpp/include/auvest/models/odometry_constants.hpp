// Dead reckoning by increments (odometry.hpp) with constants beside the pose: what an instrument is
// off by, and stays off by. State [x, y, theta, c0, ..., c4] (m, rad, and what each constant has),
// input as of Odometry.
//
//     (x, y) += R(theta) (1 + c_s) (forward, sideways),   theta += turn + dt c_t
//
// Which constant is which the parameters say, by its place in the state: that of the speed's
// relative error c_s and of the turn rate's offset c_t [rad/s]; 0: none. The others are for the
// sensors (scaled_range.hpp). A constant that nobody uses keeps its prior and moves nothing. Each
// may walk: a temperature that drifts.
#pragma once

#include "auvest/models/odometry.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The place that a parameter names among N states, rounded up; N if there are not so many.
template <int N, class Scalar>
int place_of(Scalar named) {
  int place = 0;
  while (place < N && Scalar(place) < named) ++place;
  return place;
}

/// Whether a parameter names the place of a constant among N states, behind a pose, or none.
template <int N, class Scalar>
bool is_constant(Scalar named) {
  const int place = place_of<N>(named);
  return Scalar(place) == named && place < N && (place == 0 || place > 2);
}

template <class Scalar_>
struct OdometryConstants : ProcessModel<OdometryConstants<Scalar_>, Scalar_, 8> {
  using Base = ProcessModel<OdometryConstants<Scalar_>, Scalar_, 8>;
  using Scalar = Scalar_;
  using Base::kStates;
  using typename Base::Covariance;
  using typename Base::State;
  using Input = typename Odometry<Scalar>::Input;
  static constexpr int kPose = 3;
  static constexpr int kConstants = kStates - kPose;

  struct Params : Odometry<Scalar>::Params {
    Scalar speed_state = Scalar(0);  ///< place of the speed's relative error
    Scalar turn_state = Scalar(0);   ///< place of the turn rate's offset
    Scalar walk_0 = Scalar(0);       ///< of each constant [its unit/sqrt(s)]
    Scalar walk_1 = Scalar(0);
    Scalar walk_2 = Scalar(0);
    Scalar walk_3 = Scalar(0);
    Scalar walk_4 = Scalar(0);

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      Odometry<Scalar>::Params::visit(v);
      v("speed_state", speed_state);
      v("turn_state", turn_state);
      v("walk_0", walk_0);
      v("walk_1", walk_1);
      v("walk_2", walk_2);
      v("walk_3", walk_3);
      v("walk_4", walk_4);
    }
  };

  Params params;
  Input input;

  explicit OdometryConstants(const Params& p = Params()) : params(p) { math::set_zero(input); }

  State f(const State& x, Scalar dt) const {
    const Pose moved = reckoned(x, dt).f(pose(x), dt);
    State next = x;
    for (int i = 0; i < kPose; ++i) next(i) = moved(i);
    return next;
  }

  Covariance Phi(const State& x, Scalar dt) const {
    Covariance phi;
    for (int i = 0; i < kStates; ++i) {
      for (int j = 0; j < kStates; ++j) phi(i, j) = Scalar(i == j ? 1 : 0);
    }
    const typename Odometry<Scalar>::Covariance of_pose = reckoned(x, dt).Phi(pose(x), dt);
    for (int i = 0; i < kPose; ++i) {
      for (int j = 0; j < kPose; ++j) phi(i, j) = of_pose(i, j);
    }
    if (speed() > 0) {  // what is moved without the error: by its Jacobian, turned a quarter
      const typename Odometry<Scalar>::Covariance measured = odometry().Phi(pose(x), dt);
      phi(0, speed()) = measured(1, 2);
      phi(1, speed()) = -measured(0, 2);
    }
    if (turn() > 0) phi(2, turn()) = dt;
    return phi;
  }

  Covariance Q(Scalar dt) const {
    Covariance q;
    math::set_zero(q);
    const typename Odometry<Scalar>::Covariance of_pose = odometry().Q(dt);
    for (int i = 0; i < kPose; ++i) q(i, i) = of_pose(i, i);
    const Scalar walks[kConstants] = {params.walk_0, params.walk_1, params.walk_2, params.walk_3,
                                      params.walk_4};
    for (int i = 0; i < kConstants; ++i) q(kPose + i, kPose + i) = dt * walks[i] * walks[i];
    return q;
  }

  Status check() const {
    const bool valid =
        odometry().check() == Status::kOk && is_constant<kStates>(params.speed_state) &&
        is_constant<kStates>(params.turn_state) && math::is_nonnegative(params.walk_0) &&
        math::is_nonnegative(params.walk_1) && math::is_nonnegative(params.walk_2) &&
        math::is_nonnegative(params.walk_3) && math::is_nonnegative(params.walk_4);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  using Pose = typename Odometry<Scalar>::State;

  int speed() const { return place_of<kStates>(params.speed_state); }
  int turn() const { return place_of<kStates>(params.turn_state); }

  static Pose pose(const State& x) {
    Pose first;
    for (int i = 0; i < kPose; ++i) first(i) = x(i);
    return first;
  }

  /// As its input says.
  Odometry<Scalar> odometry() const {
    Odometry<Scalar> model(params);
    model.input = input;
    return model;
  }

  /// As its input says, less what it is off by.
  Odometry<Scalar> reckoned(const State& x, Scalar dt) const {
    Odometry<Scalar> model = odometry();
    if (speed() > 0) {
      const Scalar factor = Scalar(1) + x(speed());
      model.input(0) = factor * input(0);
      model.input(1) = factor * input(1);
    }
    if (turn() > 0) model.input(2) = input(2) + dt * x(turn());
    return model;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
