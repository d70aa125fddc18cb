// Models behind an interface, so that filters, processes and sensors are put together at run time:
// each model is compiled by itself, with the arithmetic of the core inlined, and not once per
// combination.
//
// AnyProcess and AnySensor are what Python holds, whatever the number of states; ProcessFor and
// SensorFor know it; ProcessOf and SensorOf wrap a model of the core or of a user.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "auvest/filters/gaussian_sum.hpp"
#include "auvest/filters/robust.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "auvest/runtime/any_linearisation.hpp"
#include "auvest/runtime/any_recovery.hpp"
#include "auvest/slat/definite.hpp"
#include "desk/members.hpp"
#include "desk/report.hpp"
#include "desk/well_conditioned.hpp"

namespace auvest {
namespace desk {

/// A process model, whatever its number of states.
template <class Scalar>
struct AnyProcess {
  const int states;
  const int position_states;  ///< as ProcessModel's kPosition
  const int inputs;

  AnyProcess(int n, int position, int u) : states(n), position_states(position), inputs(u) {}
  virtual ~AnyProcess() = default;

  /// The state (states) after dt seconds, the Jacobian and the noise covariance (states, states).
  virtual void f(const Scalar* x, Scalar dt, const Scalar* input, Scalar* out) const = 0;
  virtual void Phi(const Scalar* x, Scalar dt, const Scalar* input, Scalar* out) const = 0;
  virtual void Q(Scalar dt, const Scalar* input, Scalar* out) const = 0;
};

/// A measurement model, whatever the number of states it is for.
template <class Scalar>
struct AnySensor {
  const int states;
  const int size;
  const int place;          ///< numbers that say where it stood or how it was headed; 0: none
  bool stands = true;       ///< whether an update may come without them
  std::string description;  ///< how its owner would make it again

  AnySensor(int n, int m, int p) : states(n), size(m), place(p) {}
  virtual ~AnySensor() = default;
  /// Measurements (rows, size) of states (rows, states) without noise.
  virtual void measure(const Scalar* x, Scalar* z, std::size_t rows) const = 0;
};

template <class Scalar, int N>
struct ProcessFor : AnyProcess<Scalar> {
  using Input = Vector<Scalar, kMaxInputs>;
  const bool translates;  ///< as ProcessModel's kTranslation
  const bool linear;      ///< as ProcessModel's kLinear

  ProcessFor(int position, int u, bool moves_all_alike, bool in_x)
      : AnyProcess<Scalar>(N, position, u), translates(moves_all_alike), linear(in_x) {}

  virtual Status predict(const AnyLinearisation<Scalar>& how, Belief<Scalar, N>& belief, Scalar dt,
                         const Input& input) const = 0;
  virtual Scalar position_variance(const Belief<Scalar, N>& belief, Scalar dt,
                                   const Input& input) const = 0;
  virtual Vector<Scalar, N> residual(const Vector<Scalar, N>& a,
                                     const Vector<Scalar, N>& b) const = 0;
};

/// The process of a filter: the model and what drives it.
template <class Scalar_, int N>
struct RuntimeProcess {
  using Scalar = Scalar_;
  using Input = Vector<Scalar, kMaxInputs>;
  static constexpr int kStates = N;

  std::shared_ptr<const ProcessFor<Scalar, N>> model;
  Input input = Input::Zero();

