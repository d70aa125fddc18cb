// Any Gaussian filter with a gate: a measurement whose NIS is beyond it is refused.
//
//     Gated<Ukf<Process>> filter;
//     const auto correction = filter.update(z, sonar);   // kImplausible: refused, see its nis
//
// The NIS is known before anything has moved, so the gate costs nothing else, and where it refuses
// nothing the bits are those of the filter inside. A gate alone is a trap: once the estimate is
// wrong by more than the gate, every measurement is refused, and it stays wrong. Whoever refuses
// several in a row calls widen(correction.nis), until one is taken. Robust weighs and recovers by
// itself, for more flash.
#pragma once

#include "auvest/filters/gaussian_filter.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// SquareRootUpdate behind a gate. kImplausible: beyond it; the belief is untouched, and S and NIS
/// are there.
template <class Scalar>
struct GatedUpdate {
  Scalar gate;

  template <int M, int O, int U, int N>
  AUVEST_INLINE Status operator()(Belief<Scalar, N>& belief, Matrix<Scalar, O, O>& root,
                                  const Matrix<Scalar, U, O>& slope, Matrix<Scalar, M, O>& a,
                                  Matrix<Scalar, M, M>& noise,
                                  Correction<Scalar, M>& correction) const {
    innovation_covariance(a, noise, correction.S);
    if (!math::ldlt(noise)) return Status::kNotPositiveDefinite;
    Posterior<Scalar, O> posterior;
    if (!potter(a, noise, correction.innovation, posterior)) return Status::kOverflow;
    correction.nis = posterior.nis;
    if (posterior.nis > gate) return Status::kImplausible;
    return move_belief(belief, root, slope, posterior) ? Status::kOk : Status::kOverflow;
  }
};

template <class Filter>
class Gated : public Filter {
 public:
  using Filter::Filter;
  using typename Filter::Covariance;
  using typename Filter::Scalar;

  /// The NIS of a measurement has the chi-square distribution with as many degrees of freedom as
  /// the measurement has numbers: 13.8 loses one good pair in 1,000. Refuses what is not above 0.
  Status set_gate(Scalar gate) {
    if (!math::is_positive(gate)) return Status::kBadParameter;
    rule_.gate = gate;
    return Status::kOk;
  }
  Scalar gate() const { return rule_.gate; }

  /// As that of the filter; kImplausible beyond the gate, with the NIS in the report.
  template <class Model>
  AUVEST_OUTLINE Correction<Scalar, Model::kSize> update(const typename Model::Measurement& z,
                                                         const Model& model) {
    static_assert(Model::kStates == Filter::kStates, "the measurement model is for another state");
    static_assert(IsSame<typename Model::Scalar, Scalar>::value,
                  "the measurement model is of another number type than the filter");
    Correction<Scalar, Model::kSize> correction;
    correction.status = this->correct(z, model, rule_, correction);
    const bool told = correction.status == Status::kOk || correction.status == Status::kImplausible;
    if (!told) correction.clear(correction.status);
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

  /// The belief knows less: its covariance times `factor` >= 1. With the NIS of what was refused,
  /// the same innovation passes the gate, unless the sensor's own noise is most of its S: then
  /// after some calls. kOverflow where it would not be finite.
  Status widen(Scalar factor) {
    if (!this->initialised()) return Status::kNotInitialised;
    if (!math::is_finite(factor)) return Status::kNotFinite;
    if (factor < Scalar(1)) return Status::kBadParameter;
    Covariance& P = this->belief_in_place().P;
    const Scalar most = (std::numeric_limits<Scalar>::max)() / factor;
    for (int i = 0; i < Filter::kStates; ++i) {
      if (P(i, i) > most) return Status::kOverflow;  // no covariance is larger than the variances
    }
    for (int i = 0; i < Filter::kStates; ++i) {
      for (int j = 0; j <= i; ++j) P(i, j) = factor * P(i, j);
    }
    return Status::kOk;
  }

 private:
  GatedUpdate<Scalar> rule_ = {Scalar(13.8)};
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
