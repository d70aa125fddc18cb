// The SLAT filters with an Imm as Master.
//
// Slatf: given the slave's path a master depends on nothing else, so every particle has the
// textbook's filter for every master: a belief per model, and their probabilities. Beside them it
// keeps the combined belief, from which 2.0 draws and by which echoes are associated. The weight of
// 1.0 is the density of the mixture, sum_j mu_j N(V_j; 0, S_j).
//
// EkfSlat: the textbook's filter over the *joint* Gaussian of slave and masters. What a master does
// next is independent of the slave and of the other masters, but what an echo says about its motion
// it says about the slave, too: the belief of the slave depends on the models. So a hypothesis is
// one model for each master, and to each of the K^masters hypotheses belongs a joint Gaussian.
// Hypothesis h gives master n model (h / K^n) mod K.
//
// Masters switch independently, so the transition probabilities of hypotheses are products over the
// masters, and mixing goes master by master: over the K hypotheses that differ in that master's
// model alone. K^masters grows fast; it is meant for one or two masters.
#pragma once

#include "auvest/filters/imm.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/master_bank.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// That of the noisiest model.
template <class... Models>
struct NoiseOf<Imm<Models...>> {
  const Imm<Models...>& master;

  template <class Belief, class Scalar>
  void propagate(Belief& zero, Scalar dt) const {
    const Belief none = zero;
    for (int k = 0; k < Imm<Models...>::kModes; ++k) {
      Belief one = none;
      master.models.propagate(k, one, dt);
      for (int i = 0; i < 6; ++i) zero.P(i, i) = math::larger(zero.P(i, i), one.P(i, i));
    }
  }
};

/// Corrects the belief stored from `at` on by `ekf`, in the lanes of `only` (null: all) where that
/// is valid; gives that belief and returns the logarithm of the echo's density.
template <class Lanes, class Value, class Ekf>
AUVEST_INLINE Value correct_stored(const Ekf& ekf, const math::Mask<Value>* only,
                                   typename Lanes::Scalar* at, Belief<Value, 6>& belief) {
  using math::all;
  load_belief<Lanes>(at, belief);
  Value log_density;
  math::Mask<Value> moved = ekf(belief, log_density);
  if (only != nullptr) moved = moved && *only;
  store_belief_where<Lanes>(moved, at, belief);
  if (!all(moved)) load_belief<Lanes>(at, belief);
  return log_density;
}

template <class... Models, class Lanes>
struct MasterBank<Imm<Models...>, Lanes> {
  using Master = Imm<Models...>;
  using Scalar = typename Lanes::Scalar;
  using Value = typename Lanes::Value;
  using Gaussian = Belief<Value, 6>;
  static constexpr int kModes = Master::kModes;
  static constexpr int kGaussian = 6 + triangle_numbers(6);
  static constexpr int kModeField = kGaussian;  ///< after the combined belief
  static constexpr int kWeightField = kModeField + kModes * kGaussian;
  static constexpr int kNumbers = kWeightField + kModes;

  static AUVEST_INLINE void begin(const Master& master, const Gaussian& belief, Scalar* at) {
    store_belief<Lanes>(at, belief);
    for (int k = 0; k < kModes; ++k) {
      store_belief<Lanes>(mode_at(at, k), belief);
      Lanes::store(weight_at(at, k), Value(master.log_share(k)));
    }
  }

  static AUVEST_INLINE void predict(const Master& master, Scalar dt,
                                    const Vector<Scalar, 2>* change, Scalar* at) {
    Bank bank(at);
    mix(bank.pointers, bank.log_weight, master.params.share, master.stay(dt));
    for (int k = 0; k < kModes; ++k) {
      master.models.propagate(k, bank.mode[k], dt);
      if (change != nullptr) add_planned_change(*change, dt, bank.mode[k].x);
    }
    bank.store(at);
  }

  /// A model whose belief would not be finite keeps the one it has and weighs nothing.
  template <class Ekf>
  static AUVEST_INLINE Value correct(const Ekf& ekf, const math::Mask<Value>* only, Scalar* at) {
    using math::larger;
    using math::select;
    Bank bank(at);
    Weights log_weight;
    for (int k = 0; k < kModes; ++k) {
      const Value density = correct_stored<Lanes>(ekf, only, mode_at(at, k), bank.mode[k]);
      log_weight(k) = larger(Value(no_log_weight<Scalar>()), bank.log_weight(k) + density);
    }
    const Value log_density = normalise(log_weight);
    for (int k = 0; k < kModes; ++k) {
      bank.log_weight(k) =
          only == nullptr ? log_weight(k) : select(*only, log_weight(k), bank.log_weight(k));
    }
    bank.store(at);
    return log_density;
  }