  Scalar position_variance(const Belief<Scalar, N>& belief, Scalar dt) const {
    return model->position_variance(belief, dt, input);
  }
  Vector<Scalar, N> residual(const Vector<Scalar, N>& a, const Vector<Scalar, N>& b) const {
    return model->residual(a, b);
  }
  bool translates() const { return model->translates; }
  int position_states() const { return model->position_states; }
};

/// Raises the lost pivots of a covariance that restore() does not take, after a step of `Filter`
/// from the variances `before`, to what the format resolves. Those are of a covariance that
/// rounding has left indefinite or with a variance of 0, in single precision by a measurement that
/// is 1e7 times as precise as what it corrects. False where that is none either: not finite. No bit
/// of a belief that restore() takes changes, nor of one so small that all that is lost, and no
/// variance whole, is subnormal.
template <class Filter>
AUVEST_COLD bool mend_belief(const typename Filter::State& before,
                             typename Filter::BeliefType& belief) {
  using Scalar = typename Filter::Scalar;
  if (Filter::check_belief(belief) == Status::kOk) return true;
  typename Filter::Covariance raised = belief.P;
  const Scalar least = (std::numeric_limits<Scalar>::min)();
  bool subnormal = true;
  for (int i = 0; i < Filter::kStates; ++i) {
    const Scalar floor = math::pivot_floor(before(i));
    const bool nothing = !(raised(i, i) > Scalar(0));
    subnormal = subnormal && floor < least && !nothing;
    raised(i, i) = math::larger(raised(i, i), floor);
    // Such that the rounding noise of it is a number.
    if (nothing) raised(i, i) = math::larger(raised(i, i), least / math::pivot_floor(Scalar(4)));
  }
  if (subnormal) return true;
  belief.P = raised;
  raise_pivots(belief.P);
  // Pivots behind one that is all but lost are as good as that: in another order of the same sums
  // they may be lost yet. Then all variances grow, by the least share that serves.
  for (Scalar share = Scalar(16) * math::machine_epsilon<Scalar>(); share < Scalar(1);
       share = Scalar(4) * share) {
    if (Filter::check_belief(belief) == Status::kOk) return true;
    for (int i = 0; i < Filter::kStates; ++i) {
      belief.P(i, i) = belief.P(i, i) + share * belief.P(i, i);
    }
  }
  return false;
}

/// A Gaussian filter whose process and whose linearisation are chosen at run time.
template <class Scalar_, int N>
class RuntimeGaussian
    : public GaussianFilter<RuntimeGaussian<Scalar_, N>, RuntimeProcess<Scalar_, N>> {
 public:
  using Scalar = Scalar_;
  using Base = GaussianFilter<RuntimeGaussian<Scalar, N>, RuntimeProcess<Scalar, N>>;
  using typename Base::BeliefType;

  RuntimeGaussian(const RuntimeProcess<Scalar, N>& process, const AnyLinearisation<Scalar>& how)
      : Base(process, how.check()), how_(how) {}

  Status predict_belief(BeliefType& belief, Scalar dt) const {
    const typename Base::State before = belief.P.diagonal();
    const Status status = this->process().model->predict(how_, belief, dt, this->process().input);
    return status != Status::kOk || keeps(before, belief) ? status : Status::kOverflow;
  }

  template <class Model, class Point>
  Status linearise(const Model& model, const Point& point,
                   const Matrix<Scalar, Model::kObserved, Model::kObserved>& root,
                   const typename Model::Measurement& z, typename Model::Measurement& innovation,
                   Matrix<Scalar, Model::kSize, Model::kObserved>& a,
                   typename Model::Noise& noise) const {
    return how_.linearise(model, point, root, z, innovation, a, noise);
  }

  const AnyLinearisation<Scalar>& linearisation() const { return how_; }

 protected:
  /// As in the core, for whatever is built on this filter; the belief is one that restore() takes.
  template <class Model, class Rule, class Report>
  Status correct(const typename Model::Measurement& z, const Model& model, Rule&& rule,
                 Report& correction) {
    BeliefType& belief = this->belief_in_place();
    const BeliefType before = belief;
    const std::decay_t<Rule> as_it_was = rule;
    const Status status = Base::correct(z, model, rule, correction);
    if (status != Status::kOk || keeps(before.P.diagonal(), belief)) return status;
    belief = before;
    rule = as_it_was;
    return Status::kOverflow;
  }

 private:
  static bool keeps(const typename Base::State& variances_before, BeliefType& belief) {
    return (is_well_conditioned(belief.P) && math::all_finite(belief.x)) ||
           mend_belief<RuntimeGaussian>(variances_before, belief);
  }

  AnyLinearisation<Scalar> how_;
};

template <class Scalar, int N>
struct PlacedSensor;

const int kMaxComponents = 255;  ///< of a Gaussian sum

/// An array as long as it is asked to be.
template <class Element>
class Sequence {
 public:
  void resize(int size) { elements_.resize(static_cast<std::size_t>(size)); }
  Element& operator[](int k) { return elements_[static_cast<std::size_t>(k)]; }
  const Element& operator[](int k) const { return elements_[static_cast<std::size_t>(k)]; }

