// SLATF: simultaneous localisation and tracking on the FastSLAM framework (Lu, Chen, Liu, Ma, He
// 2020). A slave vehicle that can only dead-reckon sees masters with its own sonar and treats each
// as a moving landmark: a particle is a pose of the slave and, given that pose's past, one Kalman
// filter per master, Eqs. (9) and (34).
//
//     filter.reset(pose, particles, random);       // communication breaks: draw from the prior
//     filter.add_master(belief);
//     filter.predict(dt, reading, random);         // at the rate of the odometry
//     filter.update(sightings, 1, sonar, random);  // at the rate of the sonar
//     filter.slave(), filter.master(0)             // Gaussian summaries
//
// Slatf1 samples poses from the motion, Slatf2 from motion and measurement (proposals.hpp); all
// else is one code. All steps are kernels over one group of particles (lanes.hpp). The update of a
// master is that of the Kalman filters (square_root_update.hpp), so with one particle and no noise
// of the slave SLATF is the EKF of the master, to the bit.
//
// What the paper leaves open or misprints, and what is done here: docs/algorithms/slatf.md.
#pragma once

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/counter_random.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/twin.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/mixture.hpp"
#include "auvest/particles/particle_set.hpp"
#include "auvest/particles/resampling.hpp"
#include "auvest/slat/association.hpp"
#include "auvest/slat/master_bank.hpp"
#include "auvest/slat/proposals.hpp"
#include "auvest/slat/sighting.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

template <class Scalar>
struct SlatfParams {
  Scalar resample_below = Scalar(0.5);  ///< resample where N_eff < this times N, Eq. (33)
  bool carry_covariance = false;        ///< 2.0 only: Eq. (50) to the letter, see proposals.hpp
  /// An echo whose NIS (2 degrees of freedom) exceeds this in a particle says nothing to it;
  /// against outliers. 16 loses one good echo in 3,000. 0: no gate, the paper.
  Scalar gate = Scalar(0);
  /// Standard deviations of the velocity [m/s] and the acceleration [m/s^2] of a master that is
  /// born from an echo of kUnknownMaster: where particles with more than half of the weight find
  /// the echo beyond the gate of every master. 0: no births. Needs a gate.
  Scalar birth_velocity_m_s = Scalar(0);
  Scalar birth_acceleration_m_s2 = Scalar(0.01);
};

template <class Motion_, class Master_, class Proposal_, int Masters,
          class Resampling_ = SystematicResampling,
          class Lanes_ = OneLane<typename Motion_::Scalar>>
class Slatf {
 public:
  using Motion = Motion_;
  using Master = Master_;
  using Proposal = Proposal_;
  using Resampling = Resampling_;
  using Lanes = Lanes_;
  using Scalar = typename Motion::Scalar;
  using Control = typename Motion::Control;
  using Params = SlatfParams<Scalar>;
  static constexpr int kPose = Motion::kStates;
  static constexpr int kMasters = Masters;
  using SlaveBelief = Belief<Scalar, kPose>;
  using MasterBelief = Belief<Scalar, 6>;
  using VelocityChange = Vector<Scalar, 2>;

  // The fields of a particle: pose, its covariance (2.0), and the masters (master_bank.hpp).
  static constexpr int kPoseField = 0;
  static constexpr int kPoseNumbers = kPose + (Proposal::kInformed ? triangle_numbers(kPose) : 0);
  static constexpr int kMasterField = kPoseField + kPoseNumbers;
  using Bank = MasterBank<Master, Lanes>;
  static constexpr int kMasterNumbers = Bank::kNumbers;
  using Set = ParticleSet<Scalar, kMasterField + Masters * kMasterNumbers>;
  template <int Capacity>
  using Storage = ParticleStorage<Scalar, Set::kFields, Capacity>;

  /// The particles live in `storage`, which holds at least Set::storage_size(capacity) numbers and
  /// must outlive the filter.
  Slatf(const Motion& motion, const Master& master, const Params& params, Scalar* storage,
        int capacity, const Resampling& resampling = Resampling())
      : motion_(motion),
        master_(master),
        params_(params),
        set_(storage, capacity),
        resampling_(resampling) {}

  template <int Capacity>
  Slatf(const Motion& motion, const Master& master, const Params& params,
        ParticleStorage<Scalar, Set::kFields, Capacity>& storage,
        const Resampling& resampling = Resampling())
      : Slatf(motion, master, params, storage.numbers, Capacity, resampling) {}

  /// A copy of `other` that goes on with the copy of its particles that lies in `storage`.
  Slatf(const Slatf& other, Scalar* storage) : Slatf(other) { set_ = Set(storage, other.set_); }

