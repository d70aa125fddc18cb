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

#include <limits>

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/resolution.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/particles/lanes.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/mixture.hpp"
#include "auvest/particles/particle_set.hpp"
#include "auvest/particles/resampling.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/safeguards.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// What a master's models add to a covariance of zero in dt seconds, at least on the diagonal.
template <class Master>
struct NoiseOf {
  const Master& master;

  template <class Belief, class Scalar>
  void propagate(Belief& zero, Scalar dt) const {
    master.propagate(zero, dt);
  }
};

/// How large the numbers of slave and masters are: the squares of the largest position, velocity
/// and acceleration, or variance of one.
template <class Scalar>
struct Extent {
  Scalar square[3] = {Scalar(0), Scalar(0), Scalar(0)};
};

/// A belief of the slave. Only the lower triangle of P is read; it may be singular or zero.
template <class Scalar, int Pose>
Status check_slave(const Belief<Scalar, Pose>& pose) {
  if (!math::all_finite(pose)) return Status::kNotFinite;
  for (int i = 0; i < Pose; ++i) {
    if (pose.P(i, i) < Scalar(0)) return Status::kNotPositiveDefinite;
    for (int j = 0; j < i; ++j) {
      // A correlation of 1 may be a little more by rounding.
      const Scalar most = Scalar(1.0001) * math::sqrt(pose.P(i, i)) * math::sqrt(pose.P(j, j));
      if (math::absolute(pose.P(i, j)) > most) return Status::kNotPositiveDefinite;
    }
  }
  return Status::kOk;
}

/// Whether the format is coarse at the belief's place, of slave or master, against its P.
template <class Scalar, int N>
AUVEST_OUTLINE bool is_far(const Belief<Scalar, N>& belief) {
  return math::is_coarse(belief.x(0), belief.P(0, 0)) ||
         math::is_coarse(belief.x(1), belief.P(1, 1));
}

/// The largest number or sigma of state i: a position as an echo, and speeds, accelerations and
/// angles far beyond any, whose products with those of other states are still finite.
template <class Scalar>
constexpr Scalar largest_number(int i) {
  return i < 2 ? Scalar(1e9) : Scalar(1e6);
}

/// What a start says of a belief of n states: kOverflow where a number or a sigma is beyond
/// largest_number(), or a variance so small that sums of products or its inverse would not be
/// finite in single precision; kFarFromOrigin where the format is coarse at its position
/// (math/resolution.hpp).
template <class Scalar>
AUVEST_COLD Status check_numbers(const Scalar* x, const Scalar* P, int n) {
  for (int i = 0; i < n; ++i) {
    const Scalar variance = P[i * (n + 1)];
    const Scalar largest = largest_number<Scalar>(i);
    if (i < 2 && math::is_coarse(x[i], variance)) return Status::kFarFromOrigin;
    const bool inverts = variance == Scalar(0) || variance >= Scalar(1e-30);
    if (!inverts || !(variance <= largest * largest && math::absolute(x[i]) <= largest)) {
      return Status::kOverflow;
    }
  }
  return Status::kOk;
}

template <class Scalar, int N>
Status check_numbers(const Belief<Scalar, N>& belief) {
  return check_numbers(belief.x.data(), belief.P.data(), N);
}

/// Whether a particle's belief of N states, whose first field is `from`, has a covariance, and
/// numbers such as come about beside those of the first particle: an echo from 1e9 m away, which a
/// gate that is off lets pass, throws a master's velocity beyond largest_number(), in all
/// particles.
template <int N, class Scalar>
bool is_belief(const Scalar* from, const Extent<Scalar>& first) {
  Belief<Scalar, N> belief;
  load_belief<OneLane<Scalar>>(from, belief);
  bool sound = check_slave(belief) == Status::kOk;
  for (int i = 2; i < N; ++i) {
    const Scalar most = largest_number<Scalar>(i);
    const Scalar thrown = N == 6 ? Scalar(100) * first.square[i / 2] : Scalar(0);
    sound = sound && belief.x(i) * belief.x(i) <= math::larger(most * most, thrown);
  }
  return sound;
}

/// A belief of the slave that a filter may start from: as check_slave, and its numbers.
template <class Scalar, int Pose>
Status check_start(const Belief<Scalar, Pose>& pose) {
  const Status status = check_slave(pose);
  return status == Status::kOk ? check_numbers(pose) : status;
}

/// A belief of a master that a filter does not have yet. Only the lower triangle of P is read.
template <class Scalar>
Status check_newcomer(const Belief<Scalar, 6>& master) {
  if (!math::all_finite(master.x) || !math::lower_finite(master.P)) return Status::kNotFinite;
  return math::is_positive_definite(master.P) ? check_numbers(master)
                                              : Status::kNotPositiveDefinite;
}

