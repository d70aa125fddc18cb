// Dead reckoning with the interface of the SLAT filters: the baseline, plain (the paper's) or, with
// the motion's compensate_bias, without the bias of a noisy heading. It hears no echo.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
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

  explicit DeadReckoning(const Motion& motion) : motion_(motion) {
    math::set_zero(pose_.x);
    math::set_zero(pose_.P);
  }

  Status reset(const SlaveBelief& pose, math::Random&) {
    if (motion_.check() != Status::kOk) return Status::kBadParameter;
    const Status status = Frame::check_slave(pose);
    if (status != Status::kOk) return status;
    this->start();
    pose_ = pose;
    return Status::kOk;
  }

  /// Of no use to it, so none is refused.
  Status add_master(const MasterBelief&) { return Status::kOk; }

  Status predict(Scalar dt, const Control& u, math::Random&, const VelocityChange* = nullptr) {
    const Status status = this->check_prediction(dt, u, nullptr);
    if (status != Status::kOk) return status;
    motion_.propagate(motion_.step(u, dt), pose_);
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

 private:
  Motion motion_;
  SlaveBelief pose_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
