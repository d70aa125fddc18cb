// Interacting multiple models (Blom and Bar-Shalom 1988; Bar-Shalom, Li and Kirubarajan,
// "Estimation with applications to tracking and navigation", 11.6.6): several process models, each
// with a belief, and the probability mu_j that model j is the one that moves the target now.
//
// The motion of a target is drawn anew `switch_rate_hz` times per second on average, and is then
// model j with probability pi_j. In dt seconds nothing is drawn with probability s = exp(-rate dt),
// so the transition probabilities of the textbook are
//
//     p_ij = s [i = j] + (1 - s) pi_j,
//
// which hold for any dt: those of two steps in a row are those of one as long. For them mixing is
// short. The predicted probability of model j, and how much of it comes from the model itself, are
//
//     c_j = s mu_j + (1 - s) pi_j,   w_j = s mu_j / c_j,
//
// and the mixed belief of model j is the mixture of its own, by w_j, with the combined belief of
// all models, by 1 - w_j: mixtures of mixtures have the same two moments as the mixture of all.
//
// Beliefs are told apart by pointers, because they may lie in a particle (one per model) or be
// those of whole joint filters (EkfSlat). Probabilities are kept as logarithms.
#pragma once

#include "auvest/math/exponential.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/select.hpp"
#include "auvest/models/process_model.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Value, int K>
AUVEST_INLINE Value largest(const Vector<Value, K>& values) {
  Value most = values(0);
  AUVEST_UNROLL
  for (int k = 1; k < K; ++k) most = math::larger(most, values(k));
  return most;
}

/// The logarithm of the sum of the weights, and the weights as parts of that sum.
template <class Value, int K>
AUVEST_INLINE Value log_sum(const Vector<Value, K>& log_weight, Vector<Value, K>& part) {
  using math::log;
  const Value most = largest(log_weight);
  Value sum(0);
  AUVEST_UNROLL
  for (int k = 0; k < K; ++k) {
    part(k) = weight_of(Value(log_weight(k) - most));
    sum = sum + part(k);
  }
  AUVEST_UNROLL
  for (int k = 0; k < K; ++k) part(k) = part(k) / sum;
  return most + log(sum);
}

/// Makes the sum of the weights 1 and returns the logarithm of what it was. The largest is taken
/// out first: beside it the logarithm of a sum may be below the last digit.
template <class Value, int K>
AUVEST_INLINE Value normalise(Vector<Value, K>& log_weight) {
  const Value most = largest(log_weight);
  AUVEST_UNROLL
  for (int k = 0; k < K; ++k) log_weight(k) = log_weight(k) - most;
  Vector<Value, K> part;
  const Value rest = log_sum(log_weight, part);
  AUVEST_UNROLL
  for (int k = 0; k < K; ++k) log_weight(k) = log_weight(k) - rest;
  return most + rest;
}

/// The mixture of K Gaussians by its first two moments; lower triangle.
template <class Pointer, class Value, int N, int K>
AUVEST_INLINE void combine(const Pointer (&mode)[K], const Vector<Value, K>& weight,
                           Belief<Value, N>& combined) {
  // About the first, so that digits that all have in common are not lost, and K = 1 keeps its bits.
  AUVEST_UNROLL
  for (int i = 0; i < N; ++i) {
    Value mean = mode[0]->x(i);
    AUVEST_UNROLL
    for (int k = 1; k < K; ++k) mean = mean + weight(k) * (mode[k]->x(i) - mode[0]->x(i));
    combined.x(i) = mean;
  }
  math::set_zero(combined.P);
  AUVEST_UNROLL
  for (int k = 0; k < K; ++k) {
    Vector<Value, N> d;
    AUVEST_UNROLL
    for (int i = 0; i < N; ++i) {
      d(i) = mode[k]->x(i) - combined.x(i);
      AUVEST_UNROLL
      for (int j = 0; j <= i; ++j) {
        combined.P(i, j) = combined.P(i, j) + weight(k) * (mode[k]->P(i, j) + d(i) * d(j));
      }
    }
  }
}

/// Mixing: weights and beliefs before a prediction that lasts as long as `stay` = exp(-rate dt)
/// says. The sum of the weights stays what it is.
template <class Value, class Scalar, int N, int K>
AUVEST_INLINE void mix(Belief<Value, N>* const (&mode)[K], Vector<Value, K>& log_weight,
                       const Vector<Scalar, K>& share, Scalar stay) {
  using math::log;
  using math::select;
  if (!(stay < Scalar(1))) return;
  Vector<Value, K> part;
  const Value total = log_sum(log_weight, part);
  Belief<Value, N> all;
  combine(mode, part, all);
  AUVEST_UNROLL
  for (int k = 0; k < K; ++k) {
    const Value kept = Value(stay) * part(k);
    const Value predicted = kept + Value((Scalar(1) - stay) * share(k));
    const math::Mask<Value> possible = predicted > Value(0);
    const Value likely = select(possible, predicted, Value(1));
    const Value own = select(possible, kept / likely, Value(1));
    const Value other = Value(1) - own;
    log_weight(k) = select(possible, total + log(likely), log_weight(k));
    Belief<Value, N>& belief = *mode[k];
    Vector<Value, N> d;
    AUVEST_UNROLL
    for (int i = 0; i < N; ++i) {
      d(i) = all.x(i) - belief.x(i);
      belief.x(i) = belief.x(i) + other * d(i);
      AUVEST_UNROLL
      for (int j = 0; j <= i; ++j) {
        belief.P(i, j) = own * belief.P(i, j) + other * (all.P(i, j) + own * (d(i) * d(j)));
      }
    }
  }
}

