// EKF-SLAT: slave and masters in one Gaussian. What a user would take instead of particles, and the
// yardstick for them.
//
// The interface is that of Slatf; random generators are taken and not used, so that the filters are
// exchangeable.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/joint_gaussian.hpp"
#include "auvest/slat/slat_filter.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Motion_, class Master_, int Masters>
class EkfSlat : public SlatFilter<Motion_, Masters> {
 public:
  using Frame = SlatFilter<Motion_, Masters>;
  using Motion = Motion_;
  using Master = Master_;
  using Model = JointGaussian<Motion, Master, Masters>;
  using typename Frame::Control;
  using typename Frame::MasterBelief;
  using typename Frame::Scalar;
  using typename Frame::SlaveBelief;
  using typename Frame::VelocityChange;
  using BeliefType = typename Model::Joint;
  static constexpr int kPose = Model::kPose;
  static constexpr int kStates = Model::kStates;

  struct Params {
    /// An echo whose NIS (2 degrees of freedom) exceeds this says nothing; 0: no gate.
    Scalar gate = Scalar(0);
  };

  EkfSlat(const Motion& motion, const Master& master, const Params& params = Params())
      : model_(motion, master), params_(params) {
    math::set_zero(belief_.x);
    math::set_zero(belief_.P);
  }

  /// There is no master yet.
  Status reset(const SlaveBelief& pose, math::Random&) {
    if (model_.check() != Status::kOk || !math::is_nonnegative(params_.gate)) {
      return Status::kBadParameter;
    }
    const Status status = Frame::check_slave(pose);
    if (status != Status::kOk) return status;
    this->start();
    Model::start(pose, belief_);
    nis_ = Scalar(0);
    return Status::kOk;
  }

  Status add_master(const MasterBelief& belief) {
    const Status status = this->check_master(belief);
    if (status != Status::kOk) return status;
    Model::put(belief, Model::first_of(masters_), belief_);
    ++masters_;
    return Status::kOk;
  }

  Status predict(Scalar dt, const Control& u, math::Random&,
                 const VelocityChange* changes = nullptr) {
    const Status status = this->check_prediction(dt, u, changes);
    if (status != Status::kOk) return status;
    model_.predict(model_.motion.step(u, dt), dt, changes, masters_, belief_);
    return Status::kOk;
  }

  /// Updates by what the sonar heard at one time: any number of masters, each at most once. Echoes
  /// of kUnknownMaster are those of the masters that make all echoes together the likeliest.
  /// kOverflow: the belief would not be finite.
  Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar, math::Random&) {
    const Status status = this->check_update(echoes, count, masters_, sonar);
    if (status != Status::kOk || count == 0) return status;
    BeliefType belief = belief_;
    Scalar nis = Scalar(0);
    Scalar log_likelihood = log_likelihood_;
    int who[Masters];
    Model::identify(belief, echoes, count, masters_, sonar, params_.gate, who);
    for (int s = 0; s < count; ++s) {
      Score<Scalar> score;
      if (!Model::correct(echoes[s].z, who[s], sonar, params_.gate, belief, score))
        return Status::kOverflow;
      nis = nis + score.nis;
      log_likelihood = log_likelihood + score.log_density - Frame::density_constant();
    }
    belief_ = belief;
    nis_ = nis;
    log_likelihood_ = log_likelihood;
    return Status::kOk;
  }

  SlaveBelief slave() const { return Model::template part<kPose>(belief_, 0); }
  MasterBelief master(int n) const { return Model::template part<6>(belief_, Model::first_of(n)); }

  /// Slave and masters, only the lower triangle of P; masters that were not added are zero.
  const BeliefType& belief() const { return belief_; }
  Scalar nis() const { return nis_; }  ///< of the last update: chi-square, 2 degrees per echo

  /// As SlatFilter::visit_state.
  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    Frame::visit_state(self, visit);
    visit(self.belief_);
    visit(self.nis_);
  }

 private:
  using Frame::log_likelihood_;
  using Frame::masters_;

  Model model_;
  Params params_;
  BeliefType belief_;
  Scalar nis_ = Scalar(0);
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
