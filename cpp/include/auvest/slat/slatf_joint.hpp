// SLATF with joint Gaussians: particles that draw only what the sonar sees.
//
// In SLATF 2.0 a particle's pose is a point. But slave and masters share a drift that no sonar sees
// (move all of them together and every echo stays the same), and what is represented by points
// alone, without noise of its own, dies out as particles are resampled. Here a particle is the
// joint Gaussian of pose and masters, cross-covariances included: [SLATF 50], which carries a
// covariance of the pose, taken at its word. The echoes of a ping update the whole Gaussian and
// weigh it by [SLATF 65]. Then the particle draws what the sonar's equations are curved in and the
// slave's noise makes new from ping to ping, range and bearing of one master. The drift, the
// velocities, the other masters and a share of range and bearing stay Gaussian.
//
//     kept = 0   range and bearing become a point, as in 2.0
//     kept = 1   nothing is drawn: one particle is EkfSlat, to the bit
//
// The interface is that of Slatf. Derivation and figures: docs/algorithms/slatf.md.
#pragma once

#include "auvest/math/counter_random.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/particles/lanes.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/mixture.hpp"
#include "auvest/particles/particle_set.hpp"
#include "auvest/particles/resampling.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/joint_gaussian.hpp"
#include "auvest/slat/safeguards.hpp"
#include "auvest/slat/slat_filter.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct SlatfJointParams : EchoParams<Scalar> {
  Scalar resample_below = Scalar(0.5);  ///< resample where N_eff < this times N, [SLATF 33]
  Scalar kept = Scalar(0.5);  ///< share of the covariance of range and bearing that is not drawn
};

/// The fields of a particle: the pose and each master, mean and lower triangle, then the
/// covariances between them, each master's six rows up to its own block.
template <int Pose, int Masters>
struct SlatfJointFields {
  static constexpr int kPoseField = 0;
  static constexpr int kMasterField = Pose + triangle_numbers(Pose);
  static constexpr int kMasterNumbers = 6 + triangle_numbers(6);
  static constexpr int kCrossField = kMasterField + Masters * kMasterNumbers;
  static constexpr int kCrossNumbers = Masters * (6 * Pose) + 36 * (Masters * (Masters - 1) / 2);
  static constexpr int kFields = kCrossField + kCrossNumbers;
};

template <class Motion, int Masters, class Resampling, class Safeguards>
using SlatfJointFrame = ParticleSlatFilter<
    Motion, Masters,
    ParticleSet<typename Motion::Scalar, SlatfJointFields<Motion::kStates, Masters>::kFields>,
    Resampling, Safeguards>;

template <class Motion_, class Master_, int Masters, class Resampling_ = SystematicResampling,
          class Safeguards_ = Safeguards<typename Motion_::Scalar, Masters>>
