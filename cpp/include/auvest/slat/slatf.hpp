// SLATF: simultaneous localisation and tracking on the FastSLAM framework (Lu, Chen, Liu, Ma, He
// 2020). A slave vehicle that can only dead-reckon sees masters with its own sonar and treats each
// as a moving landmark: a particle is a pose of the slave and, given that pose's past, one Kalman
// filter per master, [SLATF 9] and [SLATF 34].
//
//     filter.reset(pose, particles, random);    // communication breaks: draw from the prior
//     filter.add_master(belief);
//     filter.predict(dt, reading, random);      // at the rate of the odometry
//     filter.update(echoes, 1, sonar, random);  // at the rate of the sonar
//     filter.slave(), filter.master(0)          // Gaussian summaries
//
// Slatf1 samples poses from the motion, Slatf2 from motion and measurement (proposals.hpp); all
// else is one code. This file is section 6 of the paper; what happens to one particle is in
// slatf_particle.hpp, the order in which particles are visited in particles/tiles.hpp. The update
// of a master is that of the Kalman filters (square_root_update.hpp), so with one particle and no
// noise of the slave SLATF is the EKF of the master, to the bit.
//
// What the paper leaves open or misprints, and what is done here: docs/algorithms/slatf.md.
#pragma once

#include "auvest/math/counter_random.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/particles/lanes.hpp"
#include "auvest/particles/mixture.hpp"
#include "auvest/particles/ordered_sum.hpp"
#include "auvest/particles/resampling.hpp"
#include "auvest/slat/association.hpp"
#include "auvest/slat/definite.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/proposals.hpp"
#include "auvest/slat/slat_filter.hpp"
#include "auvest/slat/slatf_particle.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Particle, int Masters, class Resampling, class Safeguards>
using SlatfFrame = ParticleSlatFilter<typename Particle::Motion, Masters, typename Particle::Set,
                                      Resampling, Safeguards>;

/// The error of the mean over particles that past resamplings have left in it.
template <class Scalar, int Pose, bool Known>
class MonteCarloError {
 public:
  MonteCarloError() { restart(); }
  void restart() { math::set_zero(covariance_); }

  /// The covariance of the slave with it, by `spread`, that of the particles' points, of which
  /// s = sum w^2 says how many count: a mean over few is off by a share of what it is over, and
  /// their spread is short by that share.
  void add_to(Matrix<Scalar, Pose, Pose>& P, const Matrix<Scalar, Pose, Pose>& spread,
              Scalar s) const {
    const Scalar rest = math::larger(Scalar(1) - s, Scalar(1e-3));
    const Scalar more = Scalar(1) / rest - Scalar(1) + s;
    for (int i = 0; i < Pose; ++i) {
      for (int j = 0; j < Pose; ++j) {
        P(i, j) = P(i, j) + more * spread(i, j) + covariance_(i, j);
      }
    }
  }

  /// A resampling from weights with s = sum w^2 of particles whose covariance is P with all this.
  void resampled(const Matrix<Scalar, Pose, Pose>& P, Scalar s) {
    for (int i = 0; i < Pose; ++i) {
      for (int j = 0; j < Pose; ++j) {
        covariance_(i, j) = covariance_(i, j) + s * (P(i, j) - covariance_(i, j));
      }
    }
  }

  const Matrix<Scalar, Pose, Pose>& covariance() const { return covariance_; }

  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    visit(self.covariance_);
  }

 private:
  Matrix<Scalar, Pose, Pose> covariance_;
};

template <class Scalar, int Pose>
class MonteCarloError<Scalar, Pose, false> {
 public:
  void restart() {}
  template <class Self, class Visit>
  static void visit_state(Self&, Visit&) {}
};

template <class Motion_, class Master_, class Proposal_, int Masters,
          class Resampling_ = SystematicResampling,
          class Lanes_ = OneLane<typename Motion_::Scalar>,
          class Safeguards_ = Safeguards<typename Motion_::Scalar, Masters>>