  /// The probability that model k moves the master.
  static AUVEST_INLINE Value probability(const Scalar* at, int k) {
    return weight_of(Value(Lanes::load(at + (kWeightField + k) * kBlock)));
  }

  /// Whether the numbers of one particle are those of a bank.
  static bool is_sound(const Scalar* at, const Extent<Scalar>& first) {
    bool sound = is_belief<6>(at, first);
    Scalar sum(0);
    for (int k = 0; k < kModes; ++k) {
      sound = sound && is_belief<6>(at + (kModeField + k * kGaussian) * kBlock, first);
      sum = sum + weight_of(at[(kWeightField + k) * kBlock]);
    }
    return sound && math::absolute(sum - Scalar(1)) < Scalar(1e-3);
  }

 private:
  using Weights = Vector<Value, kModes>;

  static AUVEST_INLINE Scalar* mode_at(Scalar* at, int k) {
    return at + (kModeField + k * kGaussian) * kBlock;
  }
  static AUVEST_INLINE Scalar* weight_at(Scalar* at, int k) {
    return at + (kWeightField + k) * kBlock;
  }

  /// The models' beliefs and the logarithms of their probabilities.
  struct Bank {
    Gaussian mode[kModes];
    Gaussian* pointers[kModes];
    Weights log_weight;

    explicit AUVEST_INLINE Bank(Scalar* at) {
      for (int k = 0; k < kModes; ++k) {
        load_belief<Lanes>(mode_at(at, k), mode[k]);
        pointers[k] = mode + k;
        log_weight(k) = Lanes::load(weight_at(at, k));
      }
    }

    AUVEST_INLINE void store(Scalar* at) const {
      Weights part;
      log_sum(log_weight, part);
      Gaussian combined;
      combine(pointers, part, combined);
      store_belief<Lanes>(at, combined);
      for (int k = 0; k < kModes; ++k) {
        store_belief<Lanes>(mode_at(at, k), mode[k]);
        Lanes::store(weight_at(at, k), log_weight(k));
      }
    }
  };
};

constexpr int power(int base, int exponent) {
  return exponent == 0 ? 1 : base * power(base, exponent - 1);
}