 private:
  std::vector<Element> elements_;
};

/// As ComponentArrays, but only as many as a filter asks for: most ask for none.
template <class Scalar, int N>
struct ComponentSequences {
  std::uint8_t size = 1;
  Sequence<Scalar> weight;
  Sequence<Belief<Scalar, N>> component;

  void reserve(int most) {
    weight.resize(most);
    component.resize(most);
  }
};

template <class Scalar>
using RuntimeRule = RobustUpdate<AnyKernel<Scalar>, AnyRecovery<Scalar>>;

template <class Scalar, int N>
using RuntimeInside = Robust<RuntimeGaussian<Scalar, N>, RuntimeRule<Scalar>>;

/// A Gaussian sum, of one component where nothing else is asked for; one state is no position.
template <class Scalar, int N>
using RuntimeSum = std::conditional_t<
    (N > 1), GaussianSum<RuntimeInside<Scalar, N>, kMaxComponents, ComponentSequences<Scalar, N>>,
    RuntimeInside<Scalar, N>>;

/// The same with any kernel and recovery, and with sensors that are chosen at run time.
template <class Scalar_, int N>
class RuntimeRobust : public RuntimeSum<Scalar_, N> {
 public:
  using Scalar = Scalar_;
  using Base = RuntimeSum<Scalar, N>;
  using Base::Base;
  using Base::update;

  /// With the process's input, where there is one.
  template <class... Input>
  Status predict(Scalar dt, const Input&... input) {
    if constexpr (N > 1) {
      if (this->size() > 1) {
        return kept([&] { return Base::predict(dt, input...); });
      }
    }
    return Base::predict(dt, input...);
  }

  /// The belief and the recovery of a run that has gone on elsewhere.
  void put(const typename Base::BeliefType& belief, const RejectionStreak<Scalar>& streak) {
    this->belief_in_place() = belief;
    this->rule_in_place().recovery.streak = streak;
  }

  Report<Scalar> update(const Vector<Scalar, kMaxSize>& z, const PlacedSensor<Scalar, N>& sensor) {
    if constexpr (N > 1) {
      if (this->params().components > 1) {
        return kept([&] { return sensor.model->update(*this, z, sensor); });
      }
    }
    return sensor.model->update(*this, z, sensor);
  }

 private:
  static Status status_of(Status status) { return status; }
  static Status status_of(const Report<Scalar>& report) { return report.status; }

  /// What a step of several components says, which leaves what restore() takes. Where that cannot
  /// be, as their moments leave the format, nothing has changed.
  template <class Step>
  std::invoke_result_t<Step> kept(const Step& step) {
    const RuntimeRobust before = *this;
    const std::invoke_result_t<Step> said = step();
    if (status_of(said) != Status::kOk || mend_sum(before.belief().P.diagonal())) return said;
    *this = before;
    return std::invoke_result_t<Step>(Status::kOverflow);
  }

