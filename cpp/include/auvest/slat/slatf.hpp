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
#include "auvest/math/angle.hpp"
#include "auvest/math/counter_random.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/particle_set.hpp"
#include "auvest/particles/resampling.hpp"
#include "auvest/particles/weighted_means.hpp"
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
  Scalar birth_velocity_mps = Scalar(0);
  Scalar birth_acceleration_mps2 = Scalar(0.01);
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

  // The fields of a particle: log weight, pose, its covariance (2.0), and the masters, each with
  // six states and the lower triangle of their covariance.
  static constexpr int kPoseField = 1;
  static constexpr int kPoseNumbers = kPose + (Proposal::kInformed ? kPose * (kPose + 1) / 2 : 0);
  static constexpr int kMasterField = kPoseField + kPoseNumbers;
  static constexpr int kMasterNumbers = 6 + 21;
  using Set = ParticleSet<Scalar, kMasterField + Masters * kMasterNumbers>;
  template <int Capacity>
  using Storage = ParticleStorage<Scalar, Set::kFields, Capacity>;

  /// The particles live in `storage`, which holds at least Set::storage_size(capacity) numbers and
  /// must outlive the filter.
  Slatf(const Motion& motion, const Master& master, const Params& params, Scalar* storage,
        int capacity)
      : motion_(motion), master_(master), params_(params), set_(storage, capacity) {}

  template <int Capacity>
  Slatf(const Motion& motion, const Master& master, const Params& params,
        ParticleStorage<Scalar, Set::kFields, Capacity>& storage)
      : Slatf(motion, master, params, storage.numbers, Capacity) {}

  /// Draws the poses of `particles` particles from N(pose.x, pose.P); there is no master yet. P may
  /// be singular or zero.
  Status reset(const SlaveBelief& pose, int particles, math::Random& random) {
    const bool valid =
        particles > 0 && particles <= set_.capacity() && !(params_.resample_below < Scalar(0)) &&
        !(params_.gate < Scalar(0)) && !(params_.birth_velocity_mps < Scalar(0)) &&
        params_.birth_acceleration_mps2 > Scalar(0) && (params_.gate > Scalar(0) || !births()) &&
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
      draw(key, i, spread, drawn.x);
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
    const int field = master_field(masters_);
    for_each([&](int i) { store(i, field, copy); });
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
    for_each([&](int i) { advance(i, move); });
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
          give_birth(echoes, s);
        } else {
          old[left++] = sightings[s];
        }
      }
      echoes.sightings = old;
      echoes.count = left;
      if (left == 0) return Status::kOk;
    }
    for_each([&](int i) { take_in(i, echoes); });
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
    for_each([&](int i) {
      advance(i, move);
      take_in(i, echoes);
    });
    conclude(count, random);
    return Status::kOk;
  }

  /// Mean and covariance of the slave's pose; the heading's mean is that of unit vectors.
  SlaveBelief slave() const {
    using math::sincos;
    using math::wrap;
    Vector<Scalar, kPose> origin;
    for (int k = 0; k < kPose; ++k) origin(k) = *set_.at(0, kPoseField + k);
    const bool heading = kPose > 2;
    Scalar mean[kPose + 1];
    weighted_means<Lanes>(
        set_,
        [&](int i, Value(&q)[kPose + 1]) {
          for (int k = 0; k < 2; ++k) q[k] = pose_number(i, k) - Value(origin(k));
          q[kPose] = Value(0);
          if (heading) {
            sincos(Value(pose_number(i, kPose - 1) - Value(origin(kPose - 1))), q[kPose],
                   q[kPose - 1]);
          }
        },
        mean);
    SlaveBelief belief;
    for (int k = 0; k < 2; ++k) belief.x(k) = origin(k) + mean[k];
    if (heading) {
      belief.x(kPose - 1) =
          math::wrap(Scalar(origin(kPose - 1) + math::atan2(mean[kPose], mean[kPose - 1])));
    }

    constexpr int kTriangle = kPose * (kPose + 1) / 2;
    Scalar covariance[kTriangle];
    weighted_means<Lanes>(
        set_,
        [&](int i, Value(&q)[kTriangle]) {
          Belief<Value, kPose> pose;
          load_pose(i, pose);
          for (int k = 0; k < kPose; ++k) pose.x(k) = pose.x(k) - Value(belief.x(k));
          if (heading) pose.x(kPose - 1) = wrap(Value(pose.x(kPose - 1)));
          square(pose, Proposal::kInformed, q);
        },
        covariance);
    unpack(covariance, belief.P);
    return belief;
  }

  /// Mean and covariance of master n.
  MasterBelief master(int n) const {
    Vector<Scalar, 6> origin;
    for (int k = 0; k < 6; ++k) origin(k) = *set_.at(0, master_field(n) + k);
    Scalar mean[6];
    weighted_means<Lanes>(
        set_,
        [&](int i, Value(&q)[6]) {
          const Scalar* from = set_.at(i, master_field(n));
          for (int k = 0; k < 6; ++k) q[k] = Lanes::load(from + k * kBlock) - Value(origin(k));
        },
        mean);
    MasterBelief belief;
    for (int k = 0; k < 6; ++k) belief.x(k) = origin(k) + mean[k];

    Scalar covariance[21];
    weighted_means<Lanes>(
        set_,
        [&](int i, Value(&q)[21]) {
          Belief<Value, 6> each;
          load(i, master_field(n), each);
          for (int k = 0; k < 6; ++k) each.x(k) = each.x(k) - Value(belief.x(k));
          square(each, true, q);
        },
        covariance);
    unpack(covariance, belief.P);
    return belief;
  }

  int particles() const { return set_.size(); }
  int masters() const { return masters_; }
  Scalar effective_size() const { return effective_size_; }  ///< N_eff before any resampling
  int resamplings() const { return resamplings_; }           ///< since reset
  Scalar log_likelihood() const { return log_likelihood_; }  ///< of all sightings since reset
  const Set& set() const { return set_; }

 private:
  using Value = typename Lanes::Value;

  template <class Kernel>
  AUVEST_INLINE void for_each(const Kernel& kernel) const {
    for (int i = 0; i < set_.size(); i += Lanes::kWidth) kernel(i);
  }

  /// Without a gate, one that no NIS of check_sightings() reaches.
  Value gate() const { return Value(params_.gate > Scalar(0) ? params_.gate : Scalar(1e35)); }

  static int master_field(int n) { return kMasterField + n * kMasterNumbers; }

  template <int N>
  AUVEST_INLINE void load(int i, int field, Belief<Value, N>& belief) const {
    const Scalar* from = set_.at(i, field);
    int offset = 0;
    AUVEST_UNROLL
    for (int k = 0; k < N; ++k, offset += kBlock) belief.x(k) = Lanes::load(from + offset);
    AUVEST_UNROLL
    for (int k = 0; k < N; ++k) {
      AUVEST_UNROLL
      for (int l = 0; l <= k; ++l, offset += kBlock) belief.P(k, l) = Lanes::load(from + offset);
    }
  }

  template <int N>
  AUVEST_INLINE void store(int i, int field, const Belief<Value, N>& belief) const {
    Scalar* to = set_.at(i, field);
    int offset = 0;
    AUVEST_UNROLL
    for (int k = 0; k < N; ++k, offset += kBlock) Lanes::store(to + offset, belief.x(k));
    AUVEST_UNROLL
    for (int k = 0; k < N; ++k) {
      AUVEST_UNROLL
      for (int l = 0; l <= k; ++l, offset += kBlock) Lanes::store(to + offset, belief.P(k, l));
    }
  }

  AUVEST_INLINE void load_pose(int i, Belief<Value, kPose>& pose) const {
    if (Proposal::kInformed) {
      load(i, kPoseField, pose);
    } else {
      const Scalar* from = set_.at(i, kPoseField);
      for (int k = 0; k < kPose; ++k) pose.x(k) = Lanes::load(from + k * kBlock);
    }
  }

  AUVEST_INLINE void store_pose(int i, const Belief<Value, kPose>& pose) const {
    if (Proposal::kInformed) {
      store(i, kPoseField, pose);
    } else {
      Scalar* to = set_.at(i, kPoseField);
      for (int k = 0; k < kPose; ++k) Lanes::store(to + k * kBlock, pose.x(k));
    }
  }

  AUVEST_INLINE Value pose_number(int i, int k) const {
    return Lanes::load(set_.at(i, kPoseField + k));
  }

  /// The lower triangle of x x', plus P where it counts.
  template <int N, int Count>
  static AUVEST_INLINE void square(const Belief<Value, N>& belief, bool with_covariance,
                                   Value (&triangle)[Count]) {
    int at = 0;
    for (int k = 0; k < N; ++k) {
      for (int l = 0; l <= k; ++l, ++at) {
        triangle[at] = belief.x(k) * belief.x(l);
        if (with_covariance) triangle[at] = triangle[at] + belief.P(k, l);
      }
    }
  }

  template <int N, int Count>
  static void unpack(const Scalar (&triangle)[Count], Matrix<Scalar, N, N>& p) {
    int at = 0;
    for (int k = 0; k < N; ++k) {
      for (int l = 0; l <= k; ++l, ++at) p(k, l) = p(l, k) = triangle[at];
    }
  }

  /// x <- x + root e, e ~ N(0, I).
  static AUVEST_INLINE void draw(const math::CounterKey& key, int i,
                                 const Matrix<Value, kPose, kPose>& root, Vector<Value, kPose>& x) {
    Value e[kPose + 1];
    for (int k = 0; k < kPose; k += 2) {
      math::counter_normal_pair(key, Lanes::index(i), static_cast<uint32_t>(k / 2), e[k], e[k + 1]);
    }
    AUVEST_UNROLL
    for (int k = 0; k < kPose; ++k) {
      Value sum = root(k, 0) * e[0];
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
    Matrix<Value, 2, 2> noise;
    math::CounterKey key;

    Echoes(const Sighting<Scalar>* heard, int number, const Sonar<Scalar>& device,
           math::Random& random)
        : sightings(heard),
          count(number),
          sonar(device),
          noise(device.template R<Value>()),
          key(random) {}
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

  bool births() const { return params_.birth_velocity_mps > Scalar(0) && masters_ < Masters; }

  AUVEST_INLINE void advance(int i, const Move& move) const {
    Belief<Value, kPose> pose;
    load_pose(i, pose);
    Value a(0);
    Value b(0);
    if (!Proposal::kInformed) math::counter_normal_pair(move.key, Lanes::index(i), 0u, a, b);
    Proposal::predict(motion_, move.step, a, b, pose);
    store_pose(i, pose);
    for (int n = 0; n < masters_; ++n) {
      Belief<Value, 6> master;
      load(i, master_field(n), master);
      master_.propagate(master, move.dt);  // Eqs. (15) and (16)
      if (move.changes != nullptr) add_planned_change(move.changes[n], move.dt, master.x);
      store(i, master_field(n), master);
    }
  }

  /// The position of master n: mean, and root of its covariance.
  struct Place {
    Vector<Value, 2> x;
    Matrix<Value, 2, 2> root;
  };

  AUVEST_INLINE Place position(int i, int n) const {
    const Scalar* from = set_.at(i, master_field(n));
    Place place;
    Matrix<Value, 2, 2> p;
    Matrix<Value, 1, 2> no_others;
    place.x(0) = Lanes::load(from);
    place.x(1) = Lanes::load(from + kBlock);
    p(0, 0) = Lanes::load(from + 6 * kBlock);
    p(1, 0) = Lanes::load(from + 7 * kBlock);
    p(1, 1) = Lanes::load(from + 8 * kBlock);
    math::factor_leading(p, place.root, no_others);
    return place;
  }

  using View = typename Sonar<Scalar>::template View<Value, kPose>;

  struct Score {
    Value nis;
    Value log_density;
  };

  /// NIS and density of a sighting, were it an echo of a master at `place`: by S of Eq. (23), or
  /// for 2.0 by L of Eq. (65).
  AUVEST_INLINE Score score(const Place& place, const Belief<Value, kPose>& pose,
                            const Echoes& echoes, int s) const {
    View view;
    echoes.sonar.look(pose.x, place.x(0), place.x(1), echoes.sightings[s].z, view);
    Matrix<Value, 2, 2> noise = echoes.noise;
    if (Proposal::kInformed) {
      Matrix<Value, kPose, kPose> root;
      Matrix<Value, 1, kPose> no_others;
      Matrix<Value, 2, kPose> by_slave;
      math::factor_leading<math::DropLostPivots>(pose.P, root, no_others);
      project(view.by_slave, root, by_slave);
      innovation_covariance(by_slave, echoes.noise, noise);
      math::ldlt(noise);
    }
    Matrix<Value, 2, 2> by_master;
    project(view.by_master, place.root, by_master);
    Posterior<Value, 2> posterior;
    const math::Mask<Value> valid = potter(by_master, noise, view.innovation, posterior);
    Score result;
    result.nis = posterior.nis;
    result.log_density = log_density(valid, posterior, noise);
    return result;
  }

  static AUVEST_INLINE math::Mask<Value> is(const Value& chosen, int n) {
    return chosen > Value(Scalar(n) - Scalar(0.5)) && chosen < Value(Scalar(n) + Scalar(0.5));
  }

  /// The number of the master that is likeliest to have sent sighting s, of those that none of the
  /// sightings before it has in this particle.
  AUVEST_INLINE Value nearest(int i, const Belief<Value, kPose>& pose, const Echoes& echoes, int s,
                              const Value* chosen) const {
    using math::select;
    Value best = Value(no_log_weight<Scalar>());
    Value who = Value(Scalar(-1));
    for (int n = 0; n < masters_; ++n) {
      const Value density = score(position(i, n), pose, echoes, s).log_density;
      math::Mask<Value> better = density > best;
      for (int earlier = 0; earlier < s; ++earlier) better = better && !is(chosen[earlier], n);
      best = select(better, density, best);
      who = select(better, Value(n), who);
    }
    return who;
  }

  /// All that the echoes do to the particles from i on: association, proposal and draw (2.0),
  /// weight, masters.
  AUVEST_INLINE void take_in(int i, const Echoes& echoes) const {
    using math::select;
    Belief<Value, kPose> pose;
    load_pose(i, pose);
    Value log_weight = Lanes::load(&set_.log_weight(i));
    Value chosen[Masters];
    for (Value& who : chosen) who = Value(Scalar(-1));
    Matrix<Value, kPose, kPose> root;
    math::set_zero(root);
    for (int s = 0; s < echoes.count; ++s) {
      const int known = echoes.sightings[s].master;
      chosen[s] = known == kUnknownMaster ? nearest(i, pose, echoes, s, chosen) : Value(known);
      if (!Proposal::kInformed) continue;
      Place place = position(i, known == kUnknownMaster ? 0 : known);
      for (int n = 1; known == kUnknownMaster && n < masters_; ++n) {
        const Place other = position(i, n);
        const math::Mask<Value> mine = is(chosen[s], n);
        math::copy_where(mine, other.x, place.x);
        math::copy_where(mine, other.root, place.root);
      }
      View view;
      echoes.sonar.look(pose.x, place.x(0), place.x(1), echoes.sightings[s].z, view);  // Eq. (51)
      if (known != kUnknownMaster) {
        log_weight = log_weight + MeasurementProposal::refine(view, echoes.noise, place.root,
                                                              gate(), pose, root);
      } else {
        // With more echoes than masters an echo may have none: it says nothing.
        const math::Mask<Value> any = chosen[s] > Value(-0.5);
        const Value limit = select(any, gate(), Value(0));
        const Value density =
            MeasurementProposal::refine(view, echoes.noise, place.root, limit, pose, root);
        log_weight = log_weight + select(any, density, Value(0));
      }
    }
    if (Proposal::kInformed) {
      draw(echoes.key, i, root, pose.x);
      if (!params_.carry_covariance) math::set_zero(pose.P);
      store_pose(i, pose);
    }
    for (int s = 0; s < echoes.count; ++s) {
      const int known = echoes.sightings[s].master;
      if (known != kUnknownMaster) {
        log_weight = log_weight + correct(i, pose, known, echoes, s, nullptr);
      } else {
        for (int n = 0; n < masters_; ++n) {
          const math::Mask<Value> mine = is(chosen[s], n);
          log_weight = log_weight + select(mine, correct(i, pose, n, echoes, s, &mine), Value(0));
        }
      }
    }
    Lanes::store(&set_.log_weight(i), log_weight);
  }

  /// The EKF of master n, Eqs. (18) to (26), in the lanes of `only` (null: all). Returns for 1.0
  /// the logarithm of the weight, Eqs. (30) and (31), and 0 for 2.0, which has weighed already.
  AUVEST_INLINE Value correct(int i, const Belief<Value, kPose>& pose, int n, const Echoes& echoes,
                              int s, const math::Mask<Value>* only) const {
    using math::all;
    Belief<Value, 6> master;
    load(i, master_field(n), master);
    const Belief<Value, 6> before = master;
    View view;
    echoes.sonar.look(pose.x, master.x(0), master.x(1), echoes.sightings[s].z, view);
    Matrix<Value, 2, 2> root;
    Matrix<Value, 4, 2> slope;
    const math::Mask<Value> definite = math::factor_leading(master.P, root, slope);
    Matrix<Value, 2, 2> a;
    project(view.by_master, root, a);
    Matrix<Value, 2, 2> noise = echoes.noise;
    Posterior<Value, 2> posterior;
    math::Mask<Value> valid = potter(a, noise, view.innovation, posterior);
    valid = valid && definite;
    if (params_.gate > Scalar(0)) saturate(gate(), posterior);
    valid = valid && move_belief(master, root, slope, posterior);
    math::Mask<Value> moved = valid;
    if (only != nullptr) moved = moved && *only;
    if (!all(moved)) math::copy_where(!moved, before, master);
    store(i, master_field(n), master);
    return Proposal::kInformed ? Value(0) : log_density(valid, posterior, noise);
  }

  /// True if most of the weight finds sighting s beyond the gate of every master.
  bool is_lonely(const Echoes& echoes, int s) const {
    using math::select;
    OrderedSum<Lanes> lonely;
    for_each([&](int i) {
      Belief<Value, kPose> pose;
      load_pose(i, pose);
      Value weight = weight_of(Lanes::load(&set_.log_weight(i)));
      for (int n = 0; n < masters_; ++n) {
        const Value nis = score(position(i, n), pose, echoes, s).nis;
        weight = select(nis > gate(), weight, Value(0));
      }
      lonely.add(i, weight);
    });
    return lonely.total() > Scalar(0.5);
  }

  /// A new master where each particle hears sighting s come from.
  void give_birth(const Echoes& echoes, int s) {
    using math::sincos;
    const Vector<Scalar, 2>& z = echoes.sightings[s].z;
    const typename Sonar<Scalar>::Params& sonar = echoes.sonar.params;
    const Scalar along = sonar.sigma_range_m * sonar.sigma_range_m;
    const Scalar across = z(0) * z(0) * sonar.sigma_bearing_rad * sonar.sigma_bearing_rad;
    const Scalar range = sonar.bearing == Bearing::kMasterToSlave ? -z(0) : z(0);
    const Scalar velocity = params_.birth_velocity_mps * params_.birth_velocity_mps;
    const Scalar acceleration = params_.birth_acceleration_mps2 * params_.birth_acceleration_mps2;
    for_each([&](int i) {
      Belief<Value, kPose> pose;
      load_pose(i, pose);
      Value direction(z(1));
      if (sonar.bearing == Bearing::kFromHeading) direction = direction + pose.x(kPose - 1);
      Value sine, cosine;
      sincos(direction, sine, cosine);
      Belief<Value, 6> master;
      math::set_zero(master.x);
      math::set_zero(master.P);
      master.x(0) = pose.x(0) + range * cosine;
      master.x(1) = pose.x(1) + range * sine;
      master.P(0, 0) = along * (cosine * cosine) + across * (sine * sine);
      master.P(1, 0) = (along - across) * (cosine * sine);
      master.P(1, 1) = along * (sine * sine) + across * (cosine * cosine);
      for (int k = 0; k < 2; ++k) {
        if (Proposal::kInformed) {
          for (int l = 0; l <= k; ++l) master.P(k, l) = master.P(k, l) + pose.P(k, l);
        }
        master.P(2 + k, 2 + k) = Value(velocity);
        master.P(4 + k, 4 + k) = Value(acceleration);
      }
      store(i, master_field(masters_), master);
    });
    ++masters_;
  }

  /// Normalises, and resamples where few particles are left.
  void conclude(int count, math::Random& random) {
    const WeightSummary<Scalar> summary = normalise<Lanes>(set_);
    effective_size_ = summary.effective_size;
    log_likelihood_ =
        log_likelihood_ + (summary.log_sum - Scalar(count) * Scalar(1.8378770664));  // log(2 pi)
    if (effective_size_ < params_.resample_below * Scalar(set_.size())) {
      resample<Resampling>(set_, random);
      ++resamplings_;
    }
  }

  Motion motion_;
  Master master_;
  Params params_;
  Set set_;
  int masters_ = 0;
  int resamplings_ = 0;
  Scalar log_likelihood_ = Scalar(0);
  Scalar effective_size_ = Scalar(0);
};

template <class Motion, class Master, int Masters, class Resampling = SystematicResampling,
          class Lanes = OneLane<typename Motion::Scalar>>
using Slatf1 = Slatf<Motion, Master, MotionProposal, Masters, Resampling, Lanes>;

template <class Motion, class Master, int Masters, class Resampling = SystematicResampling,
          class Lanes = OneLane<typename Motion::Scalar>>
using Slatf2 = Slatf<Motion, Master, MeasurementProposal, Masters, Resampling, Lanes>;

}  // namespace auvest
