// What a particle of Slatf is, and what happens to it: predict, associate, propose, weigh, correct.
//
// Each step is a kernel over the particles of one vector register, or of two side by side
// (particles/tiles.hpp, which also says in which order); what follows speaks of one particle. The
// order of the steps, and what is for all particles together, is in slatf.hpp.
#pragma once

#include "auvest/math/counter_random.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/mixture.hpp"
#include "auvest/particles/particle_set.hpp"
#include "auvest/particles/tiles.hpp"
#include "auvest/slat/association.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/master_bank.hpp"
#include "auvest/slat/master_ekf.hpp"
#include "auvest/slat/proposals.hpp"
#include "auvest/slat/safeguards.hpp"
#include "auvest/slat/slat_filter.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct SlatfParams : EchoParams<Scalar> {
  Scalar resample_below = Scalar(0.5);  ///< resample where N_eff < this times N, [SLATF 33]
  bool carry_covariance = false;        ///< 2.0 only: [SLATF 50] to the letter, see proposals.hpp
  /// Standard deviations of the velocity [m/s] and the acceleration [m/s^2] of a master that is
  /// born from an echo of kUnknownMaster: where particles with more than half of the weight find
  /// the echo beyond the gate of every master. 0: no births. Needs a gate.
  Scalar birth_velocity_m_s = Scalar(0);
  Scalar birth_acceleration_m_s2 = Scalar(0.01);
  /// The slave's covariance includes what the number of particles costs (slatf.hpp). The paper's
  /// does not.
  bool monte_carlo = true;
};

/// Watched: the echoes that particles refuse are counted (safeguards.hpp).
template <class Motion_, class Master_, class Proposal_, int Masters, class Lanes_, bool Watched>
struct SlatfParticle {
  using Motion = Motion_;
  using Master = Master_;
  using Proposal = Proposal_;
  using Lanes = Lanes_;
  using Scalar = typename Motion::Scalar;
  using Value = typename Lanes::Value;
  static constexpr int kPose = Motion::kStates;

  // ---- What it is ------------------------------------------------------------------------------

  // [SLATF 9], the fields: pose, its covariance (2.0), and the masters (master_bank.hpp).
  static constexpr int kPoseField = 0;
  static constexpr int kPoseNumbers = kPose + (Proposal::kInformed ? triangle_numbers(kPose) : 0);
  static constexpr int kMasterField = kPoseField + kPoseNumbers;
  using Bank = MasterBank<Master, Lanes>;
  static constexpr int kMasterNumbers = Bank::kNumbers;
  using Set = ParticleSet<Scalar, kMasterField + Masters * kMasterNumbers>;
  using Schedule = Tiles<Lanes, Set>;

  static constexpr int master_field(int n) { return kMasterField + n * kMasterNumbers; }

  /// Particle i of a set, and those that stand in the same registers.
  template <class Group>
  struct Numbers {
    using Fields = typename Group::Fields;
    using V = typename Fields::Value;
    using Pose = Belief<V, kPose>;
    Set& set;
    int i;

    AUVEST_ALWAYS_INLINE Scalar* pose() const { return set.at(i, kPoseField); }
    AUVEST_ALWAYS_INLINE Scalar* master(int n) const { return set.at(i, master_field(n)); }
    AUVEST_ALWAYS_INLINE Place<V> place(int n) const { return load_place<Fields>(master(n)); }

    AUVEST_ALWAYS_INLINE void load(Pose& to) const {
      if (Proposal::kInformed) {
        load_belief<Fields>(pose(), to);
      } else {
        load_mean<Fields>(pose(), to.x);
      }
    }

    AUVEST_ALWAYS_INLINE void store(const Pose& from) const {
      if (Proposal::kInformed) {
        store_belief<Fields>(pose(), from);
      } else {
        store_mean<Fields>(pose(), from.x);
      }
    }

    AUVEST_ALWAYS_INLINE void multiply_weight(
        const typename Group::Weights::Value& log_factor) const {
      Scalar* at = set.log_weights() + i;
      Group::Weights::store(at, Group::Weights::load(at) + log_factor);
    }
  };
  using Single = Numbers<typename Schedule::Single>;