/// Masters: how many there may be. Safeguards_: see safeguards.hpp.
template <class Motion_, int Masters, class Safeguards_ = NoSafeguards>
class SlatFilter {
 public:
  using Motion = Motion_;
  using Safeguards = Safeguards_;
  using Scalar = typename Motion::Scalar;
  using Control = typename Motion::Control;
  static constexpr int kPose = Motion::kStates;
  static constexpr int kMasters = Masters;
  using SlaveBelief = Belief<Scalar, kPose>;
  using MasterBelief = Belief<Scalar, 6>;
  using VelocityChange = Vector<Scalar, 2>;

  int masters() const { return masters_; }
  Scalar log_likelihood() const { return log_likelihood_; }  ///< of all echoes since reset
  /// Echoes refused and masters born again since reset.
  const Safeguards& safeguards() const { return safeguards_; }

  /// What predict() will say of its arguments in a filter with numbers of that extent. Does not ask
  /// whether the filter has started.
  static Status check_step(Scalar dt, const Control& u, const VelocityChange* changes, int masters,
                           Scalar longest_step_s, const Extent<Scalar>& extent,
                           Scalar hourly_noise) {
    if (!math::is_finite(dt) || !math::all_finite(u)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    if (dt > longest_step_s) return Status::kStepTooLong;
    if (!plan_finite(changes, masters)) return Status::kNotFinite;
    // A heading is no speed, but one as large as this is none either.
    Scalar speed = math::larger(math::absolute(u(0)), math::absolute(u(1)));
    for (int n = 0; changes != nullptr && n < masters; ++n) {
      for (int axis = 0; axis < 2; ++axis) {
        speed = math::larger(speed, math::absolute(changes[n](axis)));
      }
    }
    bool moderate = dt <= Scalar(kHour) && speed <= Scalar(1e4) && hourly_noise <= Scalar(1e16);
    for (const Scalar& square : extent.square) moderate = moderate && square <= Scalar(1e16);
    return moderate || stays_finite(dt, speed, extent, hourly_noise) ? Status::kOk
                                                                     : Status::kOverflow;
  }

  /// Takes into `extent` the N states of a belief, which are those of slave and masters from state
  /// `first` on.
  template <int N>
  static void extend(const Belief<Scalar, N>& belief, int first, Extent<Scalar>& extent) {
    for (int i = 0; i < N; ++i) {
      const int state = first + i - kPose;
      Scalar& most = extent.square[state < 0 ? 0 : state % 6 / 2];
      const Scalar square = belief.x(i) * belief.x(i);
      if (!(square <= most)) most = square;  // a NaN, too
      if (!(belief.P(i, i) <= most)) most = belief.P(i, i);
    }
  }
  template <int N>
  static Extent<Scalar> extent_of(const Belief<Scalar, N>& belief) {
    Extent<Scalar> extent;
    extend(belief, 0, extent);
    return extent;
  }

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

  /// One more master.
  Status check_master(const MasterBelief& belief) const {
    if (!initialised_) return Status::kNotInitialised;
    if (masters_ == Masters) return Status::kBadParameter;
    return check_newcomer(belief);
  }

  /// kFarFromOrigin where `self`, this filter, has drifted so far that its slave would stand still.
  template <class Self>
  Status check_prediction(const Self& self, Scalar dt, const Control& u,
                          const VelocityChange* changes, Scalar longest_step_s,
                          const Extent<Scalar>& extent) const {
    if (!initialised_) return Status::kNotInitialised;
    const Status status =
        check_step(dt, u, changes, masters_, longest_step_s, extent, hourly_noise_);
    if (status != Status::kOk || !math::may_be_coarse(extent.square[0])) return status;
    return is_far(self.slave()) ? Status::kFarFromOrigin : Status::kOk;
  }

  /// The largest number that an hour of noise puts into a covariance, for check_step(). Not worth
  /// its flash where nothing is guarded: then 0.
  template <bool Guarded = Safeguards::kActive, class Master>
  static Scalar noise_of_an_hour(const Motion& motion, const Master& master) {
    if (!Guarded) return Scalar(0);
    SlaveBelief pose;
    MasterBelief landmark;
    math::set_zero(pose.x);
    math::set_zero(pose.P);
    math::set_zero(landmark.x);
    math::set_zero(landmark.P);
    Control u;
    u(0) = u(1) = Scalar(1);
    motion.propagate(motion.step(u, Scalar(kHour)), pose);
    NoiseOf<Master>{master}.propagate(landmark, Scalar(kHour));
    Scalar most(0);
    for (int i = 0; i < kPose; ++i) most = math::larger(most, pose.P(i, i));
    for (int i = 0; i < 6; ++i) most = math::larger(most, landmark.P(i, i));
    return most;
  }

  /// Echoes of `masters` masters, each at most once.
  Status check_update(const Echo<Scalar>* echoes, int count, int masters,
                      const Sonar<Scalar>& sonar) const {
    return initialised_ ? check_echoes(echoes, count, masters, sonar, kPose)
                        : Status::kNotInitialised;
  }

  /// The slave is where the caller has put it, and there is no master.
  void start(Scalar hourly_noise) {
    masters_ = 0;
    log_likelihood_ = Scalar(0);
    initialised_ = true;
    const Scalar most = (std::numeric_limits<Scalar>::max)();
    hourly_noise_ = hourly_noise <= most ? hourly_noise : most;  // a number: it is saved
    safeguards_.restart();
  }

  int masters_ = 0;
  Scalar log_likelihood_ = Scalar(0);
  Scalar hourly_noise_ = Scalar(0);
  bool initialised_ = false;
  Safeguards safeguards_;

 private:
  static constexpr int kHour = 3600;

  /// A master moves by x + v dt + a dt^2 / 2, the slave by its way, which its heading turns. Eight
  /// digits are left for sums and products of the squares, and more for an echo that finds the
  /// slave at the end of its way.
  static AUVEST_COLD bool stays_finite(Scalar dt, Scalar speed, const Extent<Scalar>& extent,
                                       Scalar noise) {
    const Scalar hours = math::larger(Scalar(1), dt / Scalar(kHour));
    const Scalar way = dt * speed;
    const Scalar here = math::sqrt(extent.square[0]);
    const Scalar there = here + dt * math::sqrt(extent.square[1]) +
                         Scalar(0.5) * dt * dt * math::sqrt(extent.square[2]);
    const Scalar most = math::sqrt(Scalar(1e-8) * (std::numeric_limits<Scalar>::max)());
    return speed <= Scalar(1e6) && way <= Scalar(1e9) && there + way * (Scalar(1) + here) <= most &&
           math::sqrt(noise) * (hours * hours) * (Scalar(1) + speed) <= most;
  }

  template <class Self, class Visit>
  static void visit_members(Self& self, Visit& visit) {
    visit.count(self.initialised_, true);
    visit.count(self.masters_, Masters);
    visit(self.log_likelihood_);
    visit(self.hourly_noise_);
    Safeguards::visit_state(self.safeguards_, visit);
  }
};

/// The weight of the particles to which each echo of an update lies beyond the gate. The sums run
/// over the particles in their order, whatever the lanes.
template <class Scalar, int Masters>
struct RefusedWeight {
  Scalar of[Masters];

