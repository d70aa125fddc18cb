// EKF-SLAT: slave and masters in one Gaussian. What a user would take instead of particles, and the
// yardstick for them.
//
// State: the slave's pose, then six numbers per master. The interface is that of Slatf; random
// generators are taken and not used, so that the filters are exchangeable.
#pragma once

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
#include "auvest/slat/likelihood.hpp"
#include "auvest/slat/sighting.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

template <class Motion_, class Master_, int Masters>
class EkfSlat {
 public:
  using Motion = Motion_;
  using Master = Master_;
  using Scalar = typename Motion::Scalar;
  using Control = typename Motion::Control;
  static constexpr int kPose = Motion::kStates;
  static constexpr int kMasters = Masters;
  static constexpr int kStates = kPose + 6 * Masters;
  using SlaveBelief = Belief<Scalar, kPose>;
  using MasterBelief = Belief<Scalar, 6>;
  using BeliefType = Belief<Scalar, kStates>;
  using VelocityChange = Vector<Scalar, 2>;

  struct Params {
    /// An echo whose NIS (2 degrees of freedom) exceeds this says nothing; 0: no gate.
    Scalar gate = Scalar(0);
  };

  EkfSlat(const Motion& motion, const Master& master, const Params& params = Params())
      : motion_(motion), master_(master), params_(params), initialised_(false) {
    math::set_zero(belief_.x);
    math::set_zero(belief_.P);
  }

  /// Only the lower triangle of pose.P is read; it may be singular. There is no master yet.
  Status reset(const SlaveBelief& pose, math::Random&) {
    if (motion_.check() != Status::kOk || master_.check() != Status::kOk ||
        !(params_.gate >= Scalar(0))) {
      return Status::kBadParameter;
    }
    if (!math::all_finite(pose.x) || !math::lower_finite(pose.P)) return Status::kNotFinite;
    math::set_zero(belief_.x);
    math::set_zero(belief_.P);
    for (int i = 0; i < kPose; ++i) {
      belief_.x(i) = pose.x(i);
      for (int j = 0; j <= i; ++j) belief_.P(i, j) = pose.P(i, j);
    }
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
    const int first = kPose + 6 * masters_;
    for (int i = 0; i < 6; ++i) {
      belief_.x(first + i) = belief.x(i);
      for (int j = 0; j <= i; ++j) belief_.P(first + i, first + j) = belief.P(i, j);
    }
    ++masters_;
    return Status::kOk;
  }