  /// e ~ N(0, I) for particle i; the last is left over where the pose is odd.
  template <class Group, class V>
  static AUVEST_INLINE void draw(Group, int i, const math::CounterKey& key, V (&e)[kPose + 1]) {
    for (int k = 0; k < kPose; k += 2) {
      math::counter_normal_pair(key, Group::Fields::index(i), static_cast<uint32_t>(k / 2), e[k],
                                e[k + 1]);
    }
  }

  /// x <- x + root e: a sample of N(x, root root').
  template <class V>
  static AUVEST_INLINE void sample(const Matrix<V, kPose, kPose>& root, const V (&e)[kPose + 1],
                                   Vector<V, kPose>& x) {
    AUVEST_UNROLL
    for (int k = 0; k < kPose; ++k) {
      V sum = root(k, 0) * e[0];
      AUVEST_UNROLL
      for (int l = 1; l < kPose; ++l) sum = sum + root(k, l) * e[l];
      x(k) = x(k) + sum;
    }
  }

  // ---- Predict ---------------------------------------------------------------------------------

  /// What a prediction is, for all particles.
  struct Prediction {
    typename Motion::Step step;
    Scalar dt;
    const Vector<Scalar, 2>* changes;  ///< of the masters' velocities; null: none
    math::CounterKey key;

    Prediction(const typename Motion::Step& motion, Scalar seconds,
               const Vector<Scalar, 2>* planned, math::Random& random)
        : step(motion), dt(seconds), changes(planned), key(random) {}
  };

  struct PredictPose {
    static constexpr int kThird = 0;
    Set& set;
    const Motion& motion;
    const Prediction& prediction;

    template <class Group>
    void operator()(Group, int i, int) const {
      using V = typename Numbers<Group>::V;
      const Numbers<Group> particle = {set, i};
      Belief<V, kPose> pose;
      particle.load(pose);
      V a(0);
      V b(0);
      if (!Proposal::kInformed) {
        math::counter_normal_pair(prediction.key, Group::Fields::index(i), 0u, a, b);
      }
      Proposal::predict(motion, prediction.step, a, b, pose);
      particle.store(pose);
    }
  };

  struct PredictMasters {
    static constexpr int kThird = -1;
    Set& set;
    const Master& master;
    const Prediction& prediction;
    int masters;

    template <class Group>
    void operator()(Group, int i, int) const {
      for (int n = 0; n < masters; ++n) {
        const Vector<Scalar, 2>* change =
            prediction.changes != nullptr ? prediction.changes + n : nullptr;
        Bank::predict(master, prediction.dt, change, set.at(i, master_field(n)));
      }
    }
  };

  // ---- Update ----------------------------------------------------------------------------------

  /// What an update is, for all particles.
  struct Update {
    const Echo<Scalar>* echoes;
    int count;
    const Sonar<Scalar>& sonar;
    math::CounterKey key;
    const SlatfParams<Scalar>& params;
    RefusedWeight<Scalar, Masters>* refused = nullptr;  ///< Watched: where they are counted

    Update(const Echo<Scalar>* heard, int number, const Sonar<Scalar>& device,
           const SlatfParams<Scalar>& settings, math::Random& random)
        : echoes(heard), count(number), sonar(device), key(random), params(settings) {}

    bool all_known() const {
      for (int s = 0; s < count; ++s) {
        if (echoes[s].master == kUnknownMaster) return false;
      }
      return true;
    }

    /// Without a gate, one that no NIS of check_echoes() reaches.
    Scalar limit() const { return params.gate > Scalar(0) ? params.gate : Scalar(1e35); }

    /// Counts the particles of a group that refuse echo s. Their weights are those before the
    /// update.
    template <class Group, class V>
    AUVEST_INLINE void count_refusals(int s, const V& nis, const Scalar* log_weights) const {
      if (Watched) refused->template add<Group>(s, nis > V(limit()), log_weights);
    }
  };

  template <class V>
  using View = typename Sonar<Scalar>::template View<V, kPose>;