  /// Draws the poses of `particles` particles from N(pose.x, pose.P); there is no master yet. P may
  /// be singular or zero.
  Status reset(const SlaveBelief& pose, int particles, math::Random& random) {
    const bool valid =
        particles > 0 && particles <= set_.capacity() && !(params_.resample_below < Scalar(0)) &&
        !(params_.gate < Scalar(0)) && !(params_.birth_velocity_m_s < Scalar(0)) &&
        params_.birth_acceleration_m_s2 > Scalar(0) && (params_.gate > Scalar(0) || !births()) &&
        !(params_.resample_below > Scalar(1));
    if (!valid || motion_.check() != Status::kOk || master_.check() != Status::kOk) {
      return Status::kBadParameter;
    }
    if (!math::all_finite(pose.x) || !math::lower_finite(pose.P)) return Status::kNotFinite;
    for (int i = 0; i < kPose; ++i) {
      if (pose.P(i, i) < Scalar(0)) return Status::kNotPositiveDefinite;
    }
    set_.resize(particles);
    masters_ = 0;
    resamplings_ = 0;
    log_likelihood_ = Scalar(0);
    effective_size_ = Scalar(particles);
    equal_weights(set_);

    Matrix<Scalar, kPose, kPose> root;
    Matrix<Scalar, 1, kPose> no_others;
    math::factor_leading<math::DropLostPivots>(pose.P, root, no_others);
    const math::CounterKey key(random);
    for_each([&](int i) {
      Belief<Value, kPose> drawn;
      Matrix<Value, kPose, kPose> spread;
      math::set_zero(drawn.P);
      for (int k = 0; k < kPose; ++k) {
        drawn.x(k) = Value(pose.x(k));
        for (int l = 0; l < kPose; ++l) spread(k, l) = Value(root(k, l));
      }
      Value e[kPose + 1];
      deviates<Lanes>(key, i, e);
      scatter(spread, e, drawn.x);
      store_pose(i, drawn);
    });
    return Status::kOk;
  }

  /// With as many particles as the storage holds.
  Status reset(const SlaveBelief& pose, math::Random& random) {
    return reset(pose, set_.capacity(), random);
  }

  /// One more master, with the same belief in all particles. Masters are numbered from 0.
  Status add_master(const MasterBelief& belief) {
    if (set_.size() == 0) return Status::kNotInitialised;
    if (masters_ == Masters) return Status::kBadParameter;
    if (!math::all_finite(belief.x) || !math::lower_finite(belief.P)) return Status::kNotFinite;
    if (!math::is_positive_definite(belief.P)) return Status::kNotPositiveDefinite;
    Belief<Value, 6> copy;
    for (int k = 0; k < 6; ++k) {
      copy.x(k) = Value(belief.x(k));
      for (int l = 0; l <= k; ++l) copy.P(k, l) = Value(belief.P(k, l));
    }
    for_each([&](int i) { Bank::begin(master_, copy, master_at(i, masters_)); });
    ++masters_;
    return Status::kOk;
  }

  /// Carries all particles dt >= 0 seconds forward, during which the slave's reading `u` holds.
  /// `changes`: the velocity changes [m/s] that the masters planned for these seconds, one per
  /// master; null: none. Takes one key of random numbers.
  Status predict(Scalar dt, const Control& u, math::Random& random,
                 const VelocityChange* changes = nullptr) {
    const Status status = check(dt, u, changes);
    if (status != Status::kOk) return status;
    const Move move(motion_.step(u, dt), dt, changes, random);
    for_each_tile([&](int begin, int end) { advance(begin, end, move); });
    return Status::kOk;
  }

  /// Takes in what the sonar heard at one time: any number of masters, each at most once. Masters
  /// that were not heard keep all their bits, Eq. (34). An echo of kUnknownMaster is, in each
  /// particle, that of the master to which it is likeliest (nearest neighbour). Takes one key of
  /// random numbers, then what the resampling policy takes.
  Status update(const Sighting<Scalar>* sightings, int count, const Sonar<Scalar>& sonar,
                math::Random& random) {
    const Status status = check(sightings, count, sonar);
    if (status != Status::kOk || count == 0) return status;
    Echoes echoes(sightings, count, sonar, random);
    Sighting<Scalar> old[Masters];  // what is left after births
    if (births()) {
      int left = 0;
      for (int s = 0; s < count; ++s) {
        if (births() && sightings[s].master == kUnknownMaster && is_lonely(echoes, s)) {
          add_master(echoes, s);
        } else {
          old[left++] = sightings[s];
        }
      }
      echoes.sightings = old;
      echoes.count = left;
      if (left == 0) return Status::kOk;
    }
    for_each_tile([&](int begin, int end) { take_in(begin, end, echoes); });
    conclude(echoes.count, random);
    return Status::kOk;
  }

