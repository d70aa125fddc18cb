// Any Gaussian filter with a robust update: Robust<Ekf<Process>, RobustUpdate<Igg<float>>>, or with
// a Ukf inside. AdaptiveInterval takes it as it takes the filter itself.
#pragma once

#include "auvest/filters/gaussian_filter.hpp"
#include "auvest/robust/robust_update.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Filter, class Rule_>
class Robust : public Filter {
 public:
  using Rule = Rule_;
  using typename Filter::BeliefType;
  using typename Filter::Covariance;
  using typename Filter::Scalar;
  using typename Filter::State;

  explicit Robust(const Filter& filter, const Rule& rule = Rule())
      : Filter(filter), rule_(rule), rule_check_(rule.check()) {}

  /// The same of a filter that needs no more than a process.
  explicit Robust(const typename Filter::Process& process = typename Filter::Process(),
                  const Rule& rule = Rule())
      : Filter(process), rule_(rule), rule_check_(rule.check()) {}

  /// Sets the belief; the recovery policy forgets the past.
  Status reset(const State& x0, const Covariance& P0) {
    if (rule_check_ != Status::kOk) return rule_check_;
    const Status status = Filter::reset(x0, P0);
    if (status == Status::kOk) rule_.recovery.restart();
    return status;
  }

  /// Takes back what belief() and rule() gave: the same bits go on.
  Status restore(const BeliefType& saved, const Rule& rule) {
    if (rule.check() != Status::kOk) return Status::kBadParameter;
    const Status status = Filter::restore(saved);
    if (status != Status::kOk) return status;
    rule_ = rule;
    rule_check_ = Status::kOk;
    return Status::kOk;
  }

  /// As above with the rule as it stands.
  Status restore(const BeliefType& saved) { return restore(saved, Rule(rule_)); }

  /// Corrects the belief by the measurement z of a sensor described by `model`, as far as the
  /// kernel believes it.
  template <class Model>
  AUVEST_OUTLINE RobustCorrection<Scalar, Model::kSize> update(const typename Model::Measurement& z,
                                                               const Model& model) {
    static_assert(Model::kStates == Filter::kStates, "the measurement model is for another state");
    static_assert(IsSame<typename Model::Scalar, Scalar>::value,
                  "the measurement model is of another number type than the filter");
    RobustCorrection<Scalar, Model::kSize> correction;
    correction.status = this->correct(z, model, rule_, correction);
    if (correction.status != Status::kOk) correction.clear(correction.status);
    return correction;
  }

  /// As above, by one number, or by an expression of as many as the sensor measures.
  template <class Model>
  RobustCorrection<Scalar, Model::kSize> update(Scalar z, const Model& model) {
    return update(MeasurementOf<Model>::from(z), model);
  }
  template <class Z, class Model>
  RobustCorrection<Scalar, Model::kSize> update(const Eigen::MatrixBase<Z>& z, const Model& model) {
    return update(MeasurementOf<Model>::from(z), model);
  }

  /// kOk, kNotInitialised, or kRecoveriesRepeat: the recovery policy has widened the belief too
  /// often, which says that a model is wrong.
  Status status() const {
    if (!this->initialised()) return Status::kNotInitialised;
    return rule_.recovery.exhausted() ? Status::kRecoveriesRepeat : Status::kOk;
  }

  Status check() const { return rule_check_ != Status::kOk ? rule_check_ : Filter::check(); }
  const Rule& rule() const { return rule_; }

 protected:
  /// For a filter of several beliefs, which share a recovery.
  Rule& rule_in_place() { return rule_; }

 private:
  Rule rule_;
  Status rule_check_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
