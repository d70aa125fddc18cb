// What the filters of this folder have in common: which calls they refuse, the count of the
// masters, and the likelihood of all echoes. They are exchangeable:
//
//     filter.reset(pose, random);                  // communication breaks
//     filter.add_master(belief);                   // one after the other, numbered from 0
//     filter.predict(dt, reading, random);         // at the rate of the odometry
//     filter.update(echoes, count, sonar, random); // at the rate of the sonar
//     filter.slave(), filter.master(n)             // Gaussian summaries
//
// SlatFilter is the frame of all; ParticleSlatFilter that of those with particles. A refused call
// leaves the filter as it was.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/particle_set.hpp"
#include "auvest/particles/resampling.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Masters: how many there may be.
template <class Motion_, int Masters>
class SlatFilter {
 public:
  using Motion = Motion_;
  using Scalar = typename Motion::Scalar;
  using Control = typename Motion::Control;
  static constexpr int kPose = Motion::kStates;
  static constexpr int kMasters = Masters;
  using SlaveBelief = Belief<Scalar, kPose>;
  using MasterBelief = Belief<Scalar, 6>;
  using VelocityChange = Vector<Scalar, 2>;

  int masters() const { return masters_; }
  Scalar log_likelihood() const { return log_likelihood_; }  ///< of all echoes since reset

  /// Hands all numbers of the state to `visit`, which keeps them, or overwrites them by those that
  /// were kept: to save a filter and to go on from there.
  template <class Visit>
  static void visit_state(const SlatFilter& self, Visit& visit) {
    visit_members(self, visit);
  }
  template <class Visit>
  static void visit_state(SlatFilter& self, Visit& visit) {
    visit_members(self, visit);
  }

 protected:
  /// What the log density of an echo has beside that of log_density(): log(2 pi), for two numbers.
  static constexpr Scalar density_constant() { return Scalar(1.8378770664); }

  /// A belief to start from. Only the lower triangle of P is read; it may be singular or zero.
  static Status check_slave(const SlaveBelief& pose) {
    if (!math::all_finite(pose)) return Status::kNotFinite;
    for (int i = 0; i < kPose; ++i) {
      if (pose.P(i, i) < Scalar(0)) return Status::kNotPositiveDefinite;
    }
    return Status::kOk;
  }

  /// One more master.
  Status check_master(const MasterBelief& belief) const {
    if (!initialised_) return Status::kNotInitialised;
    if (masters_ == Masters) return Status::kBadParameter;
    if (!math::all_finite(belief)) return Status::kNotFinite;
    return math::is_positive_definite(belief.P) ? Status::kOk : Status::kNotPositiveDefinite;
  }

  Status check_prediction(Scalar dt, const Control& u, const VelocityChange* changes) const {
    if (!initialised_) return Status::kNotInitialised;
    if (!math::is_finite(dt) || !math::all_finite(u)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    return plan_finite(changes, masters_) ? Status::kOk : Status::kNotFinite;
  }

  /// Echoes of `masters` masters, each at most once.
  Status check_update(const Echo<Scalar>* echoes, int count, int masters,
                      const Sonar<Scalar>& sonar) const {
    return initialised_ ? check_echoes(echoes, count, masters, sonar, kPose)
                        : Status::kNotInitialised;
  }

  /// The slave is where the caller has put it, and there is no master.
  void start() {
    masters_ = 0;
    log_likelihood_ = Scalar(0);
    initialised_ = true;
  }

  int masters_ = 0;
  Scalar log_likelihood_ = Scalar(0);
  bool initialised_ = false;

 private:
  template <class Self, class Visit>
  static void visit_members(Self& self, Visit& visit) {
    visit.count(self.initialised_, true);
    visit.count(self.masters_, Masters);
    visit(self.log_likelihood_);
  }
};

/// The frame of a filter whose particles lie in a Set_ (particle_set.hpp).
///
/// Such a filter is not copyable: its particles are the caller's, who alone knows how many there
/// are and where others may lie (a static array on a chip, NumPy's memory in Python), and two
/// filters on the same particles would be one. A filter that owned them would need their number at
/// compile time. So a copy says where its particles are to lie: Filter copy(filter, storage).
template <class Motion, int Masters, class Set_, class Resampling_>
class ParticleSlatFilter : public SlatFilter<Motion, Masters> {
 public:
  using Frame = SlatFilter<Motion, Masters>;
  using typename Frame::Scalar;
  using Resampling = Resampling_;
  using Set = Set_;
  template <int Capacity>
  using Storage = ParticleStorage<Scalar, Set::kFields, Capacity>;

  int particles() const { return set_.size(); }
  Scalar effective_size() const { return effective_size_; }  ///< N_eff before any resampling
  int resamplings() const { return resamplings_; }           ///< since reset
  const Set& set() const { return set_; }

  /// As SlatFilter::visit_state.
  template <class Visit>
  static void visit_state(const ParticleSlatFilter& self, Visit& visit) {
    visit_members(self, visit);
  }
  template <class Visit>
  static void visit_state(ParticleSlatFilter& self, Visit& visit) {
    visit_members(self, visit);
  }

 protected:
  /// The particles live in `storage`, which holds at least Set::storage_size(capacity) numbers and
  /// must outlive the filter. resample_below: share of N, see normalise_and_resample().
  ParticleSlatFilter(Scalar* storage, int capacity, const Resampling& resampling)
      : set_(storage, capacity), resampling_(resampling) {}

  /// `storage` is as large as that of `other`.
  ParticleSlatFilter(const ParticleSlatFilter& other, Scalar* storage)
      : Frame(other),
        set_(other.set_, storage),
        resampling_(other.resampling_),
        resamplings_(other.resamplings_),
        effective_size_(other.effective_size_) {}

  static bool is_share(Scalar value) { return value >= Scalar(0) && value <= Scalar(1); }

  bool fits(int particles) const { return particles > 0 && particles <= set_.capacity(); }

  /// So many particles of equal weights, and no master.
  void start(int particles) {
    Frame::start();
    set_.resize(particles);
    resamplings_ = 0;
    effective_size_ = Scalar(particles);
    equal_weights(set_);
  }

  /// Section 6, step 4, after an update by `count` echoes: normalises the weights, and resamples
  /// where N_eff is below `resample_below` times N.
  template <class Lanes>
  AUVEST_OUTLINE void normalise_and_resample(int count, Scalar resample_below,
                                             math::Random& random) {
    const WeightSummary<Scalar> summary = normalise<Lanes>(set_);  // [SLATF 32]
    effective_size_ = summary.effective_size;                      // [SLATF 33]
    this->log_likelihood_ =
        this->log_likelihood_ + (summary.log_sum - Scalar(count) * Frame::density_constant());
    if (effective_size_ < resample_below * Scalar(set_.size())) {
      resample<Lanes>(resampling_, set_, random);
      ++resamplings_;
    }
  }

  Set set_;

 private:
  template <class Self, class Visit>
  static void visit_members(Self& self, Visit& visit) {
    Frame::visit_state(self, visit);
    visit(self.set_);
    visit(self.effective_size_);
    visit.count(self.resamplings_);
  }

  Resampling resampling_;
  int resamplings_ = 0;
  Scalar effective_size_ = Scalar(0);
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
