// Dead reckoning with the interface of the SLAT filters: the baseline, plain (the paper's) or, with
// the motion's compensate_bias, without the bias of a noisy heading. It hears no echo.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
#include "auvest/slat/definite.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/slat_filter.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Motion_>
class DeadReckoning : public SlatFilter<Motion_, 0> {
 public:
  using Frame = SlatFilter<Motion_, 0>;
  using Motion = Motion_;
  using typename Frame::Control;
  using typename Frame::MasterBelief;
  using typename Frame::Scalar;
  using typename Frame::SlaveBelief;
  using typename Frame::VelocityChange;

  /// longest_step_s: see EchoParams.
  explicit DeadReckoning(const Motion& motion, Scalar longest_step_s = Scalar(3600))
      : motion_(motion), longest_step_s_(longest_step_s) {
    math::set_zero(pose_.x);
    math::set_zero(pose_.P);
  }

  Status reset(const SlaveBelief& pose, math::Random&) {
    if (motion_.check() != Status::kOk || !(longest_step_s_ > Scalar(0))) {
      return Status::kBadParameter;
    }
    const Status status = check_start(pose);
    if (status != Status::kOk) return status;
    this->start(Frame::template noise_of_an_hour<true>(motion_, NoMaster()));
    pose_ = pose;
    return Status::kOk;
  }

  /// Of no use to it, so none is refused.
  Status add_master(const MasterBelief&) { return Status::kOk; }

  Status predict(Scalar dt, const Control& u, math::Random&, const VelocityChange* = nullptr) {
    const Status status =
        this->check_prediction(*this, dt, u, nullptr, longest_step_s_, Frame::extent_of(pose_));
    if (status != Status::kOk) return status;
    motion_.propagate(motion_.step(u, dt), pose_);
    if (heading_is_open(pose_.P)) raise_pivots(pose_.P);
    return Status::kOk;
  }

  Status update(const Echo<Scalar>*, int, const Sonar<Scalar>&, math::Random&) {
    return this->initialised_ ? Status::kOk : Status::kNotInitialised;
  }

  SlaveBelief slave() const {
    SlaveBelief pose = pose_;
    math::mirror_lower(pose.P);
    return pose;
  }

  /// As SlatFilter::visit_state.
  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    Frame::visit_state(self, visit);
    visit(self.pose_);
  }

  /// Whether the pose has a covariance: to ask of a state that was put back.
  bool is_sound() const { return check_slave(pose_) == Status::kOk; }

  Scalar longest_step_s() const { return longest_step_s_; }

 private:
  struct NoMaster {
    void propagate(MasterBelief&, Scalar) const {}
  };

  Motion motion_;
  Scalar longest_step_s_;
  SlaveBelief pose_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
