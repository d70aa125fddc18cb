// What the Kalman filters of auvest have in common: a Gaussian belief, the split into predict and
// update, and the promise that a refused call leaves the belief as it was.
//
// A filter derives from GaussianFilter<Itself, Process> and offers
//
//     Status predict_belief(belief, dt)
//         belief after dt seconds
//     Status linearise(model, point, root, z, innovation, A, E)
//         the measurement about point = model.about(x), in the coordinates of the root L of P_oo
//         (see square_root_update.hpp)
#pragma once

#include <cstring>
#include <limits>

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/resolution.hpp"
#include "auvest/models/measurement_model.hpp"
#include "auvest/models/process_model.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Derived, class Process_>
class GaussianFilter {
 public:
  using Process = Process_;
  using Scalar = typename Process::Scalar;
  static constexpr int kStates = Process::kStates;
  using State = Vector<Scalar, kStates>;
  using Covariance = Matrix<Scalar, kStates, kStates>;
  using BeliefType = Belief<Scalar, kStates>;
  static constexpr int kLongestStep = 3600;  ///< what longest_step_s() is unless it is set [s]

  /// `check` says whether all parameters are in range: asked once, and where they are constants, by
  /// the compiler.
  GaussianFilter(const Process& process, Status check)
      : process_(process),
        longest_step_(Scalar(kLongestStep)),
        ready_(check == Status::kOk ? Status::kNotInitialised : check) {
    math::set_zero(belief_.x);
    math::set_zero(belief_.P);
  }

  /// Sets the belief. Only the lower triangle of P0 is read. kFarFromOrigin where the position is
  /// too large for the format to tell apart what P0 does: coordinates count from an origin nearby.
  Status reset(const State& x0, const Covariance& P0) {
    if (check() != Status::kOk) return check();
    if (!math::all_finite(x0) || !math::lower_finite(P0)) return Status::kNotFinite;
    if (!math::is_positive_definite(P0)) return Status::kNotPositiveDefinite;
    if (is_far(x0, P0)) return Status::kFarFromOrigin;
    math::copy(x0, belief_.x);
    math::copy(P0, belief_.P);
    ready_ = Status::kOk;
    return Status::kOk;
  }

  /// What restore() says of a belief: finite, and P positive definite but for rounding.
  static Status check_belief(const BeliefType& saved) {
    if (!math::all_finite(saved)) return Status::kNotFinite;
    Covariance p = saved.P;
    // A pivot that is not a number makes those after it so.
    const bool definite = math::ldlt(p) && math::is_finite(p(kStates - 1, kStates - 1));
    return definite ? Status::kOk : Status::kNotPositiveDefinite;
  }

  /// Takes back a belief saved from belief(): the same bits go on.
  Status restore(const BeliefType& saved) {
    if (check() != Status::kOk) return check();
    const Status status = check_belief(saved);
    if (status != Status::kOk) return status;
    belief_ = saved;
    ready_ = Status::kOk;
    return Status::kOk;
  }

  /// A longer prediction is refused: what a clock that jumped asks for, a wrong unit of time, or a
  /// time since another start, and what no process noise was made for. Infinity: no limit. Refuses
  /// what is not above 0.
  Status limit_steps(Scalar longest_step_s) {
    if (!(longest_step_s > Scalar(0))) return Status::kBadParameter;
    const Scalar most = (std::numeric_limits<Scalar>::max)();
    longest_step_ = longest_step_s < most ? longest_step_s : most;
    return Status::kOk;
  }
  /// The largest finite number: no limit.
  Scalar longest_step_s() const { return longest_step_; }

  /// Carries the belief 0 <= dt <= longest_step_s() seconds forward. kFarFromOrigin where it would
  /// come so far from the origin that the format no longer tells positions apart as P does.
  AUVEST_OUTLINE Status predict(Scalar dt) {
    if (!initialised()) return Status::kNotInitialised;
    if (!math::within(dt, Scalar(0), longest_step_)) return no_step(dt);
    BeliefType before;
    math::copy(belief_, before);
    Status status = derived().predict_belief(belief_, dt);
    if (status == Status::kOk && !math::all_finite(belief_)) status = Status::kOverflow;
    if (status == Status::kOk && is_far(belief_.x, belief_.P)) status = Status::kFarFromOrigin;
    if (status != Status::kOk) math::copy(before, belief_);
    return status;
  }

  /// The same for a process that has an input, which is `input` during these dt seconds.
  template <class Input>
  Status predict(Scalar dt, const Input& input) {
    static_assert(InputOf<Process>::kExists,
                  "the process of this filter has no input: predict(dt)");
    constexpr bool kFits = InputOf<Process>::template can_be<Input>();
    static_assert(kFits || !InputOf<Process>::kExists,
                  "the input has another size or number type than the process asks for");
    return predict(dt, input, Possible<kFits>());
  }

  /// What has driven the process since; interval policies ask for it.
  template <class Input>
  void drive(const Input& input) {
    process_.input = input;
  }

