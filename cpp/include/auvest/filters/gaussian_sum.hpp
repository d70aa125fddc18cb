// A range filter that may not know where it is: the Gaussian sum filter (Alspach and Sorenson 1972)
// round any robust filter of the family, GaussianSum<Robust<Ekf<Process>, Rule>, K>. Derived in
// docs/algorithms/unknown_start.md.
//
// After one range from a wide prior the craft is on a circle, after two at one of two points: no
// single Gaussian says that. The belief here is a mixture of n <= K of them, and a range z from b
// with sigma^2 = R does, in this order:
//
//  1. Ring. Where every component is wider than z / 2 and 3 sigma, the product of the mixture's
//     two moments with a ring of K Gaussians replaces it. This range is used up then.
//  2. Refine. While n < K, the heaviest of the components over whose width v across the line of
//     sight the circle bends, v > 9 R and v / (sqrt(2) min(r, z)) > 3 sigma, becomes two.
//  3. Update. Each component by the robust update with a weight of its own. Its likelihood is
//     bounded from below by that of an outlier: a wrong range costs nobody more than that.
//  4. Recovery, of the mixture: a range is rejected if components of more than half of the weight
//     reject it; what the recovery adds, it adds to all.
//  5. Prune components below e^-9 of the heaviest; merge the closest two while they are one place.
//
// With n = 1 this is the filter inside, bit for bit: no rule fires while the position's sigma is
// below 3 sigma of the range. x(), P() and belief() are the moments of the mixture. A wide belief
// beside the next range becomes a ring whatever made it wide: an unknown start, a recovery, a
// prediction over a wrong time stamp.
#pragma once

#include <cstdint>

#include "auvest/filters/gaussian_mixture.hpp"
#include "auvest/filters/robust.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// What the belief says about where the craft is.
enum class Convergence : std::uint8_t {
  kNotConverged,  ///< the circle of the last range bends within the belief; or no range yet
  kAmbiguous,     ///< several places (few, if it is wide), more apart than each is wide
  kSettling,      ///< neither, since fewer than 6 accepted ranges
  kSettled        ///< stays until it is one of the first two again, or a recovery
};

/// One line of English for each, without a full stop.
inline const char* describe(Convergence convergence) {
  switch (convergence) {
    case Convergence::kNotConverged:
      return "not converged: the ranges do not yet say where the craft is";
    case Convergence::kAmbiguous:
      return "ambiguous: the ranges leave several places";
    case Convergence::kSettling:
      return "settling: one place, not yet confirmed";
    case Convergence::kSettled:
      return "settled";
  }
  return "unknown convergence";
}

/// Components where nothing else is said: desk and chip are the same filter in single precision.
template <class Scalar>
constexpr int default_components() {
  return sizeof(Scalar) > 4 ? 32 : 16;
}

/// What a mixture carries from range to range beside its components.
template <class Scalar, int N, int K, class Components = ComponentArrays<Scalar, N, K>>
struct GaussianSumState {
  GaussianMixture<Scalar, N, K, Components> mixture;  ///< counts where there are several
  std::uint8_t accepted = 0;  ///< ranges since it was not converged or ambiguous, to 6
  std::uint8_t headings = 1;  ///< of which each is to have a ring of its own
  Scalar bend = Scalar(0);    ///< 3 sqrt(2) sigma z of the last range: a wider variance bends
};

template <class Robust_, int K_ = default_components<typename Robust_::Scalar>(),
          class Components = ComponentArrays<typename Robust_::Scalar, Robust_::kStates, K_>>
class GaussianSum : public Robust_ {
 public:
  using Base = Robust_;
  using Process = typename Base::Process;
  using Rule = typename Base::Rule;
  using typename Base::BeliefType;
  using typename Base::Covariance;
  using typename Base::Scalar;
  using typename Base::State;
  static constexpr int kStates = Base::kStates;
  static constexpr int kMost = K_;
  static_assert(K_ >= 8 && K_ <= 255, "a ring of fewer components has gaps");
  static_assert(kStates >= 2, "the first two states are the position");
  using Mixture = GaussianMixture<Scalar, kStates, kMost, Components>;
  using SumState = GaussianSumState<Scalar, kStates, kMost, Components>;