/// Process models for one state, each by its number k.
template <class... Models>
struct ModelList;

template <class First, class... Rest>
struct ModelList<First, Rest...> {
  First first;
  ModelList<Rest...> rest;

  ModelList() {}
  explicit ModelList(const First& model, const Rest&... models) : first(model), rest(models...) {}

  template <class Belief>
  AUVEST_INLINE void propagate(int k, Belief& belief, typename First::Scalar dt) const {
    if (k == 0) return first.propagate(belief, dt);
    rest.propagate(k - 1, belief, dt);
  }
  typename First::State f(int k, const typename First::State& x, typename First::Scalar dt) const {
    return k == 0 ? first.f(x, dt) : rest.f(k - 1, x, dt);
  }
  typename First::Covariance Phi(int k, const typename First::State& x,
                                 typename First::Scalar dt) const {
    return k == 0 ? first.Phi(x, dt) : rest.Phi(k - 1, x, dt);
  }
  typename First::Covariance Q(int k, typename First::Scalar dt) const {
    return k == 0 ? first.Q(dt) : rest.Q(k - 1, dt);
  }
  Status check() const {
    const Status status = first.check();
    return status == Status::kOk ? rest.check() : status;
  }
};

template <class Last>
struct ModelList<Last> {
  Last first;

  ModelList() {}
  explicit ModelList(const Last& model) : first(model) {}

  template <class Belief>
  AUVEST_INLINE void propagate(int, Belief& belief, typename Last::Scalar dt) const {
    first.propagate(belief, dt);
  }
  typename Last::State f(int, const typename Last::State& x, typename Last::Scalar dt) const {
    return first.f(x, dt);
  }
  typename Last::Covariance Phi(int, const typename Last::State& x,
                                typename Last::Scalar dt) const {
    return first.Phi(x, dt);
  }
  typename Last::Covariance Q(int, typename Last::Scalar dt) const { return first.Q(dt); }
  Status check() const { return first.check(); }
};

/// One model of a list, as a process model.
template <class First, class... Rest>
struct ChosenModel
    : ProcessModel<ChosenModel<First, Rest...>, typename First::Scalar, First::kStates> {
  using Base = ProcessModel<ChosenModel<First, Rest...>, typename First::Scalar, First::kStates>;
  using typename Base::Covariance;
  using typename Base::Scalar;
  using typename Base::State;

  ModelList<First, Rest...> models;
  int chosen = 0;

  State f(const State& x, Scalar dt) const { return models.f(chosen, x, dt); }
  Covariance Phi(const State& x, Scalar dt) const { return models.Phi(chosen, x, dt); }
  Covariance Q(Scalar dt) const { return models.Q(chosen, dt); }
  void propagate(Belief<Scalar, First::kStates>& belief, Scalar dt) const {
    models.propagate(chosen, belief, dt);
  }
  Status check() const { return models.check(); }
};

/// The models of a master whose manoeuvres nobody announces: takes the place of its process model
/// in EkfSlat and Slatf.
template <class First, class... Rest>
class Imm {
 public:
  using Scalar = typename First::Scalar;
  using Models = ModelList<First, Rest...>;
  using Model = ChosenModel<First, Rest...>;
  static constexpr int kModes = 1 + static_cast<int>(sizeof...(Rest));
  using Shares = Vector<Scalar, kModes>;

  struct Params {
    Scalar switch_rate_hz = Scalar(0.1);  ///< how often a motion is drawn anew [1/s]; 0: never
    Shares share;                         ///< pi_j: how often model j is drawn; their sum is 1

    Params() {
      for (int j = 0; j < kModes; ++j) share(j) = Scalar(1) / Scalar(kModes);
    }
  };

  Params params;
  Models models;

  explicit Imm(const Params& p = Params()) : params(p) {}
  Imm(const Params& p, const First& first, const Rest&... rest)
      : params(p), models(first, rest...) {}

  Model model(int k) const {
    Model one;
    one.models = models;
    one.chosen = k;
    return one;
  }

  /// s, the probability that the motion stays what it is for dt seconds.
  Scalar stay(Scalar dt) const { return math::exp(-(params.switch_rate_hz * dt)); }

  /// The logarithm of pi_j: models begin with these probabilities.
  Scalar log_share(int j) const {
    return params.share(j) > Scalar(0) ? math::log(params.share(j)) : no_log_weight<Scalar>();
  }

  Status check() const {
    Scalar sum(0);
    for (int j = 0; j < kModes; ++j) {
      if (!math::is_nonnegative(params.share(j))) return Status::kBadParameter;
      sum = sum + params.share(j);
    }
    const bool valid =
        math::is_nonnegative(params.switch_rate_hz) && sum > Scalar(0.999) && sum < Scalar(1.001);
    return valid ? models.check() : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
