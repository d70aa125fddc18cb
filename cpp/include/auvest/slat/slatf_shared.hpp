// SlatfJoint with one covariance for all particles.
//
// The covariance of a joint particle (slatf_joint.hpp) depends on where it is linearised and on
// nothing else, and particles differ by metres in the range. So a particle is the mean of slave and
// masters and a weight, 36 bytes for one master, and the covariance is that of the set: nearly as
// fast as points, and as consistent as joint Gaussians. Every particle has its own innovation, gain
// and weight; the covariance is narrowed once per echo, at the weighted mean, by the share g of the
// weight that accepts the echo.
//
// One covariance is right where the particles hold one answer. Where they may hold several (whose
// echo it was, a birth, the models of an Imm) each needs its own: an echo of kUnknownMaster is
// refused with kBadParameter here, take SlatfJoint.
//
// One covariance cannot see that the set drifts off together. The gate with its recovery and
// `kept` = 0.8 keep it from that; without a gate and with `kept` = 0.5 one run of 6 h in forty was
// lost.
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
#include "auvest/particles/weighted_means.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/joint_gaussian.hpp"
#include "auvest/slat/likelihood.hpp"
#include "auvest/slat/safeguards.hpp"
#include "auvest/slat/slat_filter.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct SlatfSharedParams : EchoParams<Scalar> {
  Scalar resample_below = Scalar(0.5);  ///< resample where N_eff < this times N, [SLATF 33]
  Scalar kept = Scalar(0.8);  ///< share of the covariance of range and bearing that is not drawn
};

template <class Motion, int Masters, class Resampling, class Safeguards>
using SlatfSharedFrame =
    ParticleSlatFilter<Motion, Masters,
                       ParticleSet<typename Motion::Scalar, Motion::kStates + 6 * Masters>,
                       Resampling, Safeguards>;

template <class Motion_, class Master_, int Masters, class Resampling_ = SystematicResampling,
          class Lanes_ = OneLane<typename Motion_::Scalar>,
          class Safeguards_ = Safeguards<typename Motion_::Scalar, Masters>>
class SlatfShared : public SlatfSharedFrame<Motion_, Masters, Resampling_, Safeguards_> {
 public:
  using Frame = SlatfSharedFrame<Motion_, Masters, Resampling_, Safeguards_>;
  using Motion = Motion_;
  using Master = Master_;
  using Resampling = Resampling_;
  using Lanes = Lanes_;
  using Model = JointGaussian<Motion, Master, Masters>;
  using typename Frame::Control;
  using typename Frame::MasterBelief;
  using typename Frame::Scalar;
  using typename Frame::SlaveBelief;
  using typename Frame::VelocityChange;
  using Params = SlatfSharedParams<Scalar>;
  using Joint = typename Model::Joint;
  static constexpr int kPose = Model::kPose;
  static constexpr int kStates = Model::kStates;
  static constexpr int kPoseField = 0;

  /// The particles live in `storage`, which holds at least Set::storage_size(capacity) numbers and
  /// must outlive the filter.
  SlatfShared(const Motion& motion, const Master& master, const Params& params, Scalar* storage,
              int capacity, const Resampling& resampling = Resampling())
      : Frame(storage, capacity, resampling), model_(motion, master), params_(params) {
    math::set_zero(centre_.x);
    math::set_zero(centre_.P);
  }

  template <int Capacity>
  SlatfShared(const Motion& motion, const Master& master, const Params& params,
              ParticleStorage<Scalar, kStates, Capacity>& storage,
              const Resampling& resampling = Resampling())
      : SlatfShared(motion, master, params, storage.numbers, Capacity, resampling) {}

  /// Noise, gate and recovery are those of default parameters.
  template <int Capacity>
  explicit SlatfShared(ParticleStorage<Scalar, kStates, Capacity>& storage)
      : SlatfShared(Motion(), Master(), Params(), storage) {}

  /// A copy of `other`, whose particles are copied into a storage as large as its own.
  SlatfShared(const SlatfShared& other, Scalar* storage)
      : Frame(other, storage),
        model_(other.model_),
        params_(other.params_),
        centre_(other.centre_) {}

