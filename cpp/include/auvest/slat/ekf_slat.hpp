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
#include "auvest/slat/safeguards.hpp"
#include "auvest/slat/slat_filter.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct EkfSlatParams : EchoParams<Scalar> {
  /// The slave is considered, not estimated (Schmidt-Kalman): echoes tell of the masters, with all
  /// that is not known of the slave, and never correct it.
  bool consider = false;
};

template <class Motion_, class Master_, int Masters,
          class Safeguards_ = Safeguards<typename Motion_::Scalar, Masters>>
class EkfSlat : public SlatFilter<Motion_, Masters, Safeguards_> {
 public:
  using Frame = SlatFilter<Motion_, Masters, Safeguards_>;
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

  using Params = EkfSlatParams<Scalar>;

  explicit EkfSlat(const Motion& motion = Motion(), const Master& master = Master(),
                   const Params& params = Params())
      : model_(motion, master), params_(params) {
    math::set_zero(belief_.x);
    math::set_zero(belief_.P);
  }

  /// There is no master yet.
  Status reset(const SlaveBelief& pose, math::Random&) {
    if (model_.check() != Status::kOk || !params_.valid()) return Status::kBadParameter;
    const Status status = check_start(pose);
    if (status != Status::kOk) return status;
    this->start(Frame::noise_of_an_hour(model_.motion, model_.master[0]));
    Model::start(pose, belief_);
    nis_ = Scalar(0);
    return Status::kOk;
  }

  Status add_master(const MasterBelief& belief) {
    const Status status = this->check_master(belief);
    if (status != Status::kOk) return status;
    Model::put(belief, Model::first_of(masters_), belief_);
    safeguards_.begin(masters_);
    ++masters_;
    return Status::kOk;
  }

  Status predict(Scalar dt, const Control& u, math::Random&,
                 const VelocityChange* changes = nullptr) {
    const Status status = this->check_prediction(*this, dt, u, changes, params_.longest_step_s,
                                                 Frame::extent_of(belief_));
    if (status != Status::kOk) return status;
    safeguards_.wait(dt, masters_);
    model_.predict(model_.motion.step(u, dt), dt, changes, masters_, belief_);
    return Status::kOk;
  }

  /// Updates by what the sonar heard at one time: any number of masters, each at most once. Echoes
  /// of kUnknownMaster are those of the masters that make all echoes together the likeliest.
  /// An echo of a master that is lost or was silent for too long is its rebirth (safeguards.hpp).
  /// kOverflow: the belief would not be finite.
  Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar, math::Random&) {
    const Status status = this->check_update(echoes, count, masters_, sonar);
    if (status != Status::kOk || count == 0) return status;
    BeliefType belief = belief_;
    Safeguards_ safeguards = safeguards_;
    Scalar nis = Scalar(0);
    Scalar log_likelihood = log_likelihood_;
    int who[Masters];
    Model::identify(belief, echoes, count, masters_, sonar, params_.gate, who);
    bool reborn[Masters];                             // after all others have told of the slave
    for (int s = 0; s < count && s < Masters; ++s) {  // count <= Masters
      const int known = echoes[s].master;
      reborn[s] = known != kUnknownMaster && safeguards.forgotten(known, params_);
      if (reborn[s]) continue;
      Score<Scalar> score;
      const SlaveBelief slave = Model::template part<kPose>(belief, 0);
      if (!Model::correct(echoes[s].z, who[s], sonar, params_.gate, belief, score))
        return Status::kOverflow;
      // With the gain of the slave zero its covariances with the masters are those of the optimal
      // gain, and so is all else but the slave's own part.
      if (params_.consider) Model::put(slave, 0, belief);
      nis = nis + score.nis;
      log_likelihood = log_likelihood + score.log_density - Frame::density_constant();
      if (!Safeguards_::kActive || known == kUnknownMaster) continue;
      if (!(params_.gate > Scalar(0) && score.nis > params_.gate)) {
        safeguards.accepted(known);
      } else {
        reborn[s] = safeguards.refused(known, place_of(sonar, echoes[s].z, slave.x), echoes[s].z(0),
                                       sonar.params, params_);
      }
    }
    for (int s = 0; Safeguards_::kActive && s < count && s < Masters; ++s) {
      if (!reborn[s]) continue;
      Model::give_rebirth(echoes[s].z, echoes[s].master, sonar, params_, belief);
      safeguards.reborn(echoes[s].master);
    }
    belief_ = belief;
    nis_ = nis;
    log_likelihood_ = log_likelihood;
    safeguards_ = safeguards;
    return Status::kOk;
  }

  Scalar longest_step_s() const { return params_.longest_step_s; }

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

  /// Whether the covariance of slave and masters is one: to ask of a state that was put back.
  bool is_sound() const { return check_slave(belief_) == Status::kOk; }

 private:
  using Frame::log_likelihood_;
  using Frame::masters_;
  using Frame::safeguards_;

  Model model_;
  Params params_;
  BeliefType belief_;
  Scalar nis_ = Scalar(0);
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