  /// Corrects the belief by the measurement z of a sensor described by `model`.
  template <class Model>
  AUVEST_OUTLINE Correction<Scalar, Model::kSize> update(const typename Model::Measurement& z,
                                                         const Model& model) {
    static_assert(Model::kStates == kStates, "the measurement model is for another state");
    static_assert(IsSame<typename Model::Scalar, Scalar>::value,
                  "the measurement model is of another number type than the filter");
    constexpr int kSize = Model::kSize;
    Correction<Scalar, kSize> correction;
    correction.status = correct(z, model, SquareRootUpdate(), correction);
    if (correction.status != Status::kOk) correction.clear(correction.status);
    return correction;
  }

  /// As above, by one number, or by an expression of as many as the sensor measures.
  template <class Model>
  Correction<Scalar, Model::kSize> update(Scalar z, const Model& model) {
    return update(MeasurementOf<Model>::from(z), model);
  }
  template <class Z, class Model>
  Correction<Scalar, Model::kSize> update(const Eigen::MatrixBase<Z>& z, const Model& model) {
    return update(MeasurementOf<Model>::from(z), model);
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
  /// kBadParameter if a parameter of the filter or its process is out of range: no reset then.
  Status check() const {
    return initialised() || ready_ == Status::kNotInitialised ? Status::kOk : ready_;
  }
  bool initialised() const { return ready_ == Status::kOk; }
  const Process& process() const { return process_; }

 protected:
  /// For a filter of several beliefs, which takes each through the steps in turn.
  BeliefType& belief_in_place() { return belief_; }

  /// Linearises, then lets `rule` move the belief, as SquareRootUpdate does.
  template <class Model, class Rule, class Report>
  AUVEST_INLINE Status correct(const typename Model::Measurement& z, const Model& model,
                               Rule&& rule, Report& correction) {
    if (!initialised()) return Status::kNotInitialised;
    if (!math::all_finite(z)) return Status::kNotFinite;
    const Status admitted = model.admits(z);
    if (admitted != Status::kOk) return admitted;

    constexpr int kSize = Model::kSize;
    constexpr int kObserved = Model::kObserved;
    Matrix<Scalar, kObserved, kObserved> root;
    Matrix<Scalar, math::other_states(kStates, kObserved), kObserved> slope;
    if (!math::factor_leading(belief_.P, root, slope)) return Status::kNotPositiveDefinite;

    Matrix<Scalar, kSize, kObserved> a;
    Matrix<Scalar, kSize, kSize> noise;
    const Status status = linearise(z, model, root, correction, a, noise);
    return status == Status::kOk ? rule(belief_, root, slope, a, noise, correction) : status;
  }

 private:
  const Derived& derived() const { return static_cast<const Derived&>(*this); }

  template <class Model>
  AUVEST_OUTLINE_HOT AUVEST_INLINE Status
  linearise(const typename Model::Measurement& z, const Model& model,
            const Matrix<Scalar, Model::kObserved, Model::kObserved>& root,
            Correction<Scalar, Model::kSize>& correction,
            Matrix<Scalar, Model::kSize, Model::kObserved>& a, typename Model::Noise& noise) const {
    const auto point = model.about(belief_.x);
    correction.near_field = model.near_field(point, belief_.P, z, correction.innovation, noise);
    if (!correction.near_field) {
      return derived().linearise(model, point, root, z, correction.innovation, a, noise);
    }
    // A measurement of the observed states themselves, as many numbers: A is their root.
    std::memcpy(a.data(), root.data(), sizeof a < sizeof root ? sizeof a : sizeof root);
    return Status::kOk;
  }

  /// Whether the format is coarse at the position against P.
  AUVEST_OUTLINE bool is_far(const State& x, const Covariance& P) const {
    bool far = false;
    for (int i = 0; i < process_.position_states(); ++i) {
      far = far || math::is_coarse(x(i), P(i, i));
    }
    return far;
  }

  template <bool>
  struct Possible {};

  template <class Input>
  Status predict(Scalar dt, const Input& input, Possible<true>) {
    if (!math::all_finite(input)) return Status::kNotFinite;
    const Input before = process_.input;
    process_.input = input;
    const Status status = predict(dt);
    if (status != Status::kOk) process_.input = before;
    return status;
  }
  template <class Input>
  Status predict(Scalar, const Input&, Possible<false>) {
    return Status::kOk;  // refused where it is called
  }

  /// Why dt is no step to predict.
  static Status no_step(Scalar dt) {
    if (!math::is_finite(dt)) return Status::kNotFinite;
    return dt < Scalar(0) ? Status::kTimeBackwards : Status::kStepTooLong;
  }

  Process process_;
  BeliefType belief_;
  Scalar longest_step_;  // finite, so that a dt within it is
  Status ready_;         // kOk: has a belief; kNotInitialised: has none yet; else: as check() says
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
