// Dead reckoning with the interface of the SLAT filters: the baseline, plain (the paper's) or, with
// the motion's compensate_bias, without the bias of a noisy heading. It hears no echo.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
#include "auvest/slat/sighting.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

template <class Motion_>
class DeadReckoning {
 public:
  using Motion = Motion_;
  using Scalar = typename Motion::Scalar;
  using Control = typename Motion::Control;
  static constexpr int kPose = Motion::kStates;
  using SlaveBelief = Belief<Scalar, kPose>;
  using MasterBelief = Belief<Scalar, 6>;
  using VelocityChange = Vector<Scalar, 2>;

  explicit DeadReckoning(const Motion& motion) : motion_(motion), initialised_(false) {
    math::set_zero(pose_.x);
    math::set_zero(pose_.P);
  }

  Status reset(const SlaveBelief& pose, math::Random&) {
    if (motion_.check() != Status::kOk) return Status::kBadParameter;
    if (!math::all_finite(pose.x) || !math::lower_finite(pose.P)) return Status::kNotFinite;
    pose_ = pose;
    initialised_ = true;
    return Status::kOk;
  }

  Status add_master(const MasterBelief&) { return Status::kOk; }

  Status predict(Scalar dt, const Control& u, math::Random&, const VelocityChange* = nullptr) {
    if (!initialised_) return Status::kNotInitialised;
    if (!math::is_finite(dt) || !math::all_finite(u)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    motion_.propagate(motion_.step(u, dt), pose_);
    return Status::kOk;
  }

  Status update(const Sighting<Scalar>*, int, const Sonar<Scalar>&, math::Random&) {
    return initialised_ ? Status::kOk : Status::kNotInitialised;
  }

  SlaveBelief slave() const {
    SlaveBelief pose = pose_;
    math::mirror_lower(pose.P);
    return pose;
  }

 private:
  Motion motion_;
  SlaveBelief pose_;
  bool initialised_;

 public:
  /// Hands all numbers of the state to `visit`, which keeps them, or overwrites them by those that
  /// were kept: to save a filter and to go on from there. `Self` is this class, const to save.
  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    visit(self.pose_);
    visit.count(self.initialised_, true);
  }
};

}  // namespace auvest
