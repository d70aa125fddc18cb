// EKF-SLAT: slave and masters in one Gaussian. What a user would take instead of particles, and the
// yardstick for them.
//
// The interface is that of Slatf; random generators are taken and not used, so that the filters are
// exchangeable.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
#include "auvest/slat/joint_gaussian.hpp"
#include "auvest/slat/sighting.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

template <class Motion_, class Master_, int Masters>
class EkfSlat {
 public:
  using Motion = Motion_;
  using Master = Master_;
  using Model = JointGaussian<Motion, Master, Masters>;
  using Scalar = typename Motion::Scalar;
  using Control = typename Motion::Control;
  static constexpr int kPose = Model::kPose;
  static constexpr int kMasters = Masters;
  static constexpr int kStates = Model::kStates;
  using SlaveBelief = typename Model::SlaveBelief;
  using MasterBelief = typename Model::MasterBelief;
  using BeliefType = typename Model::Joint;
  using VelocityChange = Vector<Scalar, 2>;

  struct Params {
    /// An echo whose NIS (2 degrees of freedom) exceeds this says nothing; 0: no gate.
    Scalar gate = Scalar(0);
  };

  EkfSlat(const Motion& motion, const Master& master, const Params& params = Params())
      : model_(motion, master), params_(params), initialised_(false) {
    math::set_zero(belief_.x);
    math::set_zero(belief_.P);
  }

  /// Only the lower triangle of pose.P is read; it may be singular. There is no master yet.
  Status reset(const SlaveBelief& pose, math::Random&) {
    if (model_.check() != Status::kOk || !(params_.gate >= Scalar(0))) {
      return Status::kBadParameter;
    }
    if (!math::all_finite(pose.x) || !math::lower_finite(pose.P)) return Status::kNotFinite;
    Model::start(pose, belief_);
    masters_ = 0;
    nis_ = log_likelihood_ = Scalar(0);
    initialised_ = true;
    return Status::kOk;
  }

  Status add_master(const MasterBelief& belief) {
    if (!initialised_) return Status::kNotInitialised;
    if (masters_ == Masters) return Status::kBadParameter;
    if (!math::all_finite(belief.x) || !math::lower_finite(belief.P)) return Status::kNotFinite;
    if (!math::is_positive_definite(belief.P)) return Status::kNotPositiveDefinite;
    Model::put(belief, Model::first_of(masters_), belief_);
    ++masters_;
    return Status::kOk;
  }

  Status predict(Scalar dt, const Control& u, math::Random&,
                 const VelocityChange* changes = nullptr) {
    if (!initialised_) return Status::kNotInitialised;
    if (!math::is_finite(dt) || !math::all_finite(u)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    if (!plan_finite(changes, masters_)) return Status::kNotFinite;
    model_.predict(model_.motion.step(u, dt), dt, changes, masters_, belief_);
    return Status::kOk;
  }

  /// Takes in what the sonar heard at one time: any number of masters, each at most once. Echoes of
  /// kUnknownMaster are those of the masters that make all echoes together the likeliest.
  /// kOverflow: the belief would not be finite.
  Status update(const Sighting<Scalar>* sightings, int count, const Sonar<Scalar>& sonar,
                math::Random&) {
    if (!initialised_) return Status::kNotInitialised;
    const Status status = check_sightings(sightings, count, masters_, sonar, kPose, false);
    if (status != Status::kOk || count == 0) return status;
    BeliefType belief = belief_;
    Scalar nis = Scalar(0);
    Scalar log_likelihood = log_likelihood_;
    int who[Masters];
    Model::identify(belief, sightings, count, masters_, sonar, params_.gate, who);
    for (int s = 0; s < count; ++s) {
      Score<Scalar> score;
      if (!Model::correct(sightings[s].z, who[s], sonar, params_.gate, belief, score))
        return Status::kOverflow;
      nis = nis + score.nis;
      log_likelihood = log_likelihood + score.log_density - Scalar(1.8378770664);  // log(2 pi)
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
  int masters() const { return masters_; }
  Scalar nis() const { return nis_; }  ///< of the last update: chi-square, 2 degrees per sighting
  Scalar log_likelihood() const { return log_likelihood_; }  ///< of all sightings since reset

 private:
  Model model_;
  Params params_;
  BeliefType belief_;
  int masters_ = 0;
  Scalar nis_ = Scalar(0);
  Scalar log_likelihood_ = Scalar(0);
  bool initialised_;

 public:
  /// Hands all numbers of the state to `visit`, which keeps them, or overwrites them by those that
  /// were kept: to save a filter and to go on from there. `Self` is this class, const to save.
  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    visit(self.belief_);
    visit(self.nis_);
    visit(self.log_likelihood_);
    visit.count(self.masters_, Masters);
    visit.count(self.initialised_, true);
  }
};

}  // namespace auvest