  /// What echo s would say to a particle at `pose`, were it that of master n.
  static AUVEST_INLINE Score<Value> score_echo(const Single& particle,
                                               const typename Single::Pose& pose,
                                               const Update& update, int s, int n) {
    return score(update.sonar, update.echoes[s].z, particle.place(n), pose, Proposal::kInformed);
  }

  /// Association: the number of the master that is likeliest to have sent echo s, of those that no
  /// other echo has in this particle. -1: none is left.
  static AUVEST_INLINE Value associate(const Single& particle, const typename Single::Pose& pose,
                                       const Update& update, int s, int masters,
                                       const Value (&chosen)[Masters]) {
    using math::select;
    Value best = Value(no_log_weight<Scalar>());
    Value who = Value(Scalar(-1));
    for (int n = 0; n < masters; ++n) {
      const Value density = score_echo(particle, pose, update, s, n).log_density;
      math::Mask<Value> better = density > best;
      for (int other = 0; other < update.count; ++other) {
        better = better && !is_master(chosen[other], n);
      }
      best = select(better, density, best);
      who = select(better, Value(n), who);
    }
    return who;
  }

  /// 2.0: draws the pose from what the proposal has become by all echoes.
  template <class Group, class V>
  static AUVEST_INLINE void sample_pose(Group, int i, Set& set, const Matrix<V, kPose, kPose>& root,
                                        const V (&e)[kPose + 1], const Update& update,
                                        Belief<V, kPose>& pose) {
    sample(root, e, pose.x);  // [SLATF 45]
    // Differs from [SLATF 50]: a drawn pose is a point.
    if (!update.params.carry_covariance) math::set_zero(pose.P);
    const Numbers<Group> particle = {set, i};
    particle.store(pose);
  }

  /// 2.0 where the masters of all echoes are known.
  struct Propose {
    static constexpr int kThird = -1;
    Set& set;
    const Update& update;

    template <class Group>
    void operator()(Group group, int i, int) const {
      using V = typename Numbers<Group>::V;
      const Numbers<Group> particle = {set, i};
      Belief<V, kPose> pose;
      V e[kPose + 1];  // first: while the rest waits for roots and quotients
      draw(group, i, update.key, e);
      particle.load(pose);
      V log_weight(0);
      Matrix<V, kPose, kPose> root;
      math::set_zero(root);
      for (int s = 0; s < update.count; ++s) {
        const Echo<Scalar>& echo = update.echoes[s];
        const Place<V> source = particle.place(echo.master);
        View<V> view;
        update.sonar.look(pose.x, source.x(0), source.x(1), echo.z, view);  // [SLATF 51]
        V nis;
        log_weight = log_weight + MeasurementProposal::refine(view, update.sonar.template R<V>(),
                                                              source.root, V(update.limit()), pose,
                                                              root, nis);
        update.template count_refusals<Group>(s, nis, set.log_weights() + i);
      }
      particle.multiply_weight(log_weight);  // [SLATF 62]
      sample_pose(group, i, set, root, e, update, pose);
    }
  };

  /// The same where the particle has to find out whose each echo is: `chosen` by group and echo.
  /// For 1.0 no more than that.
  struct AssociateAndPropose {
    static constexpr int kThird = -1;
    Set& set;
    const Update& update;
    int masters;
    Value (*chosen)[Masters];