  RefusedWeight() {
    for (Scalar& weight : of) weight = Scalar(0);
  }

  /// Adds the particles of a group that refuse echo s: mostly none.
  template <class Group, class Mask>
  AUVEST_INLINE void add(int s, const Mask& beyond, const Scalar* log_weights) {
    using math::any;
    if (any(beyond)) add_some<Group>(s, beyond, log_weights);
  }

 private:
  template <class Group, class Mask>
  AUVEST_COLD void add_some(int s, Mask beyond, const Scalar* log_weights) {
    using math::select;
    using Lanes = typename Group::Weights;
    using Value = typename Lanes::Value;
    Scalar weight[Group::kParticles];
    Lanes::store(weight, select(beyond, weight_of(Value(Lanes::load(log_weights))), Value(0)));
    for (Scalar one : weight) of[s] = of[s] + one;
  }
};

/// The frame of a filter whose particles lie in a Set_ (particle_set.hpp).
///
/// Such a filter is not copyable: its particles are the caller's, who alone knows how many there
/// are and where others may lie (a static array on a chip, NumPy's memory in Python), and two
/// filters on the same particles would be one. A filter that owned them would need their number at
/// compile time. So a copy says where its particles are to lie: Filter copy(filter, storage).
template <class Motion, int Masters, class Set_, class Resampling_, class Safeguards>
class ParticleSlatFilter : public SlatFilter<Motion, Masters, Safeguards> {
 public:
  using Frame = SlatFilter<Motion, Masters, Safeguards>;
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
  void start(int particles, Scalar hourly_noise) {
    Frame::start(hourly_noise);
    set_.resize(particles);
    resamplings_ = 0;
    effective_size_ = Scalar(particles);
    equal_weights(set_);
  }

  /// Section 6, step 4, after an update by `count` echoes: normalises the weights, and resamples
  /// where N_eff is below `resample_below` times N; calls before() first.
  template <class Lanes, class Before>
  AUVEST_OUTLINE void normalise_and_resample(int count, Scalar resample_below, math::Random& random,
                                             const Before& before) {
    const WeightSummary<Scalar> summary = normalise<Lanes>(set_);  // [SLATF 32]
    effective_size_ = summary.effective_size;                      // [SLATF 33]
    this->log_likelihood_ =
        this->log_likelihood_ + (summary.log_sum - Scalar(count) * Frame::density_constant());
    if (effective_size_ < resample_below * Scalar(set_.size())) {
      before();
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