  /// As mend_belief() for the components, which a ring of them may have split off from a covariance
  /// that is nearly singular, and for their moments, which are sums.
  bool mend_sum(const Vector<Scalar, N>& variances_before) {
    using Gaussian = RuntimeGaussian<Scalar, N>;
    bool well = is_well_conditioned(this->belief().P) && math::all_finite(this->belief().x);
    for (int k = 0; k < this->size(); ++k) well = well && is_well_conditioned(this->component(k).P);
    if (well) return true;
    auto state = this->state();
    bool mended = false;
    for (int k = 0; this->size() > 1 && k < this->size(); ++k) {
      auto& component = state.mixture.component[k];
      if (Gaussian::check_belief(component) == Status::kOk) continue;
      mend_belief<Gaussian>(variances_before, component);
      mended = true;
    }
    typename Base::BeliefType whole = this->belief();
    if (mended) state.mixture.moments(whole);
    mend_belief<Gaussian>(variances_before, whole);
    return this->restore(whole, this->rule(), state) == Status::kOk;
  }
};

template <class Scalar, int N>
struct SensorFor : AnySensor<Scalar> {
  using AnySensor<Scalar>::AnySensor;
  virtual Report<Scalar> update(RuntimeRobust<Scalar, N>& filter, const Vector<Scalar, kMaxSize>& z,
                                const PlacedSensor<Scalar, N>& placed) const = 0;
};

/// A sensor and where it stood.
template <class Scalar, int N>
struct PlacedSensor {
  using Measurement = Vector<Scalar, kMaxSize>;

  std::shared_ptr<const SensorFor<Scalar, N>> model;
  bool moved = false;  ///< to `place`; else the model's own place counts
  Scalar place[kMaxPlace] = {};
};

/// A process without Jacobian is for points only: an EKF's prediction is refused.
template <class Process>
class ProcessOf final : public ProcessFor<typename Process::Scalar, Process::kStates> {
 public:
  using Scalar = typename Process::Scalar;
  static constexpr int kStates = Process::kStates;
  static constexpr int kInputs = input_size<Process>();
  static_assert(CheckProcess<Process>::kComplete, "");
  using Base = ProcessFor<Scalar, kStates>;
  using typename Base::Input;

  /// `count`: how many of the numbers of the model's input count.
  explicit ProcessOf(const Process& process, int count = kInputs)
      : Base(Process::kPosition, count, Process::kTranslation, Process::kLinear),
        process_(process) {}

  const Process& process() const { return process_; }

  Status predict(const AnyLinearisation<Scalar>& how, Belief<Scalar, kStates>& belief, Scalar dt,
                 const Input& input) const override {
    const Process& driven_process = driven(input, Inputs<kInputs>());
    if constexpr (propagates<Process>()) {
      return how.predict(driven_process, belief, dt);
    } else {
      if (how.kind == AnyLinearisation<Scalar>::Kind::kUkf) {
        return predict_by_points(how.unscented, driven_process, belief, dt, IsLinear<false>());
      }
      if (how.kind == AnyLinearisation<Scalar>::Kind::kCkf) {
        return predict_by_points(how.cubature, driven_process, belief, dt, IsLinear<false>());
      }
      return Status::kBadParameter;
    }
  }
  Scalar position_variance(const Belief<Scalar, kStates>& belief, Scalar dt,
                           const Input& input) const override {
    const Process& driven_process = driven(input, Inputs<kInputs>());
    if constexpr (propagates<Process>()) {
      return driven_process.position_variance(belief, dt);
    } else {
      Belief<Scalar, kStates> later = belief;
      const CubaturePoints<Scalar> points(kStates);
      predict_by_points(points, driven_process, later, dt, IsLinear<false>());
      return kStates > 1 ? later.P(0, 0) + later.P(kStates > 1, kStates > 1) : later.P(0, 0);
    }
  }
  Vector<Scalar, kStates> residual(const Vector<Scalar, kStates>& a,
                                   const Vector<Scalar, kStates>& b) const override {
    return process_.residual(a, b);
  }

  void f(const Scalar* x, Scalar dt, const Scalar* input, Scalar* out) const override {
    copy(driven(to_input(input), Inputs<kInputs>()).f(to_state(x), dt), out);
  }
  void Phi(const Scalar* x, Scalar dt, const Scalar* input, Scalar* out) const override {
    if constexpr (has_Phi<Process>()) {
      copy(driven(to_input(input), Inputs<kInputs>()).Phi(to_state(x), dt), out);
    } else {
      std::fill_n(out, kStates * kStates, std::numeric_limits<Scalar>::quiet_NaN());
    }
  }
  void Q(Scalar dt, const Scalar* input, Scalar* out) const override {
    copy(driven(to_input(input), Inputs<kInputs>()).Q(dt), out);
  }