template <class Motion_, class... Models, int Masters, class Safeguards_>
class EkfSlat<Motion_, Imm<Models...>, Masters, Safeguards_>
    : public SlatFilter<Motion_, Masters, Safeguards_> {
 public:
  using Frame = SlatFilter<Motion_, Masters, Safeguards_>;
  using Motion = Motion_;
  using Master = Imm<Models...>;
  using Model = JointGaussian<Motion, typename Master::Model, Masters>;
  using typename Frame::Control;
  using typename Frame::MasterBelief;
  using typename Frame::Scalar;
  using typename Frame::SlaveBelief;
  using typename Frame::VelocityChange;
  using Params = EkfSlatParams<Scalar>;
  using BeliefType = typename Model::Joint;
  static constexpr int kPose = Model::kPose;
  static constexpr int kStates = Model::kStates;
  static constexpr int kModes = Master::kModes;
  static constexpr int kHypotheses = power(kModes, Masters);

  explicit EkfSlat(const Motion& motion = Motion(), const Master& master = Master(),
                   const Params& params = Params())
      : motion_(motion), master_(master), params_(params) {
    for (int h = 0; h < kHypotheses; ++h) {
      math::set_zero(belief_[h].x);
      math::set_zero(belief_[h].P);
      log_weight_(h) = no_log_weight<Scalar>();
    }
  }

  Status reset(const SlaveBelief& pose, math::Random&) {
    if (motion_.check() != Status::kOk || master_.check() != Status::kOk || !params_.valid()) {
      return Status::kBadParameter;
    }
    const Status status = check_start(pose);
    if (status != Status::kOk) return status;
    this->start(Frame::noise_of_an_hour(motion_, master_));
    Model::start(pose, belief_[0]);
    for (int h = 0; h < kHypotheses; ++h) log_weight_(h) = no_log_weight<Scalar>();
    log_weight_(0) = Scalar(0);
    hypotheses_ = 1;
    nis_ = Scalar(0);
    return Status::kOk;
  }

  /// Every hypothesis becomes kModes, one per model of the new master, by their shares.
  Status add_master(const MasterBelief& belief) {
    const Status status = this->check_master(belief);
    if (status != Status::kOk) return status;
    for (int h = 0; h < hypotheses_; ++h) {
      Model::put(belief, Model::first_of(masters_), belief_[h]);
    }
    for (int h = kModes * hypotheses_ - 1; h >= 0; --h) {
      const int origin = h % hypotheses_;
      if (h != origin) belief_[h] = belief_[origin];
      log_weight_(h) = log_weight_(origin) + master_.log_share(h / hypotheses_);
    }
    hypotheses_ = kModes * hypotheses_;
    safeguards_.begin(masters_);
    ++masters_;
    return Status::kOk;
  }

  Status predict(Scalar dt, const Control& u, math::Random&,
                 const VelocityChange* changes = nullptr) {
    Extent<Scalar> extent;
    for (int h = 0; h < hypotheses_; ++h) Frame::extend(belief_[h], 0, extent);
    const Status status =
        this->check_prediction(*this, dt, u, changes, params_.longest_step_s, extent);
    if (status != Status::kOk) return status;
    safeguards_.wait(dt, masters_);
    for (int n = 0; n < masters_; ++n) mix_models_of(n, master_.stay(dt));
    const typename Motion::Step step = motion_.step(u, dt);
    Model model(motion_, master_.model(0));
    for (int h = 0; h < hypotheses_; ++h) {
      for (int n = 0; n < masters_; ++n) model.master[n].chosen = mode_of(h, n);
      model.predict(step, dt, changes, masters_, belief_[h]);
    }
    return Status::kOk;
  }

  /// As EkfSlat without an Imm; whose the echoes of kUnknownMaster are is decided in each
  /// hypothesis. A hypothesis whose belief would not be finite keeps the one it has and weighs
  /// nothing. kOverflow: that is so for all.
  Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar, math::Random&) {
    const Status status = this->check_update(echoes, count, masters_, sonar);
    if (status != Status::kOk || count == 0) return status;
    Echo<Scalar> heard[Masters];  // those that are not the rebirth of a forgotten master
    int left = 0;
    for (int s = 0; s < count; ++s) {
      if (!is_forgotten(echoes[s])) heard[left++] = echoes[s];
    }
    Scalar refused[Masters] = {};
    if (left > 0 && !correct(heard, left, sonar, refused)) return Status::kOverflow;
    for (int s = 0; s < count; ++s) {
      if (is_forgotten(echoes[s])) rebirth(echoes[s], sonar);
    }
    for (int s = 0; s < left; ++s) {
      const int known = heard[s].master;
      if (known == kUnknownMaster) continue;
      if (!(refused[s] > Scalar(0.5))) {
        safeguards_.accepted(known);
      } else if (safeguards_.refused(known, place_of(sonar, heard[s].z, slave().x), heard[s].z(0),
                                     sonar.params, params_)) {
        rebirth(heard[s], sonar);
      }
    }
    return Status::kOk;
  }

  SlaveBelief slave() const { return Model::template part<kPose>(belief(), 0); }
  MasterBelief master(int n) const { return Model::template part<6>(belief(), Model::first_of(n)); }

  /// Slave and masters: mean and covariance over the hypotheses.
  BeliefType belief() const {
    BeliefType near[kHypotheses];
    const BeliefType* mode[kHypotheses];
    for (int h = 0; h < kHypotheses; ++h) {
      near[h] = belief_[h];
      unwrap(belief_[0].x(kPose - 1), near[h]);
      mode[h] = &near[h];
    }
    Weights part;
    log_sum(log_weight_, part);
    BeliefType all;
    combine(mode, part, all);
    wrap(all);
    return all;
  }

  /// The probability that model k moves master n.
  Scalar mode_probability(int n, int k) const {
    Weights part;
    log_sum(log_weight_, part);
    Scalar sum(0);
    for (int h = 0; h < hypotheses_; ++h) {
      if (mode_of(h, n) == k) sum = sum + part(h);
    }
    return sum;
  }

  Scalar nis() const { return nis_; }  ///< of the last update: mean over the hypotheses before it

  Scalar longest_step_s() const { return params_.longest_step_s; }

  /// As SlatFilter::visit_state.
  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    Frame::visit_state(self, visit);
    for (int h = 0; h < kHypotheses; ++h) visit(self.belief_[h]);
    visit(self.log_weight_);
    visit.count(self.hypotheses_, kHypotheses);
    visit(self.nis_);
  }

  /// Whether the hypotheses have covariances: to ask of a state that was put back.
  bool is_sound() const {
    for (int h = 0; h < hypotheses_; ++h) {
      if (check_slave(belief_[h]) != Status::kOk) return false;
    }
    return true;
  }

 private:
  using Weights = Vector<Scalar, kHypotheses>;
  using Frame::log_likelihood_;
  using Frame::masters_;
  using Frame::safeguards_;

  bool is_forgotten(const Echo<Scalar>& echo) const {
    return echo.master != kUnknownMaster && safeguards_.forgotten(echo.master, params_);
  }

  /// What the models knew of the master apart is forgotten, and so are their probabilities.
  void rebirth(const Echo<Scalar>& echo, const Sonar<Scalar>& sonar) {
    mix_models_of(echo.master, Scalar(0));
    for (int h = 0; h < hypotheses_; ++h) {
      Model::give_rebirth(echo.z, echo.master, sonar, params_, belief_[h]);
    }
    safeguards_.reborn(echo.master);
  }

  /// False, with nothing changed, where no hypothesis could follow. `refused`, zero before: the
  /// weight of the hypotheses to which an echo lies beyond the gate.
  bool correct(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
               Scalar (&refused)[Masters]) {
    bool heard = false;
    Scalar nis(0);
    Weights part;
    log_sum(log_weight_, part);
    Weights log_weight = log_weight_;
    for (int h = 0; h < hypotheses_; ++h) {
      Score<Scalar> score;
      Scalar each[Masters] = {};
      if (correct(echoes, count, sonar, belief_[h], score, each)) {
        heard = true;
        nis = nis + part(h) * score.nis;
        log_weight(h) = math::larger(no_log_weight<Scalar>(), log_weight(h) + score.log_density);
        for (int s = 0; s < count; ++s) {
          const bool beyond = params_.gate > Scalar(0) && each[s] > params_.gate;
          if (beyond) refused[s] = refused[s] + part(h);
        }
      } else {
        log_weight(h) = no_log_weight<Scalar>();
      }
    }
    if (!heard) return false;
    log_likelihood_ =
        log_likelihood_ + normalise(log_weight) - Scalar(count) * Frame::density_constant();
    log_weight_ = log_weight;
    nis_ = nis;
    return true;
  }

  static int mode_of(int hypothesis, int master) {
    return hypothesis / power(kModes, master) % kModes;
  }

  /// False, with `belief` as it was, where the result would not be finite. `score` is of all
  /// echoes, `nis` of each.
  bool correct(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
               BeliefType& belief, Score<Scalar>& score, Scalar (&nis)[Masters]) const {
    BeliefType moved = belief;
    int who[Masters];
    Model::identify(moved, echoes, count, masters_, sonar, params_.gate, who);
    score.nis = score.log_density = Scalar(0);
    for (int s = 0; s < count; ++s) {
      Score<Scalar> one;
      const SlaveBelief slave = Model::template part<kPose>(moved, 0);
      if (!Model::correct(echoes[s].z, who[s], sonar, params_.gate, moved, one)) return false;
      if (params_.consider) Model::put(slave, 0, moved);
      nis[s] = one.nis;
      score.nis = score.nis + one.nis;
      score.log_density = score.log_density + one.log_density;
    }
    belief = moved;
    return true;
  }

  /// Takes the slave's heading as near as possible to that of `reference`, so that means of
  /// headings are those of numbers.
  static void unwrap(Scalar reference, BeliefType& belief) {
    for (int i = 2; i < kPose; ++i) {
      belief.x(i) = reference + math::wrap(Scalar(belief.x(i) - reference));
    }
  }

  static void wrap(BeliefType& belief) {
    for (int i = 2; i < kPose; ++i) belief.x(i) = math::wrap(Scalar(belief.x(i)));
  }

  void mix_models_of(int n, Scalar stay) {
    const int stride = power(kModes, n);
    for (int h = 0; h < hypotheses_; ++h) {
      if (mode_of(h, n) != 0) continue;
      BeliefType* group[kModes];
      Vector<Scalar, kModes> log_weight;
      for (int k = 0; k < kModes; ++k) {
        group[k] = &belief_[h + k * stride];
        log_weight(k) = log_weight_(h + k * stride);
        unwrap(group[0]->x(kPose - 1), *group[k]);
      }
      mix(group, log_weight, master_.params.share, stay);
      for (int k = 0; k < kModes; ++k) {
        log_weight_(h + k * stride) = log_weight(k);
        wrap(*group[k]);
      }
    }
  }

  Motion motion_;
  Master master_;
  Params params_;
  BeliefType belief_[kHypotheses];
  Weights log_weight_;  ///< those from hypotheses_ on: of weight 0
  int hypotheses_ = 0;
  Scalar nis_ = Scalar(0);
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