  /// predict() and update() in one pass over the particles: the same bits, half the memory traffic.
  Status step(Scalar dt, const Control& u, const VelocityChange* changes,
              const Sighting<Scalar>* sightings, int count, const Sonar<Scalar>& sonar,
              math::Random& random) {
    Status status = check(dt, u, changes);
    if (status == Status::kOk) status = check(sightings, count, sonar);
    if (status != Status::kOk) return status;
    if (count == 0 || births()) {
      predict(dt, u, random, changes);
      return update(sightings, count, sonar, random);
    }
    const Move move(motion_.step(u, dt), dt, changes, random);
    const Echoes echoes(sightings, count, sonar, random);
    for_each_tile([&](int begin, int end) {
      advance(begin, end, move);
      take_in(begin, end, echoes);
    });
    conclude(count, random);
    return Status::kOk;
  }

  /// Mean and covariance of the slave's pose; the heading's mean is that of unit vectors.
  SlaveBelief slave() const {
    return summarise<Lanes, kPose, Proposal::kInformed, (kPose > 2)>(set_, kPoseField);
  }

  /// Mean and covariance of master n.
  MasterBelief master(int n) const {
    return summarise<Lanes, 6, true, false>(set_, master_field(n));
  }

  /// With an Imm as Master: the probability that its model k moves master n.
  Scalar mode_probability(int n, int k) const {
    Scalar mean[1];
    weighted_means<Lanes>(
        set_, [&](int i, Value(&q)[1]) { q[0] = Bank::probability(master_at(i, n), k); }, mean);
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
    constexpr int kAhead = 16;  // blocks, read so sparsely that no cache foresees it
    int fields[kNumbers];
    Scalar origin[kNumbers];
    for (int k = 0; k < 2; ++k) {
      fields[k] = kPoseField + k;
      for (int n = 0; n < Masters; ++n) fields[2 + 2 * n + k] = master_field(n) + k;
    }
    for (int k = 0; k < kNumbers; ++k) origin[k] = *set_.at(0, fields[k]);
    Scalar mean[kNumbers];
    weighted_means<Lanes>(
        set_,
        [&](int i, Value(&q)[kNumbers]) {
          for (int k = 0; k < kNumbers; ++k) {
            const Scalar* number = set_.at(i, fields[k]);
            q[k] = Lanes::load(number) - Value(origin[k]);
            Lanes::prefetch(number + kAhead * Set::kFields * kBlock);
          }
        },
        mean);
    Positions result;
    for (int k = 0; k < 2; ++k) {
      result.slave(k) = origin[k] + mean[k];
      for (int n = 0; n < Masters; ++n) {
        result.masters[n](k) = origin[2 + 2 * n + k] + mean[2 + 2 * n + k];
      }
    }
    return result;
  }

  int particles() const { return set_.size(); }
  int masters() const { return masters_; }
  Scalar effective_size() const { return effective_size_; }  ///< N_eff before any resampling
  int resamplings() const { return resamplings_; }           ///< since reset
  Scalar log_likelihood() const { return log_likelihood_; }  ///< of all sightings since reset
  const Set& set() const { return set_; }

 private:
  using Value = typename Lanes::Value;

  // A step of the filter is a long chain of roots and quotients that wait for each other. So it is
  // taken in parts, each for all groups of a tile in turn, and the parts that wait take two groups
  // side by side: the processor has something to do, and the tile stays in the cache.
  static constexpr int kTileGroups = Lanes::kPairs ? 4 : 1;
  static constexpr int kTile = kTileGroups * Lanes::kWidth;
  static constexpr int kNearParticles =  // fit into a first-level cache
      32768 / static_cast<int>(sizeof(Scalar) * (1 + Set::kFields));

  /// One group of particles, or two that lie behind each other.
  struct Single {
    using Fields = Lanes;
    using Weights = Lanes;
    static constexpr int kParticles = Lanes::kWidth;
  };
  struct Pair {
    using Weights = typename Lanes::template Pair<Lanes::kWidth>;
    using Fields = typename Lanes::template Pair<(Lanes::kWidth < kBlock) ? Lanes::kWidth
                                                                          : Set::kFields * kBlock>;
    static constexpr int kParticles = 2 * Lanes::kWidth;
  };

  template <class Kernel>
  AUVEST_INLINE void for_each_tile(const Kernel& kernel) const {
    for (int begin = 0; begin < set_.size(); begin += kTile) {
      kernel(begin, begin + kTile < set_.size() ? begin + kTile : set_.size());
    }
  }

  /// True if at i a pair of groups begins that ends before the particle `end`.
  static AUVEST_INLINE bool is_pair(int i, int end) {
    return Lanes::kPairs && i + Lanes::kWidth < end;
  }