 private:
  template <int>
  struct Inputs {};

  Input to_input(const Scalar* values) const {
    Input input = Input::Zero();
    for (int i = 0; i < this->inputs; ++i) input(i) = values[i];
    return input;
  }
  static typename Process::State to_state(const Scalar* values) {
    typename Process::State x;
    for (int i = 0; i < kStates; ++i) x(i) = values[i];
    return x;
  }
  template <int Rows, int Cols>
  static void copy(const Matrix<Scalar, Rows, Cols>& matrix, Scalar* out) {
    for (int i = 0; i < Rows * Cols; ++i) out[i] = matrix.data()[i];
  }

  const Process& driven(const Input&, Inputs<0>) const { return process_; }
  template <int U>
  Process driven(const Input& input, Inputs<U>) const {
    Process process = process_;
    for (int i = 0; i < U; ++i) process.input(i) = input(i);
    return process;
  }

  Process process_;
};

/// A model without Jacobian as filters can take it that never ask for one.
template <class Model>
struct WithoutJacobian : Model {
  struct Point : decltype(std::declval<const Model&>().about(typename Model::State())) {
    typename Model::Jacobian H() const {
      return Model::Jacobian::Constant(std::numeric_limits<typename Model::Scalar>::quiet_NaN());
    }
  };

  explicit WithoutJacobian(const Model& model) : Model(model) {}

  Point about(const typename Model::State& x) const { return Point{Model::about(x)}; }
};

/// A model without Jacobian is for points only: an EKF's update is refused.
template <class Model>
class SensorOf final : public SensorFor<typename Model::Scalar, Model::kStates> {
 public:
  using Scalar = typename Model::Scalar;
  static constexpr int kStates = Model::kStates;
  static constexpr int kSize = Model::kSize;
  static_assert(CheckSensor<Model>::kComplete, "");
  using Base = SensorFor<Scalar, kStates>;

  explicit SensorOf(const Model& model) : Base(kStates, kSize, Model::kPlace), model_(model) {}

  const Model& model() const { return model_; }

  Report<Scalar> update(RuntimeRobust<Scalar, kStates>& filter, const Vector<Scalar, kMaxSize>& z,
                        const PlacedSensor<Scalar, kStates>& placed) const override {
    typename Model::Measurement value;
    for (int i = 0; i < kSize; ++i) value(i) = z(i);
    if (!placed.moved) return update(filter, value, model_);
    Model there = model_;
    there.place(placed.place);
    const Status status = there.check();
    return status == Status::kOk ? update(filter, value, there) : Report<Scalar>(status);
  }

  void measure(const Scalar* x, Scalar* z, std::size_t rows) const override {
    for (std::size_t k = 0; k < rows; ++k) {
      typename Model::State state;
      for (int i = 0; i < kStates; ++i) state(i) = x[k * kStates + static_cast<std::size_t>(i)];
      const typename Model::Measurement value = model_.h(state);
      for (int i = 0; i < kSize; ++i) z[k * kSize + static_cast<std::size_t>(i)] = value(i);
    }
  }

 private:
  static Report<Scalar> update(RuntimeRobust<Scalar, kStates>& filter,
                               const typename Model::Measurement& z, const Model& model) {
    if constexpr (has_H<Model>()) {
      return Report<Scalar>(filter.update(z, model));
    } else {
      if (filter.linearisation().kind == AnyLinearisation<Scalar>::Kind::kEkf) {
        return Report<Scalar>(Status::kBadParameter);
      }
      return Report<Scalar>(filter.update(z, WithoutJacobian<Model>(model)));
    }
  }

  Model model_;
};

}  // namespace desk
}  // namespace auvest