  struct Params {
    Scalar outlier_share = Scalar(0.1);  ///< of the ranges, in 0.001..0.5
    Scalar outlier_width = Scalar(50);   ///< over how many sigma they spread, in 10..1000
    std::uint8_t components = kMost;     ///< K: 1 (the filter inside), or 8..kMost
  };

  explicit GaussianSum(const Base& filter, const Params& params = Params())
      : Base(filter), params_(params), params_check_(check(params)) {
    state_.mixture.size = 1;
    if (params.components > 1) state_.mixture.reserve(params.components);
  }

  /// With a filter inside that needs no more than a process.
  explicit GaussianSum(const Process& process = Process()) : GaussianSum(Base(process)) {}

  /// Sets the belief. A sigma of many times the distances, also 1e6 m, says: unknown.
  Status reset(const State& x0, const Covariance& P0) {
    if (params_check_ != Status::kOk) return params_check_;
    const Status status = Base::reset(x0, P0);
    if (status == Status::kOk) forget();
    return status;
  }

  /// The same with a heading, the third state, that is not known at all: `headings` components, 2
  /// and more, whose sigma is half of their distance. The heading of x0 and its part of P0 do not
  /// count. The first range from a wide position makes a ring of each; K must be 8 times as many.
  Status reset(const State& x0, const Covariance& P0, int headings) {
    static_assert(kStates >= 3, "the third state is the heading");
    if (params_check_ != Status::kOk) return params_check_;
    if (headings < 2 || headings * 8 > params_.components) return Status::kBadParameter;
    const Scalar apart = math::two_pi<Scalar>() / Scalar(headings);
    BeliefType one;
    math::copy(x0, one.x);
    math::copy(P0, one.P);
    for (int i = 0; i < kStates; ++i) one.P(2, i) = one.P(i, 2) = Scalar(0);
    one.P(2, 2) = Scalar(0.25) * (apart * apart);
    one.x(2) = Scalar(0);
    const Status status = Base::reset(one.x, one.P);
    if (status != Status::kOk) return status;
    forget();
    Mixture& mixture = state_.mixture;
    for (int k = 0; k < headings; ++k) {
      one.x(2) = Scalar(k) * apart;
      mixture.weight[k] = Scalar(1) / Scalar(headings);
      math::copy(one, mixture.component[k]);
    }
    mixture.size = state_.headings = static_cast<std::uint8_t>(headings);
    mixture.moments(this->belief_in_place());
    return Status::kOk;
  }

  /// Takes back what belief(), rule() and state() gave: the same bits go on.
  Status restore(const BeliefType& saved, const Rule& rule, const SumState& state) {
    const bool several = state.mixture.size > 1;
    if (state.mixture.size < 1 || state.accepted > kConfirmed || state.headings < 1 ||
        (state.headings > 1 && state.headings * 8 > params_.components) ||
        !math::is_nonnegative(state.bend) ||
        (several && !state.mixture.valid(params_.components))) {
      return Status::kBadParameter;
    }
    const Status status = Base::restore(saved, rule);
    if (status == Status::kOk) state_ = state;
    return status;
  }

  /// One Gaussian, of which nothing is known but itself.
  Status restore(const BeliefType& saved, const Rule& rule) {
    const Status status = Base::restore(saved, rule);
    if (status == Status::kOk) forget();
    return status;
  }
  Status restore(const BeliefType& saved) { return restore(saved, Rule(this->rule())); }

  /// Carries the belief dt >= 0 seconds forward.
  Status predict(Scalar dt) {
    if (size() == 1) return Base::predict(dt);
    return this->process().translates() ? predict_together(dt) : predict_each(dt);
  }

  /// The same for a process that has an input, which is `input` during these dt seconds.
  template <class Input>
  Status predict(Scalar dt, const Input& input) {
    if (!math::all_finite(input)) return Status::kNotFinite;
    const Input before = this->process().input;
    this->drive(input);
    const Status status = predict(dt);
    if (status != Status::kOk) this->drive(before);
    return status;
  }