  /// Asks for one third of the fields of the block that lies one tile ahead of group i, for a pair
  /// of both blocks. Thirds, between the kernels, so that the way to the cache is never full.
  template <class Group, int Third>
  AUVEST_INLINE void foresee(int i) const {
    if (!Lanes::kPairs || set_.size() <= kNearParticles) return;
    for (int k = i; k < i + Group::kParticles; k += Lanes::kWidth) {
      if (place_in_block(k) != 0 || k + kTile >= set_.size()) continue;
      constexpr int kFirst = Set::kFields * Third / 3;
      constexpr int kCount = Set::kFields * (Third + 1) / 3 - kFirst;
      const Scalar* at = set_.at(k + kTile, kFirst);
      AUVEST_UNROLL
      for (int f = 0; f < kCount; ++f) Lanes::prefetch(at + f * kBlock);
    }
  }

  template <class Kernel>
  AUVEST_INLINE void for_each(const Kernel& kernel) const {
    for (int i = 0; i < set_.size(); i += Lanes::kWidth) kernel(i);
  }

  /// Without a gate, one that no NIS of check_sightings() reaches.
  Scalar gate() const { return params_.gate > Scalar(0) ? params_.gate : Scalar(1e35); }

  static int master_field(int n) { return kMasterField + n * kMasterNumbers; }

  template <class Fields = Lanes>
  AUVEST_INLINE void load_pose(int i, Belief<typename Fields::Value, kPose>& pose) const {
    if (Proposal::kInformed) {
      load_belief<Fields>(set_.at(i, kPoseField), pose);
    } else {
      load_mean<Fields>(set_.at(i, kPoseField), pose.x);
    }
  }

  template <class Fields = Lanes>
  AUVEST_INLINE void store_pose(int i, const Belief<typename Fields::Value, kPose>& pose) const {
    if (Proposal::kInformed) {
      store_belief<Fields>(set_.at(i, kPoseField), pose);
    } else {
      store_mean<Fields>(set_.at(i, kPoseField), pose.x);
    }
  }

  AUVEST_INLINE Scalar* master_at(int i, int n) const { return set_.at(i, master_field(n)); }

  template <class Fields = Lanes>
  AUVEST_INLINE void load_master(int i, int n, Belief<typename Fields::Value, 6>& master) const {
    load_belief<Fields>(set_.at(i, master_field(n)), master);
  }

  AUVEST_INLINE void store_master(int i, int n, const Belief<Value, 6>& master) const {
    store_belief<Lanes>(set_.at(i, master_field(n)), master);
  }

  /// Multiplies the weights from particle i on.
  template <class Weights = Lanes>
  AUVEST_INLINE void multiply_weight(int i, const typename Weights::Value& log_factor) const {
    Scalar* at = set_.log_weights() + i;
    Weights::store(at, Weights::load(at) + log_factor);
  }

  /// e ~ N(0, I); the last is left over where the pose is odd.
  template <class Fields, class V>
  static AUVEST_INLINE void deviates(const math::CounterKey& key, int i, V (&e)[kPose + 1]) {
    for (int k = 0; k < kPose; k += 2) {
      math::counter_normal_pair(key, Fields::index(i), static_cast<uint32_t>(k / 2), e[k],
                                e[k + 1]);
    }
  }

  /// x <- x + root e.
  template <class V>
  static AUVEST_INLINE void scatter(const Matrix<V, kPose, kPose>& root, const V (&e)[kPose + 1],
                                    Vector<V, kPose>& x) {
    AUVEST_UNROLL
    for (int k = 0; k < kPose; ++k) {
      V sum = root(k, 0) * e[0];
      AUVEST_UNROLL
      for (int l = 1; l < kPose; ++l) sum = sum + root(k, l) * e[l];
      x(k) = x(k) + sum;
    }
  }

  /// What a prediction is, for all particles.
  struct Move {
    typename Motion::Step step;
    Scalar dt;
    const VelocityChange* changes;
    math::CounterKey key;

    Move(const typename Motion::Step& motion, Scalar seconds, const VelocityChange* planned,
         math::Random& random)
        : step(motion), dt(seconds), changes(planned), key(random) {}
  };

  /// What an update is, for all particles.
  struct Echoes {
    const Sighting<Scalar>* sightings;
    int count;
    const Sonar<Scalar>& sonar;
    math::CounterKey key;

    Echoes(const Sighting<Scalar>* heard, int number, const Sonar<Scalar>& device,
           math::Random& random)
        : sightings(heard), count(number), sonar(device), key(random) {}

    bool all_known() const {
      for (int s = 0; s < count; ++s) {
        if (sightings[s].master == kUnknownMaster) return false;
      }
      return true;
    }
  };