  /// All particles hold the belief `pose`, whose P may be singular or zero; there is no master yet.
  /// Nothing is drawn before an echo comes.
  Status reset(const SlaveBelief& pose, int particles, math::Random&) {
    const bool valid = this->fits(particles) && Frame::is_share(params_.resample_below) &&
                       Frame::is_share(params_.kept) && params_.valid();
    if (!valid || model_.check() != Status::kOk) return Status::kBadParameter;
    const Status status = check_start(pose);
    if (status != Status::kOk) return status;
    this->start(particles, Frame::noise_of_an_hour(model_.motion, model_.master[0]));
    Model::start(pose, centre_);
    set_all(0, centre_.x);
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
    const int first = Model::first_of(masters_);
    Model::put(belief, first, centre_);
    set_all(first, belief.x);
    safeguards_.begin(masters_);
    ++masters_;
    return Status::kOk;
  }

  /// Carries all particles dt >= 0 seconds forward, during which the slave's reading `u` holds.
  /// `changes`: the velocity changes [m/s] that the masters planned for these seconds, one per
  /// master; null: none. Takes no random numbers.
  Status predict(Scalar dt, const Control& u, math::Random&,
                 const VelocityChange* changes = nullptr) {
    const Status status = this->check_prediction(*this, dt, u, changes, params_.longest_step_s,
                                                 Frame::extent_of(centre_));
    if (status != Status::kOk) return status;
    safeguards_.wait(dt, masters_);
    const typename Motion::Step move = model_.motion.step(u, dt);
    model_.predict(move, dt, changes, masters_, centre_);
    for_each_group([&](int i) {
      Belief<Value, kPose> pose;  // of which only the mean is kept
      math::set_zero(pose.P);
      load_mean<Lanes>(set_.at(i, 0), pose.x);
      model_.motion.propagate(move, pose);
      store_mean<Lanes>(set_.at(i, 0), pose.x);
      for (int n = 0; n < masters_; ++n) {
        Belief<Value, 6> master;
        math::set_zero(master.P);
        load_mean<Lanes>(set_.at(i, Model::first_of(n)), master.x);
        model_.master[n].propagate(master, dt);
        if (changes != nullptr) add_planned_change(changes[n], dt, master.x);
        store_mean<Lanes>(set_.at(i, Model::first_of(n)), master.x);
      }
    });
    return Status::kOk;
  }