  /// Corrects the belief by the measurement z of a sensor described by `model`. The report is that
  /// of the heaviest of the components that agree with the decision.
  template <class Model>
  AUVEST_OUTLINE RobustCorrection<Scalar, Model::kSize> update(const typename Model::Measurement& z,
                                                               const Model& model) {
    static_assert(Model::kStates == kStates, "the measurement model is for another state");
    static_assert(IsSame<typename Model::Scalar, Scalar>::value,
                  "the measurement model is of another number type than the filter");
    RobustCorrection<Scalar, Model::kSize> correction;
    correction.status = take(z, model, correction, IsCircle<Model::kCircle>());
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

  /// How many Gaussians the belief is made of.
  int size() const { return state_.mixture.size; }
  /// Number k of them; the second states its part of the belief, their sum is 1.
  const BeliefType& component(int k) const {
    return size() == 1 ? this->belief() : state_.mixture.component[k];
  }
  Scalar weight(int k) const { return size() == 1 ? Scalar(1) : state_.mixture.weight[k]; }

  Convergence convergence() const {
    const BeliefType& whole = this->belief();
    const Scalar trace = whole.P(0, 0) + whole.P(1, 1);
    const bool wide = bends(whole.P, state_.bend);
    if (size() > 1) {
      const Scalar within = state_.mixture.trace_within();
      const bool places =
          wide ? !(within > state_.bend) && state_.mixture.few(4) : trace - within > within;
      if (places) return Convergence::kAmbiguous;
    }
    if (wide) return Convergence::kNotConverged;
    return state_.accepted < kConfirmed ? Convergence::kSettling : Convergence::kSettled;
  }

  const SumState& state() const { return state_; }
  const Params& params() const { return params_; }
  Status check() const { return params_check_ != Status::kOk ? params_check_ : Base::check(); }

 private:
  static constexpr std::uint8_t kConfirmed = 6;

  /// Chooses between two forms (avr-gcc has no std::enable_if).
  template <bool>
  struct IsCircle {};

  /// The recovery policy of a component: keeps what the policy of the whole will ask for.
  template <int M, int O>
  struct Witness {
    using Scalar = typename Base::Scalar;
    Matrix<Scalar, M, O>* a;
    Matrix<Scalar, O, O>* root;

    bool after(const RobustCorrection<Scalar, M>&, const Matrix<Scalar, M, O>& used,
               const Matrix<Scalar, O, O>& factor, BeliefType&) {
      math::copy(used, *a);
      math::copy(factor, *root);
      return false;
    }
    Status check() const { return Status::kOk; }
  };

  /// A rule that looks and leaves the belief alone: an acceptance, as a ring is one.
  struct Look {
    template <int O, int U>
    Status operator()(BeliefType&, Matrix<Scalar, O, O>&, const Matrix<Scalar, U, O>&,
                      Matrix<Scalar, 1, O>& a, Matrix<Scalar, 1, 1>& noise,
                      RobustCorrection<Scalar, 1>& correction) const {
      using math::sqrt;
      if (!(noise(0, 0) > Scalar(0))) return Status::kNotPositiveDefinite;
      innovation_covariance(a, noise, correction.S);
      const Scalar t = correction.innovation(0) / sqrt(correction.S(0, 0));
      correction.standardised(0) = t;
      correction.nis = t * t;
      correction.weight(0) = Scalar(1);
      correction.decision = Decision::kAccepted;
      correction.iterations = 1;
      correction.recovered = false;
      return math::is_finite(correction.nis) ? Status::kOk : Status::kOverflow;
    }
  };

  static Status check(const Params& params) {
    const bool valid =
        math::within(params.outlier_share, Scalar(0.001), Scalar(0.5)) &&
        math::within(params.outlier_width, Scalar(10), Scalar(1000)) &&
        (params.components == 1 || (params.components >= 8 && params.components <= kMost));
    return valid ? Status::kOk : Status::kBadParameter;
  }

  void forget() {
    state_.mixture.size = 1;
    state_.accepted = 0;
    state_.headings = 1;
    state_.bend = Scalar(0);
  }

  /// True where the position's variance is above `limit` in some direction.
  static bool bends(const Covariance& p, Scalar limit) {
    return p(0, 0) + p(1, 1) > limit && LongAxis<Scalar>(p).variance > limit;
  }

  // ---- Prediction -------------------------------------------------------------------------------

  /// The displacement and its noise are the same for all: those of a belief of zeros.
  Status predict_together(Scalar dt) {
    const Status status = Base::predict(dt);  // of the moments
    if (status != Status::kOk) return status;
    BeliefType step;
    math::set_zero(step.x);
    math::set_zero(step.P);
    this->predict_belief(step, dt);
    for (int k = 0; k < size(); ++k) {
      BeliefType& one = state_.mixture.component[k];
      for (int i = 0; i < kStates; ++i) {
        one.x(i) = one.x(i) + step.x(i);
        for (int j = 0; j <= i; ++j) one.P(i, j) = one.P(i, j) + step.P(i, j);
      }
    }
    return status;
  }

  /// Twice: the first time to see that none is refused.
  Status predict_each(Scalar dt) {
    BeliefType whole;
    math::copy(this->belief(), whole);
    for (int again = 0; again < 2; ++again) {
      for (int k = 0; k < size(); ++k) {
        math::copy(state_.mixture.component[k], this->belief_in_place());
        const Status status = Base::predict(dt);
        if (status != Status::kOk) {
          math::copy(whole, this->belief_in_place());
          return status;
        }
        if (again != 0) math::copy(this->belief(), state_.mixture.component[k]);
      }
    }
    state_.mixture.moments(this->belief_in_place());
    return Status::kOk;
  }

  // ---- Update -----------------------------------------------------------------------------------

  template <class Model, class Report>
  Status take(const typename Model::Measurement& z, const Model& model, Report& correction,
              IsCircle<false>) {
    const Status status = update_all(z, model, correction);
    if (status == Status::kOk && size() > 1) tidy();
    return status;
  }

  template <class Model, class Report>
  Status take(const typename Model::Measurement& z, const Model& model, Report& correction,
              IsCircle<true>) {
    using math::sqrt;
    const Scalar noise = model.R()(0, 0);
    RangeCircle<Scalar> circle;
    model.centre(circle.centre);
    circle.sigma = sqrt(noise);
    circle.radius = math::larger(circle.sigma, z(0));
    const Scalar bend = Scalar(4.24264069) * circle.sigma * circle.radius;
    if (params_.components > 1 && math::is_positive(noise)) {
      const Covariance& p = this->belief().P;
      if (size() > 1 || p(0, 0) + p(1, 1) > Scalar(9) * noise) {
        // Whatever a filter refuses is refused before anything changes.
        const Status status = this->correct(z, model, Look(), correction);
        if (status != Status::kOk) return status;
        if (!within_range(circle)) return Status::kOverflow;
        if (wide(circle)) return ring(circle, bend);
        refine(circle, bend);
      }
    }
    const Status status = update_all(z, model, correction);
    if (status != Status::kOk) return status;
    if (size() > 1) tidy();
    state_.headings = 1;
    count(correction, bend);
    return status;
  }

  /// True if no square of a length, in sigmas of the range, leaves the format.
  bool within_range(const RangeCircle<Scalar>& circle) const {
    const Scalar per_sigma = Scalar(8) / circle.sigma;
    for (int k = 0; k < size(); ++k) {
      const BeliefType& belief = component(k);
      const Scalar dx = belief.x(0) - circle.centre[0];
      const Scalar dy = belief.x(1) - circle.centre[1];
      const Scalar length = math::absolute(dx) + math::absolute(dy) + circle.radius;
      const Scalar sigmas = length * per_sigma;
      const Scalar square = Scalar(64) * (length * length) + (belief.P(0, 0) + belief.P(1, 1));
      if (!math::is_finite(sigmas * sigmas) || !math::is_finite(square)) return false;
    }
    return true;
  }

  /// Rule 1.
  bool wide(const RangeCircle<Scalar>& circle) const {
    const Scalar half = Scalar(0.5) * circle.radius;
    const Scalar noise = Scalar(3) * circle.sigma;
    const Scalar limit = half > noise ? half * half : noise * noise;
    for (int k = 0; k < size(); ++k) {
      if (!bends(component(k).P, limit)) return false;
    }
    return true;
  }

  AUVEST_OUTLINE Status ring(const RangeCircle<Scalar>& circle, Scalar bend) {
    const int parts = size() == state_.headings ? size() : 1;
    const int each = params_.components / parts;
    const bool done = parts > 1 ? state_.mixture.rings(circle, each)
                                : state_.mixture.ring(this->belief(), circle, each);
    if (!done) return Status::kNotPositiveDefinite;
    state_.headings = 1;
    tidy();
    this->rule_in_place().recovery.forget();
    state_.accepted = 0;
    state_.bend = bend;
    return Status::kOk;
  }

  /// Rule 2.
  AUVEST_OUTLINE void refine(const RangeCircle<Scalar>& circle, Scalar bend) {
    if (size() == params_.components) return;
    Scalar bent[kMost];
    for (int k = 0; k < size(); ++k) bent[k] = bend_of(component(k), circle, bend);
    while (size() < params_.components) {
      int chosen = -1;
      Scalar most = Scalar(0);
      for (int k = 0; k < size(); ++k) {
        if (weight(k) * bent[k] > most) {
          most = weight(k) * bent[k];
          chosen = k;
        }
      }
      if (chosen < 0) return;
      if (size() == 1) state_.mixture.assign(this->belief());
      state_.mixture.split(chosen);
      bent[chosen] = bend_of(component(chosen), circle, bend);
      bent[size() - 1] = bend_of(component(size() - 1), circle, bend);
    }
  }

  /// v over the distance where the circle bends within this component, 0 where it does not.
  AUVEST_OUTLINE static Scalar bend_of(const BeliefType& belief, const RangeCircle<Scalar>& circle,
                                       Scalar bend) {
    using math::sqrt;
    const Scalar noise = Scalar(9) * (circle.sigma * circle.sigma);
    if (!(belief.P(0, 0) + belief.P(1, 1) > noise)) return Scalar(0);
    const Scalar dx = belief.x(0) - circle.centre[0];
    const Scalar dy = belief.x(1) - circle.centre[1];
    const Scalar square = dx * dx + dy * dy;
    const Scalar range = sqrt(square);
    const Scalar v = square > Scalar(0) ? variance_along(belief.P, -dy, dx) / square
                                        : LongAxis<Scalar>(belief.P).variance;
    // At least sigma: nearer than that v > 9 R is the stronger condition.
    const Scalar near = math::larger(circle.sigma, range < circle.radius ? range : circle.radius);
    const Scalar ratio = v / near;
    return v > noise && ratio * circle.radius > bend ? ratio : Scalar(0);
  }

  /// Rule 3 for the belief in place.
  template <class Model, class Report, int O>
  Status update_one(const typename Model::Measurement& z, const Model& model, Report& correction,
                    Matrix<Scalar, Model::kSize, O>& a, Matrix<Scalar, O, O>& root) {
    using Kept = Witness<Model::kSize, O>;
    using Part = RobustUpdate<typename Rule::Kernel, Kept>;
    const Rule& rule = this->rule();
    Kept kept;
    kept.a = &a;
    kept.root = &root;
    typename Part::Params params;
    params.residual = rule.params.residual;
    params.max_iterations = rule.params.max_iterations;
    params.tolerance = rule.params.tolerance;
    Part part(rule.kernel, kept, params);
    correction.recovered = false;
    return this->correct(z, model, part, correction);
  }

  /// Rules 3 and 4. On anything but kOk no component has changed.
  template <class Model, class Report>
  AUVEST_OUTLINE Status update_all(const typename Model::Measurement& z, const Model& model,
                                   Report& correction) {
    constexpr int kSize = Model::kSize;
    constexpr int kObserved = Model::kObserved;
    Matrix<Scalar, kSize, kObserved> a;
    Matrix<Scalar, kObserved, kObserved> root;
    auto& recovery = this->rule_in_place().recovery;
    BeliefType& whole = this->belief_in_place();
    if (size() == 1) {
      const Status status = update_one(z, model, correction, a, root);
      if (status == Status::kOk) correction.recovered = recovery.after(correction, a, root, whole);
      return status;
    }
    BeliefType before;
    math::copy(whole, before);
    Matrix<Scalar, kSize, kObserved> a_of[2];  // of the heaviest that accepts, and that rejects
    Matrix<Scalar, kObserved, kObserved> root_of[2];
    Report report_of[2];
    Scalar heaviest[2] = {Scalar(0), Scalar(0)};
    Scalar rejecting = Scalar(0);
    Status status = Status::kOk;
    bool done = false;
    for (int k = 0; k < size(); ++k) {
      BeliefType& part = state_.mixture.component[k];
      Scalar& weight = state_.mixture.weight[k];
      math::copy(part, whole);
      Report report(Status::kOk);
      const Status refused = update_one(z, model, report, a, root);
      if (refused != Status::kOk) {  // as if rejected
        status = refused;
        rejecting = rejecting + weight;
        continue;
      }
      done = true;
      const int side = report.decision == Decision::kRejected ? 1 : 0;
      if (side == 1) rejecting = rejecting + weight;
      if (weight > heaviest[side]) {
        heaviest[side] = weight;
        report_of[side] = report;
        math::copy(a, a_of[side]);
        math::copy(root, root_of[side]);
      }
      math::copy(whole, part);
      weight = weight * likelihood(report, model);
    }
    math::copy(before, whole);
    if (!done) return status;
    const int side = rejecting > Scalar(0.5) && heaviest[1] > Scalar(0) ? 1
                     : heaviest[0] > Scalar(0)                          ? 0
                                                                        : 1;
    correction = report_of[side];
    BeliefType more;  // what the recovery adds to a covariance
    math::set_zero(more.x);
    math::set_zero(more.P);
    correction.recovered = recovery.after(correction, a_of[side], root_of[side], more);
    if (correction.recovered) {
      for (int k = 0; k < size(); ++k) {
        Covariance& p = state_.mixture.component[k].P;
        for (int i = 0; i < kStates; ++i) {
          for (int j = 0; j <= i; ++j) p(i, j) = p(i, j) + more.P(i, j);
        }
      }
    }
    return Status::kOk;
  }

  /// The likelihood of a component in multiples of that of an outlier, which is its bound:
  /// max(exp(-t^2 / 2) / sqrt(2 pi S), share / width), number by number.
  template <class Model, class Report>
  AUVEST_OUTLINE Scalar likelihood(const Report& report, const Model& model) const {
    using math::sqrt;
    const typename Model::Noise noise = model.R();
    Scalar product = Scalar(1);
    for (int m = 0; m < Model::kSize; ++m) {
      const Scalar s = report.S(m, m);
      // Near the station the measurement is another, and so is its noise.
      const Scalar sharp = report.near_field ? Scalar(1) : sqrt(noise(m, m) / s);
      const Scalar peak =
          Scalar(0.398942280) * (params_.outlier_width / params_.outlier_share) * sharp;
      const Scalar fall = Scalar(-0.5) * (report.innovation(m) / s * report.innovation(m));
      const Scalar value = fall > Scalar(-80) ? peak * math::exp(fall) : Scalar(0);
      product = product * math::larger(Scalar(1), value);
    }
    return product;
  }

  /// Rule 5, and the moments.
  AUVEST_OUTLINE void tidy() {
    Mixture& mixture = state_.mixture;
    mixture.prune(Scalar(1.23409804e-4));  // e^-9
    mixture.merge(Scalar(0.5));
    mixture.moments(this->belief_in_place());
  }

  /// What a range that was taken says about the convergence.
  template <class Report>
  void count(const Report& correction, Scalar bend) {
    state_.bend = bend;
    const Convergence now = convergence();
    if (now == Convergence::kNotConverged || now == Convergence::kAmbiguous ||
        correction.recovered) {
      state_.accepted = 0;
    } else if (correction.decision != Decision::kRejected) {
      if (state_.accepted < kConfirmed) ++state_.accepted;
    } else if (state_.accepted > 0 && state_.accepted < kConfirmed) {
      --state_.accepted;
    }
  }

  SumState state_;
  Params params_;
  Status params_check_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