class SlatfJoint : public SlatfJointFrame<Motion_, Masters, Resampling_, Safeguards_>,
                   public SlatfJointFields<Motion_::kStates, Masters> {
 public:
  using Frame = SlatfJointFrame<Motion_, Masters, Resampling_, Safeguards_>;
  using Fields = SlatfJointFields<Motion_::kStates, Masters>;
  using Motion = Motion_;
  using Master = Master_;
  using Resampling = Resampling_;
  using Model = JointGaussian<Motion, Master, Masters>;
  using typename Frame::Control;
  using typename Frame::MasterBelief;
  using typename Frame::Scalar;
  using typename Frame::SlaveBelief;
  using typename Frame::VelocityChange;
  using Params = SlatfJointParams<Scalar>;
  using Joint = typename Model::Joint;
  static constexpr int kPose = Model::kPose;

  /// The particles live in `storage`, which holds at least Set::storage_size(capacity) numbers and
  /// must outlive the filter.
  SlatfJoint(const Motion& motion, const Master& master, const Params& params, Scalar* storage,
             int capacity, const Resampling& resampling = Resampling())
      : Frame(storage, capacity, resampling), model_(motion, master), params_(params) {}

  template <int Capacity>
  SlatfJoint(const Motion& motion, const Master& master, const Params& params,
             ParticleStorage<Scalar, Fields::kFields, Capacity>& storage,
             const Resampling& resampling = Resampling())
      : SlatfJoint(motion, master, params, storage.numbers, Capacity, resampling) {}

  /// Noise, gate and recovery are those of default parameters.
  template <int Capacity>
  explicit SlatfJoint(ParticleStorage<Scalar, Fields::kFields, Capacity>& storage)
      : SlatfJoint(Motion(), Master(), Params(), storage) {}

  /// A copy of `other`, whose particles are copied into a storage as large as its own.
  SlatfJoint(const SlatfJoint& other, Scalar* storage)
      : Frame(other, storage), model_(other.model_), params_(other.params_) {}

  /// All particles hold the belief `pose`, whose P may be singular or zero; there is no master yet.
  /// Nothing is drawn before an echo comes.
  Status reset(const SlaveBelief& pose, int particles, math::Random&) {
    const bool valid = this->fits(particles) && Frame::is_share(params_.resample_below) &&
                       Frame::is_share(params_.kept) && params_.valid();
    if (!valid || model_.check() != Status::kOk) return Status::kBadParameter;
    const Status status = check_start(pose);
    if (status != Status::kOk) return status;
    this->start(particles, Frame::noise_of_an_hour(model_.motion, model_.master[0]));
    Joint joint;
    Model::start(pose, joint);
    for (int i = 0; i < set_.size(); ++i) store(i, joint);
    set_.fill_block();
    return Status::kOk;
  }

  /// With as many particles as the storage holds.
  Status reset(const SlaveBelief& pose, math::Random& random) {
    return reset(pose, set_.capacity(), random);
  }

  /// One more master, with the same belief in all particles. Masters are numbered from 0.
  Status add_master(const MasterBelief& belief) {
    const Status status = this->check_master(belief);
    if (status != Status::kOk) return status;
    for (int i = 0; i < set_.size(); ++i) {
      store_belief<Lanes>(set_.at(i, master_field(masters_)), belief);
    }
    set_.fill_block();
    safeguards_.begin(masters_);
    ++masters_;
    return Status::kOk;
  }

  /// Carries all particles dt >= 0 seconds forward, during which the slave's reading `u` holds.
  /// `changes`: the velocity changes [m/s] that the masters planned for these seconds, one per
  /// master; null: none. Takes no random numbers.
  Status predict(Scalar dt, const Control& u, math::Random&,
                 const VelocityChange* changes = nullptr) {
    const Status status =
        this->check_prediction(*this, dt, u, changes, params_.longest_step_s, extent());
    if (status != Status::kOk) return status;
    safeguards_.wait(dt, masters_);
    const typename Motion::Step move = model_.motion.step(u, dt);
    for (int i = 0; i < set_.size(); ++i) {
      Joint joint;
      load(i, joint);
      model_.predict(move, dt, changes, masters_, joint);
      store(i, joint);
    }
    return Status::kOk;
  }

  /// Updates by what the sonar heard at one time: any number of masters, each at most once. Echoes
  /// of kUnknownMaster are, in each particle, those of the masters that make all echoes together
  /// the likeliest. Takes one key of random numbers, then what the resampling policy takes.
  Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
                math::Random& random) {
    const Status status = this->check_update(echoes, count, masters_, sonar);
    if (status != Status::kOk || count == 0) return status;
    const Update update(echoes, count, sonar, *this, random);
    Refused refused;
    for (int i = 0; update.left > 0 && i < set_.size(); ++i) {
      Joint joint;
      load(i, joint);
      correct(i, update, refused, joint);
      store(i, joint);
    }
    weigh_up(update, refused, random);
    return Status::kOk;
  }

  /// predict() and update() in one pass over the particles: the same bits.
  Status step(Scalar dt, const Control& u, const VelocityChange* changes,
              const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
              math::Random& random) {
    Status status = this->check_prediction(*this, dt, u, changes, params_.longest_step_s, extent());
    if (status == Status::kOk) status = this->check_update(echoes, count, masters_, sonar);
    if (status != Status::kOk) return status;
    if (count == 0) return predict(dt, u, random, changes);
    safeguards_.wait(dt, masters_);
    const typename Motion::Step move = model_.motion.step(u, dt);
    const Update update(echoes, count, sonar, *this, random);
    Refused refused;
    for (int i = 0; i < set_.size(); ++i) {
      Joint joint;
      load(i, joint);
      model_.predict(move, dt, changes, masters_, joint);
      if (update.left > 0) correct(i, update, refused, joint);
      store(i, joint);
    }
    weigh_up(update, refused, random);
    return Status::kOk;
  }

  /// Mean and covariance of the slave's pose; the heading's mean is that of unit vectors.
  SlaveBelief slave() const {
    return summarise<Lanes, kPose, true, (kPose > 2)>(set_, Fields::kPoseField);
  }

  /// Mean and covariance of master n.
  MasterBelief master(int n) const {
    return summarise<Lanes, 6, true, false>(set_, master_field(n));
  }

  Scalar longest_step_s() const { return params_.longest_step_s; }

  /// The Gaussian of particle i: slave and masters, only the lower triangle of P.
  Joint particle(int i) const {
    Joint joint;
    load(i, joint);
    return joint;
  }

  /// Whether each particle has a covariance, which the mean over all does not show: to ask of a
  /// state that was put back.
  bool is_sound() const {
    for (int i = 0; i < set_.size(); ++i) {
      if (check_slave(particle(i)) != Status::kOk) return false;
    }
    return true;
  }

 private:
  using Lanes = OneLane<Scalar>;
  using Frame::masters_;
  using Frame::safeguards_;
  using Frame::set_;
  using Refused = RefusedWeight<Scalar, Masters>;

  /// What an update is, for all particles: first the echoes that correct, then those that are the
  /// rebirth of a forgotten master.
  struct Update {
    Echo<Scalar> echoes[Masters];
    int left = 0;
    int count;
    const Sonar<Scalar>& sonar;
    math::CounterKey key;

    Update(const Echo<Scalar>* heard, int number, const Sonar<Scalar>& device,
           const SlatfJoint& filter, math::Random& random)
        : count(number), sonar(device), key(random) {
      int last = number;
      for (int s = 0; s < number; ++s) {
        const bool forgotten = heard[s].master != kUnknownMaster &&
                               filter.safeguards_.forgotten(heard[s].master, filter.params_);
        echoes[forgotten ? --last : left++] = heard[s];
      }
    }
  };

  /// The extent of the first particle. The others are not far from it.
  Extent<Scalar> extent() const {
    Joint joint;
    load(0, joint);
    return Frame::extent_of(joint);
  }

  /// What the particles say of an update that they have taken in: of their weights and of echoes
  /// that they refuse.
  void weigh_up(const Update& update, const Refused& refused, math::Random& random) {
    if (update.left > 0) {
      this->template normalise_and_resample<Lanes>(update.left, params_.resample_below, random,
                                                   [] {});
    }
    for (int s = update.left; s < update.count; ++s) rebirth(update.echoes[s], update.sonar);
    for (int s = 0; Safeguards_::kActive && s < update.left; ++s) {
      const Echo<Scalar>& echo = update.echoes[s];
      if (echo.master == kUnknownMaster) continue;
      if (!(refused.of[s] > Scalar(0.5))) {
        safeguards_.accepted(echo.master);
      } else if (safeguards_.refused(echo.master, place_of(update.sonar, echo.z, slave().x),
                                     echo.z(0), update.sonar.params, params_)) {
        rebirth(echo, update.sonar);
      }
    }
  }

  AUVEST_COLD void rebirth(const Echo<Scalar>& echo, const Sonar<Scalar>& sonar) {
    for (int i = 0; i < set_.size(); ++i) {
      Joint joint;
      load(i, joint);
      Model::give_rebirth(echo.z, echo.master, sonar, params_, joint);
      store(i, joint);
    }
    set_.fill_block();
    safeguards_.reborn(echo.master);
  }

  static int master_field(int n) { return Fields::kMasterField + n * Fields::kMasterNumbers; }

  /// Calls visit(offset from the first field, row, column) for all covariances between blocks.
  template <class Visit>
  static void for_each_cross(const Visit& visit) {
    int offset = Fields::kCrossField * kBlock;
    for (int n = 0; n < Masters; ++n) {
      for (int row = Model::first_of(n); row < Model::first_of(n) + 6; ++row) {
        for (int column = 0; column < Model::first_of(n); ++column, offset += kBlock) {
          visit(offset, row, column);
        }
      }
    }
  }

  void load(int i, Joint& joint) const {
    const Scalar* from = set_.at(i, 0);
    SlaveBelief pose;
    load_belief<Lanes>(from, pose);
    Model::put(pose, 0, joint);
    for (int n = 0; n < Masters; ++n) {
      MasterBelief master;
      load_belief<Lanes>(from + master_field(n) * kBlock, master);
      Model::put(master, Model::first_of(n), joint);
    }
    for_each_cross([&](int offset, int row, int column) { joint.P(row, column) = from[offset]; });
  }

  void store(int i, const Joint& joint) {
    Scalar* to = set_.at(i, 0);
    store_belief<Lanes>(to, Model::template part<kPose>(joint, 0));
    for (int n = 0; n < Masters; ++n) {
      store_belief<Lanes>(to + master_field(n) * kBlock,
                          Model::template part<6>(joint, Model::first_of(n)));
    }
    for_each_cross([&](int offset, int row, int column) { to[offset] = joint.P(row, column); });
  }

  /// All that the echoes do to particle i: they refine its Gaussian one after the other and weigh
  /// it, [SLATF 65]. Then it draws, once: the master of the first echo within the gate.
  void correct(int i, const Update& update, Refused& refused, Joint& joint) {
    Scalar& log_weight = set_.log_weights()[i];
    const Scalar before = log_weight;
    int first = kUnknownMaster;
    int who[Masters];
    Model::identify(joint, update.echoes, update.left, masters_, update.sonar, params_.gate, who);
    for (int s = 0; s < update.left && s < Masters; ++s) {  // left <= Masters
      Score<Scalar> score;
      const bool finite =
          Model::correct(update.echoes[s].z, who[s], update.sonar, params_.gate, joint, score);
      const bool outlier = params_.gate > Scalar(0) && score.nis > params_.gate;
      if (first == kUnknownMaster && finite && !outlier) first = who[s];
      if (outlier) refused.of[s] = refused.of[s] + weight_of(before);
      log_weight = log_weight + score.log_density;
    }
    if (first == kUnknownMaster || !(params_.kept < Scalar(1))) return;
    Scalar e[2];
    math::counter_normal_pair(update.key, Lanes::index(i), 0u, e[0], e[1]);
    Model::draw(first, update.sonar, params_.kept, e, joint);
  }

  Model model_;
  Params params_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