  Status predict(Scalar dt, const Control& u, math::Random&,
                 const VelocityChange* changes = nullptr) {
    if (!initialised_) return Status::kNotInitialised;
    if (!math::is_finite(dt) || !math::all_finite(u)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    if (!plan_finite(changes, masters_)) return Status::kNotFinite;

    SlaveBelief pose = slave();
    const typename Motion::Step step = motion_.step(u, dt);
    Matrix<Scalar, kStates, kStates> phi;
    Matrix<Scalar, kStates, kStates> q;
    math::set_zero(phi);
    math::set_zero(q);
    for (int i = 0; i < kStates; ++i) phi(i, i) = Scalar(1);
    put(motion_.transition(step, pose.x), 0, phi);
    put(motion_.noise(step, pose.x), 0, q);
    motion_.propagate(step, pose);
    for (int i = 0; i < kPose; ++i) belief_.x(i) = pose.x(i);
    for (int n = 0; n < masters_; ++n) {
      const int first = kPose + 6 * n;
      Vector<Scalar, 6> x;
      for (int i = 0; i < 6; ++i) x(i) = belief_.x(first + i);
      put(master_.Phi(x, dt), first, phi);
      put(master_.Q(dt), first, q);
      x = master_.f(x, dt);
      if (changes != nullptr) add_planned_change(changes[n], dt, x);
      for (int i = 0; i < 6; ++i) belief_.x(first + i) = x(i);
    }
    belief_.P = math::symmetric_product(phi, belief_.P);
    for (int i = 0; i < kStates; ++i) {
      for (int j = 0; j <= i; ++j) belief_.P(i, j) = belief_.P(i, j) + q(i, j);
    }
    return Status::kOk;
  }

  /// kOverflow: the belief would not be finite; the echoes before that one have been taken in.
  Status update(const Sighting<Scalar>* sightings, int count, const Sonar<Scalar>& sonar,
                math::Random&) {
    if (!initialised_) return Status::kNotInitialised;
    const Status status = check_sightings(sightings, count, masters_, sonar, kPose, true);
    if (status != Status::kOk || count == 0) return status;
    nis_ = Scalar(0);
    for (int s = 0; s < count; ++s) {
      const Status corrected = correct(sightings[s], sonar);
      if (corrected != Status::kOk) return corrected;
    }
    return Status::kOk;
  }

  SlaveBelief slave() const { return part<kPose>(0); }
  MasterBelief master(int n) const { return part<6>(kPose + 6 * n); }

  /// Slave and masters, only the lower triangle of P; masters that were not added are zero.
  const BeliefType& belief() const { return belief_; }
  int masters() const { return masters_; }
  Scalar nis() const { return nis_; }  ///< of the last update: chi-square, 2 degrees per sighting
  Scalar log_likelihood() const { return log_likelihood_; }  ///< of all sightings since reset

 private:
  template <int N>
  static void put(const Matrix<Scalar, N, N>& block, int first,
                  Matrix<Scalar, kStates, kStates>& whole) {
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j < N; ++j) whole(first + i, first + j) = block(i, j);
    }
  }

  template <int N>
  Belief<Scalar, N> part(int first) const {
    Belief<Scalar, N> belief;
    for (int i = 0; i < N; ++i) {
      belief.x(i) = belief_.x(first + i);
      for (int j = 0; j <= i; ++j) {
        belief.P(i, j) = belief.P(j, i) = belief_.P(first + i, first + j);
      }
    }
    return belief;
  }

  /// The place of state i when the master seen stands first among the masters: the update factors
  /// the leading states that the sonar sees.
  static int swapped(int i, int master) {
    const int own = (i - kPose) / 6;
    if (i < kPose || (own != 0 && own != master)) return i;
    return own == 0 ? i + 6 * master : i - 6 * master;
  }

  Status correct(const Sighting<Scalar>& sighting, const Sonar<Scalar>& sonar) {
    constexpr int kObserved = kPose + 2;
    BeliefType ordered;
    for (int i = 0; i < kStates; ++i) {
      const int from = swapped(i, sighting.master);
      ordered.x(i) = belief_.x(from);
      for (int j = 0; j <= i; ++j) ordered.P(i, j) = covariance(from, swapped(j, sighting.master));
    }
    Vector<Scalar, kPose> pose;
    for (int i = 0; i < kPose; ++i) pose(i) = ordered.x(i);
    typename Sonar<Scalar>::template View<Scalar, kPose> view;
    sonar.look(pose, ordered.x(kPose), ordered.x(kPose + 1), sighting.z, view);
    Matrix<Scalar, 2, kObserved> h;
    for (int m = 0; m < 2; ++m) {
      for (int i = 0; i < kPose; ++i) h(m, i) = view.by_slave(m, i);
      for (int i = 0; i < 2; ++i) h(m, kPose + i) = view.by_master(m, i);
    }
    Matrix<Scalar, kObserved, kObserved> root;
    Matrix<Scalar, math::other_states(kStates, kObserved), kObserved> slope;
    math::factor_leading<math::DropLostPivots>(ordered.P, root, slope);
    Matrix<Scalar, 2, kObserved> a;
    project(h, root, a);
    Matrix<Scalar, 2, 2> noise = sonar.template R<Scalar>();
    Posterior<Scalar, kObserved> posterior;
    const bool valid = potter(a, noise, view.innovation, posterior);
    const Scalar nis = posterior.nis;
    if (params_.gate > Scalar(0)) saturate(params_.gate, posterior);
    if (!valid || !move_belief(ordered, root, slope, posterior)) return Status::kOverflow;
    nis_ = nis_ + nis;
    log_likelihood_ =
        log_likelihood_ + log_density(valid, posterior, noise) - Scalar(1.8378770664);  // log(2 pi)

    for (int i = 0; i < kStates; ++i) {
      const int to = swapped(i, sighting.master);
      belief_.x(to) = ordered.x(i);
      for (int j = 0; j <= i; ++j) {
        const int column = swapped(j, sighting.master);
        belief_.P(to > column ? to : column, to > column ? column : to) = ordered.P(i, j);
      }
    }
    for (int k = 2; k < kPose; ++k) belief_.x(k) = math::wrap(belief_.x(k));  // the heading
    return Status::kOk;
  }

  Scalar covariance(int i, int j) const { return i >= j ? belief_.P(i, j) : belief_.P(j, i); }

  Motion motion_;
  Master master_;
  Params params_;
  BeliefType belief_;
  int masters_ = 0;
  Scalar nis_ = Scalar(0);
  Scalar log_likelihood_ = Scalar(0);
  bool initialised_;
};

}  // namespace auvest