  Status check(Scalar dt, const Control& u, const VelocityChange* changes) const {
    if (set_.size() == 0) return Status::kNotInitialised;
    if (!math::is_finite(dt) || !math::all_finite(u)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    return plan_finite(changes, masters_) ? Status::kOk : Status::kNotFinite;
  }

  /// With births, as many echoes as there may be masters.
  Status check(const Sighting<Scalar>* sightings, int count, const Sonar<Scalar>& sonar) const {
    if (set_.size() == 0) return Status::kNotInitialised;
    return check_sightings(sightings, count, births() ? Masters : masters_, sonar, kPose, false);
  }

  bool births() const { return params_.birth_velocity_m_s > Scalar(0) && masters_ < Masters; }

  AUVEST_INLINE void advance(int begin, int end, const Move& move) const {
    int i = begin;
    for (; is_pair(i, end); i += 2 * Lanes::kWidth) advance_pose<Pair>(i, move);
    for (; i < end; i += Lanes::kWidth) advance_pose<Single>(i, move);
    for (i = begin; i < end; i += Lanes::kWidth) advance_masters(i, move);
  }

  template <class Group>
  void advance_pose(int i, const Move& move) const {
    using Fields = typename Group::Fields;
    using V = typename Fields::Value;
    foresee<Group, 0>(i);
    Belief<V, kPose> pose;
    load_pose<Fields>(i, pose);
    V a(0);
    V b(0);
    if (!Proposal::kInformed) math::counter_normal_pair(move.key, Fields::index(i), 0u, a, b);
    Proposal::predict(motion_, move.step, a, b, pose);
    store_pose<Fields>(i, pose);
  }

  void advance_masters(int i, const Move& move) const {
    for (int n = 0; n < masters_; ++n) {
      const VelocityChange* change = move.changes != nullptr ? move.changes + n : nullptr;
      Bank::predict(master_, move.dt, change, master_at(i, n));
    }
  }

  template <class V>
  using View = typename Sonar<Scalar>::template View<V, kPose>;

  template <class Fields = Lanes>
  AUVEST_INLINE Place<typename Fields::Value> place(int i, int n) const {
    return load_place<Fields>(set_.at(i, master_field(n)));
  }

  AUVEST_INLINE Score<Value> score_master(int i, int n, const Belief<Value, kPose>& pose,
                                          const Echoes& echoes, int s) const {
    return score(echoes.sonar, echoes.sightings[s].z, place(i, n), pose, Proposal::kInformed);
  }

  /// The number of the master that is likeliest to have sent sighting s, of those that no other
  /// sighting has in this particle.
  AUVEST_INLINE Value nearest(int i, const Belief<Value, kPose>& pose, const Echoes& echoes, int s,
                              const Value* chosen) const {
    using math::select;
    Value best = Value(no_log_weight<Scalar>());
    Value who = Value(Scalar(-1));
    for (int n = 0; n < masters_; ++n) {
      const Value density = score_master(i, n, pose, echoes, s).log_density;
      math::Mask<Value> better = density > best;
      for (int other = 0; other < echoes.count; ++other) {
        better = better && !is_master(chosen[other], n);
      }
      best = select(better, density, best);
      who = select(better, Value(n), who);
    }
    return who;
  }

  /// What an echo says of a master in a group of particles.
  template <class V>
  struct Verdict {
    Matrix<V, 2, 2> root;   ///< of the covariance of the master's position
    Matrix<V, 4, 2> slope;  ///< of the other states on the position
    Posterior<V, 2> posterior;
    math::Mask<V> valid;
  };

  /// All that the echoes do to a tile: association, proposal and draw (2.0), weight, masters.
  AUVEST_INLINE void take_in(int begin, int end, const Echoes& echoes) const {
    Value chosen[kTileGroups][Masters];
    const bool all_known = echoes.all_known();
    int i = begin;
    if (!all_known) {
      for (; i < end; i += Lanes::kWidth) adjust_pose(i, echoes, chosen[group(begin, i)]);
    } else if (Proposal::kInformed) {
      for (; is_pair(i, end); i += 2 * Lanes::kWidth) propose<Pair>(i, echoes);
      for (; i < end; i += Lanes::kWidth) propose<Single>(i, echoes);
    }
    for (int s = 0; s < echoes.count; ++s) {
      const int known = echoes.sightings[s].master;
      if (known != kUnknownMaster) {
        take_in(begin, end, known, echoes, s, nullptr);
      } else {
        for (int n = 0; n < masters_; ++n) take_in(begin, end, n, echoes, s, chosen);
      }
    }
  }

  /// Sighting s as an echo of master n; where it is not known whose it is, in those particles that
  /// have chosen n.
  AUVEST_INLINE void take_in(int begin, int end, int n, const Echoes& echoes, int s,
                             const Value (*chosen)[Masters]) const {
    int i = begin;
    if (Bank::kModes > 1) {
      for (; i < end; i += Lanes::kWidth) {
        math::Mask<Value> mine = math::Mask<Value>();
        if (chosen != nullptr) mine = is_master(chosen[group(begin, i)][s], n);
        correct_models(i, n, echoes, s, chosen != nullptr ? &mine : nullptr);
      }
      return;
    }
    Verdict<Value> verdicts[kTileGroups];
    if (chosen == nullptr) {
      for (; is_pair(i, end); i += 2 * Lanes::kWidth) {
        weigh_known<Pair>(i, n, echoes, s, &verdicts[group(begin, i)]);
      }
      for (; i < end; i += Lanes::kWidth) {
        weigh_known<Single>(i, n, echoes, s, &verdicts[group(begin, i)]);
      }
    } else {
      for (; i < end; i += Lanes::kWidth) {
        const int g = group(begin, i);
        weigh_chosen(i, n, echoes, s, is_master(chosen[g][s], n), verdicts[g]);
      }
    }
    for (i = begin; i < end; i += Lanes::kWidth) correct(i, n, verdicts[group(begin, i)]);
  }

  static AUVEST_INLINE int group(int begin, int i) { return (i - begin) / Lanes::kWidth; }

  /// 2.0 where the masters of all echoes are known: proposal, weight and draw.
  template <class Group>
  void propose(int i, const Echoes& echoes) const {
    using Fields = typename Group::Fields;
    using V = typename Fields::Value;
    Belief<V, kPose> pose;
    V e[kPose + 1];  // first: while the rest waits for roots and quotients
    deviates<Fields>(echoes.key, i, e);
    load_pose<Fields>(i, pose);
    V log_weight(0);
    Matrix<V, kPose, kPose> root;
    math::set_zero(root);
    for (int s = 0; s < echoes.count; ++s) {
      const Place<V> source = place<Fields>(i, echoes.sightings[s].master);
      View<V> view;
      echoes.sonar.look(pose.x, source.x(0), source.x(1), echoes.sightings[s].z, view);  // Eq. (51)
      log_weight = log_weight + MeasurementProposal::refine(view, echoes.sonar.template R<V>(),
                                                            source.root, V(gate()), pose, root);
    }
    multiply_weight<typename Group::Weights>(i, log_weight);
    draw_pose<Fields>(i, root, e, pose);
  }

  template <class Fields, class V>
  AUVEST_INLINE void draw_pose(int i, const Matrix<V, kPose, kPose>& root, const V (&e)[kPose + 1],
                               Belief<V, kPose>& pose) const {
    scatter(root, e, pose.x);
    if (!params_.carry_covariance) math::set_zero(pose.P);
    store_pose<Fields>(i, pose);
  }

  /// Finds out whose each echo is; for 2.0 what propose() does.
  void adjust_pose(int i, const Echoes& echoes, Value (&chosen)[Masters]) const {
    using math::select;
    Belief<Value, kPose> pose;
    load_pose(i, pose);
    Value log_weight(0);
    for (int s = 0; s < echoes.count; ++s) chosen[s] = Value(Scalar(echoes.sightings[s].master));
    Matrix<Value, kPose, kPose> root;
    math::set_zero(root);
    for (int s = 0; s < echoes.count; ++s) {
      const int known = echoes.sightings[s].master;
      if (known == kUnknownMaster) chosen[s] = nearest(i, pose, echoes, s, chosen);
      if (!Proposal::kInformed) continue;
      Place<Value> source = place(i, known == kUnknownMaster ? 0 : known);
      for (int n = 1; known == kUnknownMaster && n < masters_; ++n) {
        const Place<Value> other = place(i, n);
        const math::Mask<Value> mine = is_master(chosen[s], n);
        math::copy_where(mine, other.x, source.x);
        math::copy_where(mine, other.root, source.root);
      }
      // With more echoes than masters an echo may have none: it says nothing.
      const math::Mask<Value> any = chosen[s] > Value(-0.5);
      const Value limit = select(any, Value(gate()), Value(0));
      View<Value> view;
      echoes.sonar.look(pose.x, source.x(0), source.x(1), echoes.sightings[s].z, view);
      const Value density = MeasurementProposal::refine(view, echoes.sonar.template R<Value>(),
                                                        source.root, limit, pose, root);
      log_weight = log_weight + select(any, density, Value(0));
    }
    if (!Proposal::kInformed) return;
    multiply_weight(i, log_weight);
    Value e[kPose + 1];
    deviates<Lanes>(echoes.key, i, e);
    draw_pose<Lanes>(i, root, e, pose);
  }

  /// The regression of master n on its position.
  template <class Fields, class V>
  AUVEST_INLINE void regress(int i, int n, Verdict<V>& verdict) const {
    Matrix<V, 6, 6> p;
    load_covariance<Fields>(master_at(i, n) + 6 * kBlock, p);
    verdict.valid = math::factor_leading(p, verdict.root, verdict.slope);
  }

  /// Sighting s as an echo of master n, Eqs. (18) to (24), after regress(). Returns for 1.0 the
  /// logarithm of the density, Eqs. (30) and (31), and 0 for 2.0, which has weighed already.
  template <class Fields, class V>
  AUVEST_INLINE V weigh(int i, int n, const Echoes& echoes, int s, Verdict<V>& verdict) const {
    Vector<V, kPose> pose;
    Vector<V, 2> master;
    load_mean<Fields>(set_.at(i, kPoseField), pose);
    load_mean<Fields>(master_at(i, n), master);
    View<V> view;
    echoes.sonar.look(pose, master(0), master(1), echoes.sightings[s].z, view);
    Matrix<V, 2, 2> a;
    project(view.by_master, verdict.root, a);
    Matrix<V, 2, 2> noise = echoes.sonar.template R<V>();
    const math::Mask<V> finite =
        potter<!math::is_number<V>()>(a, noise, view.innovation, verdict.posterior);
    verdict.valid = finite && verdict.valid;
    if (params_.gate > Scalar(0)) saturate(V(gate()), verdict.posterior);
    return Proposal::kInformed ? V(0) : log_density(verdict.valid, verdict.posterior, noise);
  }

  /// Weighs one group, or two, by an echo of master n; writes a verdict for each.
  template <class Group>
  void weigh_known(int i, int n, const Echoes& echoes, int s, Verdict<Value>* verdicts) const {
    using Fields = typename Group::Fields;
    foresee<Group, 1>(i);
    Verdict<typename Fields::Value> both;
    Verdict<typename Fields::Value>& verdict = draft(both, verdicts);
    regress<Fields>(i, n, verdict);
    hand_out_regression(verdict, verdicts);
    const typename Fields::Value density = weigh<Fields>(i, n, echoes, s, verdict);
    if (!Proposal::kInformed) multiply_weight<typename Group::Weights>(i, density);
    hand_out_posterior(verdict, verdicts);
  }

  /// Weighs those particles of a group for which it is an echo of master n.
  void weigh_chosen(int i, int n, const Echoes& echoes, int s, const math::Mask<Value>& mine,
                    Verdict<Value>& verdict) const {
    using math::select;
    regress<Lanes>(i, n, verdict);
    const Value density = weigh<Lanes>(i, n, echoes, s, verdict);
    multiply_weight(i, select(mine, density, Value(0)));
    verdict.valid = verdict.valid && mine;
  }

  // A verdict is written where it belongs; one of two groups is handed out, each half as soon as it
  // is known, so that it takes no registers then.
  using Verdicts = Verdict<math::Twin<Value>>;
  static AUVEST_INLINE Verdict<Value>& draft(Verdict<Value>&, Verdict<Value>* to) { return *to; }
  static AUVEST_INLINE Verdicts& draft(Verdicts& both, Verdict<Value>*) { return both; }
  static AUVEST_INLINE void hand_out_regression(const Verdict<Value>&, Verdict<Value>*) {}
  static AUVEST_INLINE void hand_out_regression(const Verdicts& from, Verdict<Value>* to) {
    math::split(from.root, to[0].root, to[1].root);
    math::split(from.slope, to[0].slope, to[1].slope);
  }
  static AUVEST_INLINE void hand_out_posterior(const Verdict<Value>&, Verdict<Value>*) {}
  static AUVEST_INLINE void hand_out_posterior(const Verdicts& from, Verdict<Value>* to) {
    math::split(from.posterior.y, to[0].posterior.y, to[1].posterior.y);
    math::split(from.posterior.g, to[0].posterior.g, to[1].posterior.g);
    to[0].valid = from.valid.a;
    to[1].valid = from.valid.b;
  }

  /// The EKF of master n follows the verdict, Eqs. (25) and (26).
  void correct(int i, int n, Verdict<Value>& verdict) const {
    using math::all;
    using math::select;
    foresee<Single, 2>(i);
    Belief<Value, 6> master;
    load_master(i, n, master);
    const math::Mask<Value> finite =
        move_belief(master, verdict.root, verdict.slope, verdict.posterior);
    const math::Mask<Value> moved = finite && verdict.valid;
    store_belief_where<Lanes>(moved, master_at(i, n), master);
    if (Proposal::kInformed || all(moved)) return;
    const math::Mask<Value> lost = verdict.valid && !finite;  // weighs nothing
    multiply_weight(i, select(lost, Value(-1e20), Value(0)));
  }

  /// The update of master n where it has several models: all at once, as their probabilities follow
  /// from the densities. In the lanes of `only` (null: all).
  void correct_models(int i, int n, const Echoes& echoes, int s,
                      const math::Mask<Value>* only) const {
    using math::select;
    Belief<Value, kPose> pose;
    load_pose<Lanes>(i, pose);
    const MasterEkf ekf = {*this, pose, echoes, s};
    const Value density = Bank::correct(ekf, only, master_at(i, n));
    if (Proposal::kInformed) return;
    multiply_weight(i, only == nullptr ? density : select(*only, density, Value(0)));
  }

  /// Eqs. (18) to (26) for sighting s.
  struct MasterEkf {
    const Slatf& slatf;
    const Belief<Value, kPose>& pose;
    const Echoes& echoes;
    int s;

    AUVEST_INLINE Echo<Value> operator()(Belief<Value, 6>& master) const {
      View<Value> view;
      echoes.sonar.look(pose.x, master.x(0), master.x(1), echoes.sightings[s].z, view);
      Matrix<Value, 2, 2> root;
      Matrix<Value, 4, 2> slope;
      const math::Mask<Value> definite = math::factor_leading(master.P, root, slope);
      Matrix<Value, 2, 2> a;
      project(view.by_master, root, a);
      Matrix<Value, 2, 2> noise = echoes.sonar.template R<Value>();
      Posterior<Value, 2> posterior;
      Echo<Value> echo;
      echo.valid = potter<!math::is_number<Value>()>(a, noise, view.innovation, posterior);
      echo.valid = echo.valid && definite;
      if (slatf.params_.gate > Scalar(0)) saturate(Value(slatf.gate()), posterior);
      echo.valid = echo.valid && move_belief(master, root, slope, posterior);
      echo.log_density = log_density(echo.valid, posterior, noise);
      return echo;
    }
  };

  /// True if most of the weight finds sighting s beyond the gate of every master.
  bool is_lonely(const Echoes& echoes, int s) const {
    using math::select;
    OrderedSum<Lanes> lonely;
    for_each([&](int i) {
      Belief<Value, kPose> pose;
      load_pose(i, pose);
      Value weight = weight_of(Lanes::load(set_.log_weights() + i));
      for (int n = 0; n < masters_; ++n) {
        const Value nis = score_master(i, n, pose, echoes, s).nis;
        weight = select(nis > Value(gate()), weight, Value(0));
      }
      lonely.add(i, weight);
    });
    return lonely.total() > Scalar(0.5);
  }

  /// A new master where each particle hears sighting s come from.
  void add_master(const Echoes& echoes, int s) {
    const Scalar velocity = params_.birth_velocity_m_s * params_.birth_velocity_m_s;
    const Scalar acceleration = params_.birth_acceleration_m_s2 * params_.birth_acceleration_m_s2;
    for_each([&](int i) {
      Belief<Value, kPose> pose;
      load_pose(i, pose);
      Belief<Value, 6> master;
      give_birth(echoes.sonar, echoes.sightings[s].z, pose, Proposal::kInformed, velocity,
                 acceleration, master);
      Bank::begin(master_, master, master_at(i, masters_));
    });
    ++masters_;
  }

  /// Normalises, and resamples where few particles are left.
  AUVEST_OUTLINE void conclude(int count, math::Random& random) {
    const WeightSummary<Scalar> summary = normalise<Lanes>(set_);
    effective_size_ = summary.effective_size;
    log_likelihood_ =
        log_likelihood_ + (summary.log_sum - Scalar(count) * Scalar(1.8378770664));  // log(2 pi)
    if (effective_size_ < params_.resample_below * Scalar(set_.size())) {
      resample<Lanes>(resampling_, set_, random);
      ++resamplings_;
    }
  }

  Motion motion_;
  Master master_;
  Params params_;
  Set set_;
  Resampling resampling_;
  int masters_ = 0;
  int resamplings_ = 0;
  Scalar log_likelihood_ = Scalar(0);
  Scalar effective_size_ = Scalar(0);

 public:
  /// Hands all numbers of the state to `visit`, which keeps them, or overwrites them by those that
  /// were kept: to save a filter and to go on from there. `Self` is this class, const to save.
  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    visit(self.set_);
    visit(self.log_likelihood_);
    visit(self.effective_size_);
    visit.count(self.masters_, Masters);
    visit.count(self.resamplings_);
  }
};

template <class Motion, class Master, int Masters, class Resampling = SystematicResampling,
          class Lanes = OneLane<typename Motion::Scalar>>
using Slatf1 = Slatf<Motion, Master, MotionProposal, Masters, Resampling, Lanes>;

template <class Motion, class Master, int Masters, class Resampling = SystematicResampling,
          class Lanes = OneLane<typename Motion::Scalar>>
using Slatf2 = Slatf<Motion, Master, MeasurementProposal, Masters, Resampling, Lanes>;

}  // namespace auvest