  /// Updates by what the sonar heard at one time: any number of masters, each at most once, none of
  /// them unknown. An echo of a master that is lost or was silent for too long is its rebirth
  /// (safeguards.hpp). Takes one key of random numbers, then what the resampling policy takes.
  Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
                math::Random& random) {
    const Status status = check(echoes, count, sonar);
    if (status != Status::kOk || count == 0) return status;
    const math::CounterKey key(random);
    Refused refused;
    int heard = 0;
    int first = kUnknownMaster;
    for (int s = 0; s < count; ++s) {
      if (safeguards_.forgotten(echoes[s].master, params_)) continue;
      if (heard > 0) {
        this->log_likelihood_ = this->log_likelihood_ + normalise<Lanes>(set_).log_sum;
        find_centre();
      }
      ++heard;
      correct(echoes[s], sonar, s, refused);
      if (first == kUnknownMaster && !(refused.of[s] > Scalar(0.5))) first = echoes[s].master;
    }
    if (first != kUnknownMaster && params_.kept < Scalar(1)) draw(first, sonar, key);
    if (heard > 0) {
      this->template normalise_and_resample<Lanes>(heard, params_.resample_below, random, [] {});
    }
    for (int s = 0; Safeguards_::kActive && s < count; ++s) {
      const Echo<Scalar>& echo = echoes[s];
      if (safeguards_.forgotten(echo.master, params_)) {
        rebirth(echo, sonar);
      } else if (!(refused.of[s] > Scalar(0.5))) {
        safeguards_.accepted(echo.master);
      } else if (safeguards_.refused(echo.master, place_of(sonar, echo.z, slave().x), echo.z(0),
                                     sonar.params, params_)) {
        rebirth(echo, sonar);
      }
    }
    find_centre();
    return Status::kOk;
  }

  /// predict() and update(), both or, where one is refused, neither.
  Status step(Scalar dt, const Control& u, const VelocityChange* changes,
              const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
              math::Random& random) {
    Status status = check(echoes, count, sonar);
    if (status == Status::kOk) status = predict(dt, u, random, changes);
    return status == Status::kOk ? update(echoes, count, sonar, random) : status;
  }

  /// Mean and covariance of the slave's pose; the heading's mean is that of unit vectors.
  SlaveBelief slave() const {
    SlaveBelief pose = summarise<Lanes, kPose, false, (kPose > 2)>(set_, kPoseField);
    add_covariance(0, pose);
    return pose;
  }

  /// Mean and covariance of master n.
  MasterBelief master(int n) const {
    MasterBelief master = summarise<Lanes, 6, false, false>(set_, Model::first_of(n));
    add_covariance(Model::first_of(n), master);
    return master;
  }

  /// Means of the positions [m].
  struct Positions {
    Vector<Scalar, 2> slave;
    Vector<Scalar, 2> masters[Masters];
  };

  /// All that slave() and master() say of positions but the covariances, in one pass over fewer
  /// fields: for every step.
  Positions positions() const {
    int fields[2 + 2 * Masters];
    for (int k = 0; k < 2; ++k) {
      fields[k] = k;
      for (int n = 0; n < Masters; ++n) fields[2 + 2 * n + k] = Model::first_of(n) + k;
    }
    Scalar mean[2 + 2 * Masters];
    mean_fields<Lanes>(set_, fields, mean);
    Positions result;
    for (int k = 0; k < 2; ++k) {
      result.slave(k) = mean[k];
      for (int n = 0; n < Masters; ++n) result.masters[n](k) = mean[2 + 2 * n + k];
    }
    return result;
  }

  /// The covariance that all particles share, of slave and masters; lower triangle.
  const Matrix<Scalar, kStates, kStates>& covariance() const { return centre_.P; }

  Scalar longest_step_s() const { return params_.longest_step_s; }

  /// As SlatFilter::visit_state.
  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    Frame::visit_state(self, visit);
    visit(self.centre_);
  }

  /// Whether the covariance of all particles is one, which its sum with their spread does not show:
  /// to ask of a state that was put back.
  bool is_sound() const { return check_slave(centre_) == Status::kOk; }

 private:
  using Value = typename Lanes::Value;
  using Frame::masters_;
  using Frame::safeguards_;
  using Frame::set_;
  using Refused = RefusedWeight<Scalar, Masters>;
  static constexpr int kSeen = kPose;  ///< what the sonar's equations know: M - S, the heading

  struct Group {
    using Weights = Lanes;
    static constexpr int kParticles = Lanes::kWidth;
  };

  Status check(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar) const {
    for (int s = 0; s < count; ++s) {
      if (this->initialised_ && echoes[s].master == kUnknownMaster) return Status::kBadParameter;
    }
    return this->check_update(echoes, count, masters_, sonar);
  }

  template <class Visit>
  AUVEST_INLINE void for_each_group(const Visit& visit) const {
    for (int i = 0; i < set_.size(); i += Lanes::kWidth) visit(i);
  }

  /// Gives all particles the same numbers from field `first` on.
  template <int N>
  void set_all(int first, const Vector<Scalar, N>& x) {
    for (int i = 0; i < set_.size(); ++i) {
      for (int k = 0; k < N; ++k) *set_.at(i, first + k) = x(k);
    }
    set_.fill_block();
  }

  template <int N>
  void add_covariance(int first, Belief<Scalar, N>& belief) const {
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j <= i; ++j) {
        belief.P(i, j) = belief.P(j, i) = belief.P(i, j) + centre_.P(first + i, first + j);
      }
    }
  }

  /// The weighted mean of the particles.
  void find_centre() {
    Vector<Scalar, kStates> origin;
    for (int k = 0; k < kStates; ++k) origin(k) = *set_.at(0, k);
    Scalar mean[kStates];
    weighted_means<Lanes>(
        set_,
        [&](int i, Value(&q)[kStates]) {
          for (int k = 0; k < kStates; ++k) {
            q[k] = Lanes::load(set_.at(i, k)) - Value(origin(k));
          }
          for (int k = 2; k < kPose; ++k) q[k] = math::wrap(q[k]);
        },
        mean);
    for (int k = 0; k < kStates; ++k) centre_.x(k) = origin(k) + mean[k];
    for (int k = 2; k < kPose; ++k) centre_.x(k) = math::wrap(Scalar(centre_.x(k)));
  }

  /// The covariances of all states with what the sonar sees of master n, P T, and T' P T of the
  /// latter, with T' x = (M - S, heading).
  struct Seen {
    Matrix<Scalar, kStates, kSeen> with_all;
    Matrix<Scalar, kSeen, kSeen> own;

    Seen(const Matrix<Scalar, kStates, kStates>& P, int n) {
      const int first = Model::first_of(n);
      for (int i = 0; i < kStates; ++i) {
        for (int k = 0; k < kSeen; ++k) {
          const Scalar slave = i > k ? P(i, k) : P(k, i);
          const Scalar master = i > first + k ? P(i, first + k) : P(first + k, i);
          with_all(i, k) = k < 2 ? Scalar(master - slave) : slave;
        }
      }
      for (int k = 0; k < kSeen; ++k) {
        for (int l = 0; l < kSeen; ++l) {
          own(k, l) = k < 2 ? Scalar(with_all(first + k, l) - with_all(k, l)) : with_all(k, l);
        }
      }
    }
  };

  /// The Jacobian of the sonar by T' x.
  template <class V>
  static AUVEST_INLINE void jacobian(const typename Sonar<Scalar>::template View<V, kPose>& view,
                                     Matrix<V, 2, kSeen>& g) {
    AUVEST_UNROLL
    for (int m = 0; m < 2; ++m) {
      AUVEST_UNROLL
      for (int k = 0; k < 2; ++k) g(m, k) = view.by_master(m, k);
      AUVEST_UNROLL
      for (int k = 2; k < kSeen; ++k) g(m, k) = view.by_slave(m, k);
    }
  }

  /// S = G T' P T G' + R, lower triangle.
  template <class V>
  static AUVEST_INLINE void innovation(const Matrix<V, 2, kSeen>& g, const Seen& seen,
                                       Matrix<V, 2, 2>& s) {
    AUVEST_UNROLL
    for (int m = 0; m < 2; ++m) {
      V row[kSeen];
      AUVEST_UNROLL
      for (int k = 0; k < kSeen; ++k) {
        row[k] = g(m, 0) * seen.own(0, k);
        AUVEST_UNROLL
        for (int l = 1; l < kSeen; ++l) row[k] = row[k] + g(m, l) * seen.own(l, k);
      }
      AUVEST_UNROLL
      for (int l = 0; l <= m; ++l) s(m, l) = math::plus_dot(s(m, l), row, &g(l, 0), kSeen);
    }
  }

  /// Echo number s of a ping moves and weighs all particles, and narrows the covariance.
  AUVEST_OUTLINE void correct(const Echo<Scalar>& echo, const Sonar<Scalar>& sonar, int s,
                              Refused& refused) {
    const Seen seen(centre_.P, echo.master);
    const Scalar limit = params_.gate > Scalar(0) ? params_.gate : Scalar(1e35);
    for_each_group([&](int i) { correct(i, echo, sonar, s, seen, limit, refused); });
    const Scalar accepted = Scalar(1) - refused.of[s];
    if (accepted > Scalar(0)) Model::narrow(echo.master, sonar, accepted, centre_);
  }

  AUVEST_INLINE void correct(int i, const Echo<Scalar>& echo, const Sonar<Scalar>& sonar, int s,
                             const Seen& seen, Scalar limit, Refused& refused) {
    using math::all_finite;
    using math::larger;
    using math::log;
    using math::select;
    const int first = Model::first_of(echo.master);
    Vector<Value, kPose> pose;
    Vector<Value, 2> place;
    load_mean<Lanes>(set_.at(i, 0), pose);
    load_mean<Lanes>(set_.at(i, first), place);
    typename Sonar<Scalar>::template View<Value, kPose> view;
    sonar.look(pose, place(0), place(1), echo.z, view);  // [SLATF 51] [SLATF 20]
    Matrix<Value, 2, kSeen> g;
    jacobian(view, g);
    Matrix<Value, 2, 2> S = sonar.template R<Value>();
    innovation(g, seen, S);  // [SLATF 65]
    const Value scaled = S(1, 0) / S(0, 0);
    const Value rest = larger(Value(S(1, 1) - scaled * S(1, 0)), math::pivot_floor(S(1, 1)));
    const Value residual = view.innovation(1) - scaled * view.innovation(0);
    Vector<Value, 2> y;  // S^-1 V
    y(1) = residual / rest;
    y(0) = view.innovation(0) / S(0, 0) - scaled * y(1);
    const Value nis =
        view.innovation(0) * view.innovation(0) / S(0, 0) + residual * residual / rest;
    const math::Mask<Value> finite = math::is_finite(nis);
    const math::Mask<Value> moves = finite && !(nis > Value(limit));
    Scalar* const weight = set_.log_weights() + i;
    refused.template add<Group>(s, !moves, weight);
    const Value density = Value(-0.5) * (select(moves, nis, Value(limit)) +
                                         log(Value(S(0, 0) * rest)));  // [SLATF 64] [SLATF 65]
    const Value least = Value(-1e20);
    Lanes::store(weight, Lanes::load(weight) + select(finite, larger(least, density), least));
    Value shift[kSeen];  // G' S^-1 V
    AUVEST_UNROLL
    for (int k = 0; k < kSeen; ++k) {
      shift[k] = select(moves, g(0, k) * y(0) + g(1, k) * y(1), Value(0));
    }
    const int last = kPose + 6 * masters_;
    for (int k = 0; k < last; ++k) {
      Scalar* const at = set_.at(i, k);
      Value x = Lanes::load(at);
      AUVEST_UNROLL
      for (int l = 0; l < kSeen; ++l) x = x + seen.with_all(k, l) * shift[l];
      if (k == 2 && kPose > 2) x = math::wrap(x);
      Lanes::store(at, x);
    }
  }

  /// Draws a share of range and bearing of master n in all particles, as Model::draw() does in one
  /// (joint_gaussian.hpp): with S_y = L L' their covariance, x <- x + P H' L^-T e, e of variance
  /// 1 - kept.
  AUVEST_OUTLINE void draw(int n, const Sonar<Scalar>& sonar, const math::CounterKey& key) {
    const Seen seen(centre_.P, n);
    Vector<Scalar, kPose> pose;
    for (int k = 0; k < kPose; ++k) pose(k) = centre_.x(k);
    const int first = Model::first_of(n);
    Vector<Scalar, 2> nothing;
    math::set_zero(nothing);
    typename Sonar<Scalar>::template View<Scalar, kPose> view;
    sonar.look(pose, centre_.x(first), centre_.x(first + 1), nothing, view);
    Matrix<Scalar, 2, kSeen> g;
    jacobian(view, g);
    Matrix<Scalar, 2, 2> S;
    math::set_zero(S);
    innovation(g, seen, S);
    Matrix<Scalar, 2, 2> root;
    Matrix<Scalar, 1, 2> no_others;
    math::factor_leading<math::DropLostPivots>(S, root, no_others);
    Matrix<Scalar, kStates, 2> spread;
    const Scalar scale = math::sqrt(Scalar(1) - params_.kept);
    for (int k = 0; k < kStates; ++k) {
      const Scalar along = scale * math::dot(&seen.with_all(k, 0), &g(0, 0), kSeen);
      const Scalar across = scale * math::dot(&seen.with_all(k, 0), &g(1, 0), kSeen);
      const bool sure = !(root(0, 0) > Scalar(0));
      spread(k, 0) = sure ? Scalar(0) : along / root(0, 0);
      spread(k, 1) =
          root(1, 1) > Scalar(0) ? (across - root(1, 0) * spread(k, 0)) / root(1, 1) : Scalar(0);
    }
    const int last = kPose + 6 * masters_;
    for_each_group([&](int i) {
      Value e[2];
      math::counter_normal_pair(key, Lanes::index(i), 0u, e[0], e[1]);
      for (int k = 0; k < last; ++k) {
        Scalar* const at = set_.at(i, k);
        Value x = Lanes::load(at) + (spread(k, 0) * e[0] + spread(k, 1) * e[1]);
        if (k == 2 && kPose > 2) x = math::wrap(x);
        Lanes::store(at, x);
      }
    });
    const Scalar none[2] = {Scalar(0), Scalar(0)};
    Model::draw(n, sonar, params_.kept, none, centre_);
  }

  AUVEST_COLD void rebirth(const Echo<Scalar>& echo, const Sonar<Scalar>& sonar) {
    find_centre();
    Model::give_rebirth(echo.z, echo.master, sonar, params_, centre_);
    const int first = Model::first_of(echo.master);
    for_each_group([&](int i) {
      Vector<Value, kPose> pose;
      load_mean<Lanes>(set_.at(i, 0), pose);
      Vector<Value, 6> master;
      math::set_zero(master);
      const Vector<Value, 2> place = place_of(sonar, echo.z, pose);
      master(0) = place(0);
      master(1) = place(1);
      store_mean<Lanes>(set_.at(i, first), master);
    });
    safeguards_.reborn(echo.master);
  }

  Model model_;
  Params params_;
  Joint centre_;  ///< the weighted mean, by which Jacobians are taken; the covariance of all
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
