// What the Kalman filters of auvest have in common: a Gaussian belief, the split into predict and
// update, and the promise that a refused call leaves the belief as it was.
//
// A filter derives from GaussianFilter<Itself, Process> and offers
//
//     Status check()
//         kOk, or kBadParameter if a parameter of the process or the filter is out of range
//     Status predict_belief(belief, dt)
//         belief after dt seconds
//     Status linearise(model, x, factor, z, innovation, A, E)
//         the measurement in the coordinates of the factor L of P (see square_root_update.hpp)
#pragma once

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

template <class Derived, class Process_>
class GaussianFilter {
 public:
  using Process = Process_;
  using Scalar = typename Process::Scalar;
  static constexpr int kStates = Process::kStates;
  using State = Vector<Scalar, kStates>;
  using Covariance = Matrix<Scalar, kStates, kStates>;
  using BeliefType = Belief<Scalar, kStates>;

  explicit GaussianFilter(const Process& process) : process_(process), initialised_(false) {
    belief_.x.setZero();
    belief_.P.setZero();
  }

  /// Sets the belief. Only the lower triangle of P0 is read.
  Status reset(const State& x0, const Covariance& P0) {
    const Status status = derived().check();
    if (status != Status::kOk) return status;
    if (!math::all_finite(x0) || !math::lower_finite(P0)) return Status::kNotFinite;
    if (!math::is_positive_definite(P0)) return Status::kNotPositiveDefinite;
    belief_.x = x0;
    belief_.P = P0;
    initialised_ = true;
    return Status::kOk;
  }

  /// Takes back a belief saved from belief(): the same bits go on.
  Status restore(const BeliefType& saved) {
    if (!math::all_finite(saved.x) || !math::lower_finite(saved.P)) return Status::kNotFinite;
    Covariance p = saved.P;
    if (!math::ldlt(p)) return Status::kNotPositiveDefinite;
    belief_ = saved;
    initialised_ = true;
    return Status::kOk;
  }

  /// Carries the belief dt >= 0 seconds forward.
  Status predict(Scalar dt) {
    if (!initialised_) return Status::kNotInitialised;
    if (!math::is_finite(dt)) return Status::kNotFinite;
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    const BeliefType before = belief_;
    const Status status = derived().predict_belief(belief_, dt);
    return keep(status, math::all_finite(belief_.x) && math::lower_finite(belief_.P), before);
  }

  /// Corrects the belief by the measurement z of a sensor described by `model`.
  template <class Model>
  Correction<Scalar, Model::kSize> update(const typename Model::Measurement& z,
                                          const Model& model) {
    static_assert(Model::kStates == kStates, "the measurement model is for another state");
    constexpr int kSize = Model::kSize;
    Correction<Scalar, kSize> correction(Status::kOk);
    correction.status = correct(z, model, correction);
    if (correction.status != Status::kOk) {
      correction = Correction<Scalar, kSize>(correction.status);
    }
    return correction;
  }

  const State& x() const { return belief_.x; }

  /// The covariance, both triangles.
  Covariance P() const {
    Covariance p = belief_.P;
    math::mirror_lower(p);
    return p;
  }

  /// The belief as the filter holds it: only the lower triangle of its P has a meaning.
  const BeliefType& belief() const { return belief_; }
  bool initialised() const { return initialised_; }
  const Process& process() const { return process_; }

 protected:
  /// A = (H L)' for the first Observed columns of the factor.
  template <class Jacobian, int Observed, int Size>
  static void project(const Jacobian& h, const Covariance& factor,
                      Matrix<Scalar, Observed, Size>& a) {
    for (int k = 0; k < Observed; ++k) {
      for (int m = 0; m < Size; ++m) {
        Scalar sum = h(m, k) * factor(k, k);
        for (int i = k + 1; i < Observed; ++i) sum = sum + h(m, i) * factor(i, k);
        a(k, m) = sum;
      }
    }
  }

 private:
  const Derived& derived() const { return static_cast<const Derived&>(*this); }

  template <class Model>
  AUVEST_INLINE Status correct(const typename Model::Measurement& z, const Model& model,
                               Correction<Scalar, Model::kSize>& correction) {
    if (!initialised_) return Status::kNotInitialised;
    if (!math::all_finite(z)) return Status::kNotFinite;

    const BeliefType before = belief_;
    const Status status = correct_belief(z, model, correction);
    bool finite = math::all_finite(belief_.x);  // P is a square: finite if its diagonal is
    AUVEST_UNROLL
    for (int i = 0; i < kStates; ++i) finite = finite && math::is_finite(belief_.P(i, i));
    return keep(status, finite, before);
  }

  template <class Model>
  AUVEST_INLINE Status correct_belief(const typename Model::Measurement& z, const Model& model,
                                      Correction<Scalar, Model::kSize>& correction) {
    constexpr int kSize = Model::kSize;
    constexpr int kObserved = Model::kObserved;
    Matrix<Scalar, kObserved, kSize> a;
    Matrix<Scalar, kSize, kSize> noise;
    typename Model::View view;
    correction.near_field = model.near_field(belief_, z, view);
    if (!math::partial_cholesky<kObserved>(belief_.P)) return Status::kNotPositiveDefinite;
    if (correction.near_field) {
      correction.innovation = view.innovation;
      project(view.H, belief_.P, a);
      noise = view.R;
    } else {
      const Status status =
          derived().linearise(model, belief_.x, belief_.P, z, correction.innovation, a, noise);
      if (status != Status::kOk) return status;
    }
    const Status status = square_root_update<kSize>(belief_, a, noise, correction);
    if (status != Status::kOk) return status;
    return math::is_finite(correction.nis) ? Status::kOk : Status::kOverflow;
  }

  /// Keeps the new belief if the operation that made it went well and it is finite; takes back
  /// `before` otherwise. (A copy that nobody waits for costs less than one at the end would.)
  AUVEST_INLINE Status keep(Status status, bool finite, const BeliefType& before) {
    if (status == Status::kOk && !finite) status = Status::kOverflow;
    if (status != Status::kOk) belief_ = before;
    return status;
  }

  Process process_;
  BeliefType belief_;
  bool initialised_;
};

}  // namespace auvest