    template <class Group>
    AUVEST_OUTLINE void operator()(Group, int i, int g) const {
      using math::select;
      const Single particle = {set, i};
      typename Single::Pose pose;
      particle.load(pose);
      Value log_weight(0);
      Value(&who)[Masters] = chosen[g];
      for (int s = 0; s < update.count; ++s) who[s] = Value(Scalar(update.echoes[s].master));
      Matrix<Value, kPose, kPose> root;
      math::set_zero(root);
      for (int s = 0; s < update.count; ++s) {
        const Echo<Scalar>& echo = update.echoes[s];
        const bool known = echo.master != kUnknownMaster;
        if (!known) who[s] = associate(particle, pose, update, s, masters, who);
        if (!Proposal::kInformed) continue;
        Place<Value> source = particle.place(known ? echo.master : 0);
        for (int n = 1; !known && n < masters; ++n) {
          const Place<Value> other = particle.place(n);
          const math::Mask<Value> mine = is_master(who[s], n);
          math::copy_where(mine, other.x, source.x);
          math::copy_where(mine, other.root, source.root);
        }
        // With more echoes than masters an echo may have none: it says nothing.
        const math::Mask<Value> any = who[s] > Value(-0.5);
        const Value limit = select(any, Value(update.limit()), Value(0));
        View<Value> view;
        update.sonar.look(pose.x, source.x(0), source.x(1), echo.z, view);  // [SLATF 51]
        Value nis;
        const Value density = MeasurementProposal::refine(view, update.sonar.template R<Value>(),
                                                          source.root, limit, pose, root, nis);
        if (known) update.template count_refusals<Group>(s, nis, set.log_weights() + i);
        log_weight = log_weight + select(any, density, Value(0));
      }
      if (!Proposal::kInformed) return;
      particle.multiply_weight(log_weight);  // [SLATF 62]
      Value e[kPose + 1];
      draw(typename Schedule::Single(), i, update.key, e);
      sample_pose(typename Schedule::Single(), i, set, root, e, update, pose);
    }
  };

  /// The EKF of master n, but for its last step, by echo s. Returns for 1.0 the logarithm of the
  /// density, and 0 for 2.0, which has weighed already.
  template <class Group, class V>
  static AUVEST_INLINE V innovate(const Numbers<Group>& particle, const Update& update, int s,
                                  int n, MasterEkf<V>& ekf) {
    Vector<V, kPose> pose;
    Vector<V, 2> master;
    load_mean<typename Group::Fields>(particle.pose(), pose);
    load_mean<typename Group::Fields>(particle.master(n), master);
    Matrix<V, 2, 2> noise = update.sonar.template R<V>();
    ekf.innovate(update.sonar, update.echoes[s].z, pose, master(0), master(1), update.params.gate,
                 noise);
    count_saturated(particle, update, s, ekf.posterior.nis);
    return Proposal::kInformed ? V(0) : log_density(ekf.valid, ekf.posterior, noise);  // [SLATF 31]
  }

  /// 1.0: counts the particles whose NIS, as saturate() leaves it, says that they refuse echo s.
  /// (2.0 has counted already, by the proposal.) Echoes before s have weighed, so of an update by
  /// several the first alone is counted by weight, and the others by number.
  template <class Group, class V>
  static AUVEST_INLINE void count_saturated(const Numbers<Group>& particle, const Update& update,
                                            int s, const V& nis) {
    using math::any;
    if (!Watched || Proposal::kInformed || !(update.params.gate > Scalar(0))) return;
    if (update.echoes[s].master == kUnknownMaster) return;
    const auto beyond = !(nis < V(update.params.gate));
    if (s == 0) {
      update.refused->template add<Group>(s, beyond, particle.set.log_weights() + particle.i);
    } else if (any(beyond)) {
      count_number(particle, update, s, beyond);
    }
  }

  template <class Group, class Mask>
  static AUVEST_COLD void count_number(const Numbers<Group>& particle, const Update& update, int s,
                                       Mask beyond) {
    const Scalar equal = -math::log(Scalar(particle.set.size()));
    Scalar number[Group::kParticles];
    for (int k = 0; k < Group::kParticles; ++k) {
      number[k] = particle.i + k < particle.set.size() ? equal : no_log_weight<Scalar>();
    }
    update.refused->template add<Group>(s, beyond, number);
  }

  template <class Group, class V>
  static AUVEST_INLINE void factor(const Numbers<Group>& particle, int n, MasterEkf<V>& ekf) {
    Matrix<V, 6, 6> p;
    load_covariance<typename Group::Fields>(particle.master(n) + 6 * kBlock, p);
    ekf.factor(p);
  }

  /// Echo s of master n weighs the particle; leaves the EKF to be corrected for each group.
  struct Weigh {
    static constexpr int kThird = 1;
    Set& set;
    const Update& update;
    int s;
    int n;
    MasterEkf<Value>* ekfs;