class Slatf : public SlatfFrame<
                  SlatfParticle<Motion_, Master_, Proposal_, Masters, Lanes_, Safeguards_::kActive>,
                  Masters, Resampling_, Safeguards_> {
 public:
  using Particle =
      SlatfParticle<Motion_, Master_, Proposal_, Masters, Lanes_, Safeguards_::kActive>;
  using Frame = SlatfFrame<Particle, Masters, Resampling_, Safeguards_>;
  using Motion = Motion_;
  using Master = Master_;
  using Proposal = Proposal_;
  using Resampling = Resampling_;
  using Lanes = Lanes_;
  using typename Frame::Control;
  using typename Frame::MasterBelief;
  using typename Frame::Scalar;
  using typename Frame::SlaveBelief;
  using typename Frame::VelocityChange;
  using Params = SlatfParams<Scalar>;
  static constexpr int kPose = Particle::kPose;
  static constexpr int kPoseField = Particle::kPoseField;
  static constexpr int kMasterField = Particle::kMasterField;
  static constexpr int kMasterNumbers = Particle::kMasterNumbers;

  /// The particles live in `storage`, which holds at least Set::storage_size(capacity) numbers and
  /// must outlive the filter.
  Slatf(const Motion& motion, const Master& master, const Params& params, Scalar* storage,
        int capacity, const Resampling& resampling = Resampling())
      : Frame(storage, capacity, resampling), motion_(motion), master_(master), params_(params) {}

  template <int Capacity>
  Slatf(const Motion& motion, const Master& master, const Params& params,
        ParticleStorage<Scalar, Frame::Set::kFields, Capacity>& storage,
        const Resampling& resampling = Resampling())
      : Slatf(motion, master, params, storage.numbers, Capacity, resampling) {}

  /// Noise, gate and recovery are those of default parameters.
  template <int Capacity>
  explicit Slatf(ParticleStorage<Scalar, Frame::Set::kFields, Capacity>& storage)
      : Slatf(Motion(), Master(), Params(), storage) {}

  /// A copy of `other`, whose particles are copied into a storage as large as its own.
  Slatf(const Slatf& other, Scalar* storage)
      : Frame(other, storage),
        motion_(other.motion_),
        master_(other.master_),
        params_(other.params_),
        error_(other.error_) {}

  /// Section 6, start: draws the poses of `particles` particles from the prior N(pose.x, pose.P);
  /// there is no master yet. P may be singular or zero.
  Status reset(const SlaveBelief& pose, int particles, math::Random& random) {
    const bool valid = this->fits(particles) && Frame::is_share(params_.resample_below) &&
                       params_.valid() && math::is_nonnegative(params_.birth_velocity_m_s) &&
                       params_.birth_velocity_m_s <= Params::most() &&
                       math::is_positive(params_.birth_acceleration_m_s2) &&
                       params_.birth_acceleration_m_s2 <= Params::most() &&
                       (params_.gate > Scalar(0) || !births());
    if (!valid || motion_.check() != Status::kOk || master_.check() != Status::kOk) {
      return Status::kBadParameter;
    }
    const Status status = check_start(pose);
    if (status != Status::kOk) return status;
    this->start(particles, Frame::noise_of_an_hour(motion_, master_));
    error_.restart();

    Matrix<Scalar, kPose, kPose> root;
    Matrix<Scalar, 1, kPose> no_others;
    math::factor_leading<math::DropLostPivots>(pose.P, root, no_others);
    const math::CounterKey key(random);
    Schedule::for_each_group(set_, [&](int i) {
      Belief<Value, kPose> drawn;
      Matrix<Value, kPose, kPose> spread;
      math::set_zero(drawn.P);
      for (int k = 0; k < kPose; ++k) {
        drawn.x(k) = Value(pose.x(k));
        for (int l = 0; l < kPose; ++l) spread(k, l) = Value(root(k, l));
      }
      const Single particle = {set_, i};
      Value e[kPose + 1];
      Particle::draw(typename Schedule::Single(), i, key, e);
      Particle::sample(spread, e, drawn.x);
      particle.store(drawn);
    });
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
    Belief<Value, 6> copy;
    for (int k = 0; k < 6; ++k) {
      copy.x(k) = Value(belief.x(k));
      for (int l = 0; l <= k; ++l) copy.P(k, l) = Value(belief.P(k, l));
    }
    Schedule::for_each_group(set_, [&](int i) {
      Particle::Bank::begin(master_, copy, set_.at(i, Particle::master_field(masters_)));
    });
    safeguards_.begin(masters_);
    ++masters_;
    return Status::kOk;
  }

  /// Carries all particles dt >= 0 seconds forward, during which the slave's reading `u` holds.
  /// `changes`: the velocity changes [m/s] that the masters planned for these seconds, one per
  /// master; null: none. Takes one key of random numbers.
  Status predict(Scalar dt, const Control& u, math::Random& random,
                 const VelocityChange* changes = nullptr) {
    const Status status =
        this->check_prediction(*this, dt, u, changes, params_.longest_step_s, extent());
    if (status != Status::kOk) return status;
    safeguards_.wait(dt, masters_);
    const Prediction prediction(motion_.step(u, dt), dt, changes, random);
    Schedule::for_each(set_, [&](const Tile& tile) { predict(tile, prediction); });
    return Status::kOk;
  }

  /// Updates by what the sonar heard at one time: any number of masters, each at most once. Masters
  /// that were not heard keep all their bits, [SLATF 34]. An echo of kUnknownMaster is, in each
  /// particle, that of the master to which it is likeliest (nearest neighbour). An echo of a master
  /// that is lost or was silent for too long is its rebirth (safeguards.hpp). Takes one key of
  /// random numbers, then what the resampling policy takes, then a key for each rebirth.
  Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
                math::Random& random) {
    const Status status = check(echoes, count, sonar);
    if (status != Status::kOk || count == 0) return status;
    Update update(echoes, count, sonar, params_, random);
    RefusedWeight<Scalar, Safeguards_::kActive ? Masters : 1> refused;
    watch(update, refused);
    Echo<Scalar> old[Masters];  // what is left after births
    const Echo<Scalar>* reborn[Masters];
    int rebirths = 0;
    if (births() || remembers_silence()) {
      int left = 0;
      for (int s = 0; s < count; ++s) {
        if (echoes[s].master != kUnknownMaster) {
          const bool forgotten = safeguards_.forgotten(echoes[s].master, params_);
          (forgotten ? reborn[rebirths++] = &echoes[s] : &(old[left++] = echoes[s]));
        } else if (births() && is_unassociated(update, s)) {
          add_master(update, s);
        } else {
          old[left++] = echoes[s];
        }
      }
      update.echoes = old;
      update.count = left;
    }
    if (update.count > 0) {
      Schedule::for_each(set_, [&](const Tile& tile) { correct(tile, update); });
      weigh_up(update, random);
    }
    for (int k = 0; k < rebirths; ++k) rebirth(*reborn[k], sonar, random);
    return Status::kOk;
  }

  /// predict() and update() in one pass over the particles: the same bits, half the memory traffic.
  Status step(Scalar dt, const Control& u, const VelocityChange* changes,
              const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
              math::Random& random) {
    Status status = this->check_prediction(*this, dt, u, changes, params_.longest_step_s, extent());
    if (status == Status::kOk) status = check(echoes, count, sonar);
    if (status != Status::kOk) return status;
    if (count == 0 || births() || remembers_silence()) {
      predict(dt, u, random, changes);
      return update(echoes, count, sonar, random);
    }
    const Prediction prediction(motion_.step(u, dt), dt, changes, random);
    Update update(echoes, count, sonar, params_, random);
    RefusedWeight<Scalar, Safeguards_::kActive ? Masters : 1> refused;
    watch(update, refused);
    safeguards_.wait(dt, masters_);
    Schedule::for_each(set_, [&](const Tile& tile) {
      predict(tile, prediction);
      correct(tile, update);
    });
    weigh_up(update, random);
    return Status::kOk;
  }

  /// Mean and covariance of the slave's pose; the heading's mean is that of unit vectors. The
  /// covariance is too small where much is resampled, with `monte_carlo` less so.
  SlaveBelief slave() const {
    SlaveBelief pose = summarise<Lanes, kPose, Proposal::kInformed, (kPose > 2)>(set_, kPoseField);
    add_monte_carlo(pose.P, square_sum(), MonteCarlo<Safeguards_::kActive>());
    return pose;
  }

  /// Mean and covariance of master n. What resampling has left in the mean slave and masters share.
  MasterBelief master(int n) const {
    MasterBelief master = summarise<Lanes, 6, true, false>(set_, Particle::master_field(n));
    add_monte_carlo(master, MonteCarlo<Safeguards_::kActive>());
    mend_indefinite(master.P);  // after hours of silence: those of the particles are rounded
    return master;
  }

  Scalar longest_step_s() const { return params_.longest_step_s; }

  /// As SlatFilter::visit_state.
  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    Frame::visit_state(self, visit);
    MonteCarloError<Scalar, kPose, Safeguards_::kActive>::visit_state(self.error_, visit);
  }

  /// Whether each particle has covariances, and probabilities of an Imm, which the mean over all
  /// does not show: to ask of a state that was put back.
  bool is_sound() const {
    const Extent<Scalar> first = extent();
    bool sound = true;
    for (int i = 0; i < set_.size(); ++i) {
      sound = sound && (!Proposal::kInformed || is_belief<kPose>(set_.at(i, kPoseField), first));
      for (int n = 0; n < masters_; ++n) {
        sound = sound && Particle::Bank::is_sound(set_.at(i, Particle::master_field(n)), first);
      }
    }
    return sound;
  }

  /// With an Imm as Master: the probability that its model k moves master n.
  Scalar mode_probability(int n, int k) const {
    Scalar mean[1];
    weighted_means<Lanes>(
        set_,
        [&](int i, Value(&q)[1]) {
          q[0] = Particle::Bank::probability(set_.at(i, Particle::master_field(n)), k);
        },
        mean);
    return mean[0];
  }

  /// Means of the positions [m].
  struct Positions {
    Vector<Scalar, 2> slave;
    Vector<Scalar, 2> masters[Masters];
  };

  /// All that slave() and master() say of positions but the covariances, in one pass over fewer
  /// fields: for every step.
  Positions positions() const {
    constexpr int kNumbers = 2 + 2 * Masters;
    int fields[kNumbers];
    for (int k = 0; k < 2; ++k) {
      fields[k] = kPoseField + k;
      for (int n = 0; n < Masters; ++n) fields[2 + 2 * n + k] = Particle::master_field(n) + k;
    }
    Scalar mean[kNumbers];
    mean_fields<Lanes>(set_, fields, mean);
    Positions result;
    for (int k = 0; k < 2; ++k) {
      result.slave(k) = mean[k];
      for (int n = 0; n < Masters; ++n) result.masters[n](k) = mean[2 + 2 * n + k];
    }
    return result;
  }

 private:
  using Value = typename Lanes::Value;
  using Schedule = typename Particle::Schedule;
  using Tile = typename Schedule::Tile;
  using Single = typename Particle::Single;
  using Prediction = typename Particle::Prediction;
  using Update = typename Particle::Update;
  using Frame::masters_;
  using Frame::safeguards_;
  using Frame::set_;
  template <bool>
  struct MonteCarlo {};
  template <int Size>
  using Refused = RefusedWeight<Scalar, Size>;

  // ---- Safeguards (safeguards.hpp), which are ours, not the paper's

  bool remembers_silence() const {
    return Safeguards_::kActive && params_.forget_after_s > Scalar(0);
  }

  static void watch(Update& update, Refused<Masters>& refused) { update.refused = &refused; }
  template <class None>
  static void watch(Update&, None&) {}

  /// What the particles say of an update that they have taken in: of their weights, [SLATF 32] and
  /// [SLATF 33], and of echoes that they refuse.
  void weigh_up(const Update& update, math::Random& random) {
    this->template normalise_and_resample<Lanes>(
        update.count, params_.resample_below, random,
        [this] { remember_error(MonteCarlo<Safeguards_::kActive>()); });
    if (!Safeguards_::kActive) return;
    for (int s = 0; s < update.count; ++s) {
      const Echo<Scalar>& echo = update.echoes[s];
      if (echo.master == kUnknownMaster) continue;
      if (!(update.refused->of[s] > Scalar(0.5))) {
        safeguards_.accepted(echo.master);
      } else if (safeguards_.refused(echo.master, place_of(update.sonar, echo.z, slave().x),
                                     echo.z(0), update.sonar.params, params_)) {
        rebirth(echo, update.sonar, random);
      }
    }
  }

  /// Each particle's master is born where it hears the echo come from. What its pose has gathered
  /// since it was drawn would tie them together, and a particle has no room for that: so it is
  /// drawn now.
  AUVEST_COLD void rebirth(const Echo<Scalar>& echo, const Sonar<Scalar>& sonar,
                           math::Random& random) {
    const math::CounterKey key(random);
    const bool drawn = Proposal::kInformed && !params_.carry_covariance;
    Schedule::for_each_group(set_, [&](int i) {
      const Single particle = {set_, i};
      typename Single::Pose pose;
      particle.load(pose);
      if (drawn) {
        Matrix<Value, kPose, kPose> root;
        Matrix<Value, 1, kPose> no_others;
        Value e[kPose + 1];
        math::factor_leading<math::DropLostPivots>(pose.P, root, no_others);
        Particle::draw(typename Schedule::Single(), i, key, e);
        Particle::sample(root, e, pose.x);
        math::set_zero(pose.P);
        particle.store(pose);
      }
      Belief<Value, 6> born;
      give_birth(sonar, echo.z, pose, Proposal::kInformed && !drawn,
                 params_.rebirth_velocity_variance(), params_.rebirth_acceleration_variance(),
                 born);
      Particle::Bank::begin(master_, born, particle.master(echo.master));
    });
    safeguards_.reborn(echo.master);
  }

  // ---- The error of the mean over particles

  /// sum w^2
  Scalar square_sum() const {
    const bool resampled =
        this->effective_size() < params_.resample_below * Scalar(set_.size());  // last
    return Scalar(1) / (resampled ? Scalar(set_.size()) : this->effective_size());
  }

  void add_monte_carlo(Matrix<Scalar, kPose, kPose>&, Scalar, MonteCarlo<false>) const {}
  void add_monte_carlo(Matrix<Scalar, kPose, kPose>& P, Scalar s, MonteCarlo<true>) const {
    if (!params_.monte_carlo) return;
    error_.add_to(P, summarise<Lanes, kPose, false, (kPose > 2)>(set_, kPoseField).P, s);
  }
  void add_monte_carlo(MasterBelief&, MonteCarlo<false>) const {}
  void add_monte_carlo(MasterBelief& master, MonteCarlo<true>) const {
    for (int i = 0; params_.monte_carlo && i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        master.P(i, j) = master.P(i, j) + error_.covariance()(i, j);
      }
    }
  }
  void remember_error(MonteCarlo<false>) {}
  void remember_error(MonteCarlo<true>) {
    if (!params_.monte_carlo) return;
    const Scalar s = Scalar(1) / this->effective_size();
    SlaveBelief pose = summarise<Lanes, kPose, Proposal::kInformed, (kPose > 2)>(set_, kPoseField);
    add_monte_carlo(pose.P, s, MonteCarlo<true>());
    error_.resampled(pose.P, s);
  }

  /// The extent of the first particle. The others are not far from it.
  Extent<Scalar> extent() const {
    using One = OneLane<Scalar>;
    SlaveBelief pose;
    math::set_zero(pose.P);
    load_mean<One>(set_.at(0, kPoseField), pose.x);
    if (Proposal::kInformed) load_belief<One>(set_.at(0, kPoseField), pose);
    Extent<Scalar> result = Frame::extent_of(pose);
    for (int n = 0; n < masters_; ++n) {
      MasterBelief master;
      load_belief<One>(set_.at(0, Particle::master_field(n)), master);
      Frame::extend(master, kPose, result);
    }
    return result;
  }

  /// With births, as many echoes as there may be masters.
  Status check(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar) const {
    return this->check_update(echoes, count, births() ? Masters : masters_, sonar);
  }

  /// Section 6, step 1, without the echo: [SLATF 11], or for 1.0 the sample of it, [SLATF 10]; and
  /// the masters, [SLATF 15] and [SLATF 16].
  AUVEST_INLINE void predict(const Tile& tile, const Prediction& prediction) {
    tile.run_pairs(typename Particle::PredictPose{set_, motion_, prediction});
    tile.run(typename Particle::PredictMasters{set_, master_, prediction, masters_});
  }

  /// Section 6, steps 1 to 3, with the echoes: [SLATF 58] for 2.0, then one echo after the other.
  AUVEST_INLINE void correct(const Tile& tile, const Update& update) {
    Value chosen[Schedule::kGroups][Masters];
    for (auto& group : chosen) {
      for (Value& master : group) master = Value(0);  // compilers cannot see that it is set in time
    }
    if (!update.all_known()) {
      tile.run(typename Particle::AssociateAndPropose{set_, update, masters_, chosen});
    } else if (Proposal::kInformed) {
      tile.run_pairs(typename Particle::Propose{set_, update});
    }
    for (int s = 0; s < update.count; ++s) {
      const int sender = update.echoes[s].master;
      const bool known = sender != kUnknownMaster;
      for (int n = known ? sender : 0; n < (known ? sender + 1 : masters_); ++n) {
        correct_master(tile, update, s, n, known ? nullptr : chosen,
                       Models<Particle::Bank::kModes>());
      }
    }
  }

  template <int Count>
  struct Models {};

  /// Steps 2 and 3 for echo s and master n: by the first kernel [SLATF 22], [SLATF 23] and,
  /// for 1.0, [SLATF 30] and [SLATF 31]; by the second [SLATF 25] and [SLATF 26]. Where it is not
  /// known whose the echo is, in those particles that have chosen n.
  AUVEST_INLINE void correct_master(const Tile& tile, const Update& update, int s, int n,
                                    const Value (*chosen)[Masters], Models<1>) {
    MasterEkf<Value> ekfs[Schedule::kGroups];
    if (chosen == nullptr) {
      tile.run_pairs(typename Particle::Weigh{set_, update, s, n, ekfs});
    } else {
      tile.run(typename Particle::WeighChosen{set_, update, s, n, chosen, ekfs});
    }
    tile.run(typename Particle::Correct{set_, n, ekfs});
  }

  template <int Count>
  AUVEST_INLINE void correct_master(const Tile& tile, const Update& update, int s, int n,
                                    const Value (*chosen)[Masters], Models<Count>) {
    tile.run(typename Particle::CorrectModels{set_, update, s, n, chosen});
  }

  // Births of masters are ours, not the paper's.

  bool births() const { return params_.birth_velocity_m_s > Scalar(0) && masters_ < Masters; }

  /// True if most of the weight finds echo s beyond the gate of every master.
  AUVEST_OUTLINE bool is_unassociated(const Update& update, int s) {
    using math::select;
    OrderedSum<Lanes> beyond;
    Schedule::for_each_group(set_, [&](int i) {
      const Single particle = {set_, i};
      typename Single::Pose pose;
      particle.load(pose);
      Value weight = weight_of(Lanes::load(set_.log_weights() + i));
      for (int n = 0; n < masters_; ++n) {
        const Value nis = Particle::score_echo(particle, pose, update, s, n).nis;
        weight = select(nis > Value(update.limit()), weight, Value(0));
      }
      beyond.add(i, weight);
    });
    return beyond.total() > Scalar(0.5);
  }

  /// A new master where each particle hears echo s come from.
  AUVEST_OUTLINE void add_master(const Update& update, int s) {
    const Scalar velocity = params_.birth_velocity_m_s * params_.birth_velocity_m_s;
    const Scalar acceleration = params_.birth_acceleration_m_s2 * params_.birth_acceleration_m_s2;
    Schedule::for_each_group(set_, [&](int i) {
      const Single particle = {set_, i};
      typename Single::Pose pose;
      particle.load(pose);
      Belief<Value, 6> master;
      give_birth(update.sonar, update.echoes[s].z, pose, Proposal::kInformed, velocity,
                 acceleration, master);
      Particle::Bank::begin(master_, master, particle.master(masters_));
    });
    safeguards_.begin(masters_);
    ++masters_;
  }

  Motion motion_;
  Master master_;
  Params params_;
  MonteCarloError<Scalar, kPose, Safeguards_::kActive> error_;
};

template <class Motion, class Master, int Masters, class Resampling = SystematicResampling,
          class Lanes = OneLane<typename Motion::Scalar>,
          class Safeguards_ = Safeguards<typename Motion::Scalar, Masters>>
using Slatf1 = Slatf<Motion, Master, MotionProposal, Masters, Resampling, Lanes, Safeguards_>;

template <class Motion, class Master, int Masters, class Resampling = SystematicResampling,
          class Lanes = OneLane<typename Motion::Scalar>,
          class Safeguards_ = Safeguards<typename Motion::Scalar, Masters>>
using Slatf2 = Slatf<Motion, Master, MeasurementProposal, Masters, Resampling, Lanes, Safeguards_>;

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