    template <class Group>
    void operator()(Group, int i, int g) const {
      using V = typename Numbers<Group>::V;
      const Numbers<Group> particle = {set, i};
      MasterEkf<V> both;
      MasterEkf<V>& ekf = draft(both, ekfs + g);
      factor(particle, n, ekf);
      hand_out_factors(ekf, ekfs + g);
      const V density = innovate(particle, update, s, n, ekf);
      if (!Proposal::kInformed) particle.multiply_weight(density);  // [SLATF 30]
      hand_out_posterior(ekf, ekfs + g);
    }
  };

  /// The same in those particles that have chosen master n.
  struct WeighChosen {
    static constexpr int kThird = -1;
    Set& set;
    const Update& update;
    int s;
    int n;
    const Value (*chosen)[Masters];
    MasterEkf<Value>* ekfs;

    template <class Group>
    AUVEST_OUTLINE void operator()(Group, int i, int g) const {
      using math::select;
      const Single particle = {set, i};
      MasterEkf<Value>& ekf = ekfs[g];
      const math::Mask<Value> mine = is_master(chosen[g][s], n);
      factor(particle, n, ekf);
      const Value density = innovate(particle, update, s, n, ekf);
      particle.multiply_weight(select(mine, density, Value(0)));
      ekf.valid = ekf.valid && mine;
    }
  };

  /// Master n follows. Masters that were not heard keep all their bits, [SLATF 34].
  struct Correct {
    static constexpr int kThird = 2;
    Set& set;
    int n;
    MasterEkf<Value>* ekfs;

    template <class Group>
    void operator()(Group, int i, int g) const {
      using math::all;
      using math::select;
      const Single particle = {set, i};
      Belief<Value, 6> master;
      load_belief<Lanes>(particle.master(n), master);
      const math::Mask<Value> moved = ekfs[g].correct(master);
      store_belief_where<Lanes>(moved, particle.master(n), master);
      if (Proposal::kInformed || all(moved)) return;
      const math::Mask<Value> lost = ekfs[g].valid && !moved;  // weighs nothing
      particle.multiply_weight(select(lost, Value(-1e20), Value(0)));
    }
  };

  /// Weigh and Correct where master n has several models: all at once, as their probabilities
  /// follow from the densities. In the particles that have chosen n (null: in all).
  struct CorrectModels {
    static constexpr int kThird = -1;
    Set& set;
    const Update& update;
    int s;
    int n;
    const Value (*chosen)[Masters];

    /// The EKF of one model by echo s.
    struct Ekf {
      const Update& update;
      int s;
      Vector<Value, kPose> pose;
      Value* nis;  ///< the smallest of the models'

      AUVEST_INLINE math::Mask<Value> operator()(Belief<Value, 6>& master, Value& density) const {
        MasterEkf<Value> ekf;
        Matrix<Value, 2, 2> noise = update.sonar.template R<Value>();
        ekf.factor(master.P);
        ekf.innovate(update.sonar, update.echoes[s].z, pose, master.x(0), master.x(1),
                     update.params.gate, noise);
        *nis = math::select(ekf.posterior.nis < *nis, ekf.posterior.nis, *nis);
        const math::Mask<Value> moved = ekf.correct(master);
        density = log_density(moved, ekf.posterior, noise);  // [SLATF 31]
        return moved;
      }
    };

    template <class Group>
    void operator()(Group, int i, int g) const {
      using math::select;
      const Single particle = {set, i};
      Value nis(update.limit());
      Ekf ekf = {update, s, Vector<Value, kPose>(), &nis};
      load_mean<Lanes>(particle.pose(), ekf.pose);
      math::Mask<Value> mine = math::Mask<Value>();
      if (chosen != nullptr) mine = is_master(chosen[g][s], n);
      const Value density =
          Bank::correct(ekf, chosen != nullptr ? &mine : nullptr, particle.master(n));
      if (Proposal::kInformed) return;
      count_saturated(particle, update, s, nis);
      particle.multiply_weight(chosen == nullptr ? density : select(mine, density, Value(0)));
    }
  };
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
