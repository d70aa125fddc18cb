// What a model has and what it lacks, said in words: the first thing that a compiler reports of a
// model that is not complete.
#pragma once

#include <type_traits>
#include <utility>

#include "auvest/models/measurement_model.hpp"
#include "auvest/models/process_model.hpp"
#include "desk/report.hpp"

namespace auvest {
namespace desk {

template <class Model>
const Model& a_model();
template <class Model>
const typename Model::State& a_state();
template <class Model>
typename Model::Scalar a_time();

/// The type of an expression over a model: Name<Model>::Type, void where there is no such thing.
#define AUVEST_TYPE_OF(Name, ...)                                                  \
  template <class Model, class = void>                                             \
  struct Name {                                                                    \
    using Type = void;                                                             \
  };                                                                               \
  template <class Model>                                                           \
  struct Name<Model, std::void_t<decltype(__VA_ARGS__)>> {                         \
    using Type = std::remove_cv_t<std::remove_reference_t<decltype(__VA_ARGS__)>>; \
  };

AUVEST_TYPE_OF(TypeOfF, a_model<Model>().f(a_state<Model>(), a_time<Model>()))
AUVEST_TYPE_OF(TypeOfPhi, a_model<Model>().Phi(a_state<Model>(), a_time<Model>()))
AUVEST_TYPE_OF(TypeOfQ, a_model<Model>().Q(a_time<Model>()))
AUVEST_TYPE_OF(TypeOfQMember, &Model::Q)
AUVEST_TYPE_OF(
    TypeOfAddNoise,
    (a_model<Model>().add_noise(std::declval<typename Model::Covariance&>(), a_time<Model>()), 0))
AUVEST_TYPE_OF(TypeOfH, a_model<Model>().h(a_state<Model>()))
AUVEST_TYPE_OF(TypeOfJacobian, a_model<Model>().H(a_state<Model>()))
AUVEST_TYPE_OF(TypeOfR, a_model<Model>().R())
AUVEST_TYPE_OF(TypeOfPoint, a_model<Model>().about(a_state<Model>()))
AUVEST_TYPE_OF(TypeOfPointJacobian, a_model<Model>().about(a_state<Model>()).H())
AUVEST_TYPE_OF(TypeOfPropagate, &Model::propagate)
AUVEST_TYPE_OF(TypeOfPlace, &Model::place)
AUVEST_TYPE_OF(TypeOfInput, std::declval<Model&>().input)
AUVEST_TYPE_OF(TypeOfDeclaredInput, std::declval<typename Model::Input&>())
AUVEST_TYPE_OF(TypeOfParams, std::declval<typename Model::Params&>())
AUVEST_TYPE_OF(TypeOfParamsMember, std::declval<Model&>().params)

#undef AUVEST_TYPE_OF

/// Whether a type is a matrix of this size; true for void, which is told apart first.
template <class Type, int Rows, int Cols, class = void>
struct HasSize : std::is_void<Type> {};
template <class Type, int Rows, int Cols>
struct HasSize<Type, Rows, Cols, std::void_t<decltype(Type::ColsAtCompileTime)>>
    : std::bool_constant<int(Type::RowsAtCompileTime) == Rows&& int(Type::ColsAtCompileTime) ==
                         Cols> {};

/// What takes the place of the Params of a model that has none.
struct NoParams {
  template <class Visitor>
  void visit(Visitor&&) {}
};

template <class Model>
using ParamsOf = std::conditional_t<std::is_void<typename TypeOfParams<Model>::Type>::value,
                                    NoParams, typename TypeOfParams<Model>::Type>;

/// Size of a process's input, 0 if it has none.
template <class Process>
constexpr int input_size() {
  using Input = typename TypeOfDeclaredInput<Process>::Type;
  if constexpr (std::is_void<Input>::value) {
    return 0;
  } else {
    return Input::RowsAtCompileTime;
  }
}

template <class Process>
constexpr bool has_Phi() {
  return !std::is_void<typename TypeOfPhi<Process>::Type>::value;
}

/// Whether x <- f, P <- Phi P Phi' + Q can be done: by Phi, or by a propagate of the model's own.
template <class Process>
constexpr bool propagates() {
  using Scalar = typename Process::Scalar;
  constexpr int kStates = Process::kStates;
  using Inherited =
      void (ProcessModel<Process, Scalar, kStates>::*)(Belief<Scalar, kStates>&, Scalar) const;
  return has_Phi<Process>() ||
         !std::is_same<typename TypeOfPropagate<Process>::Type, Inherited>::value;
}

/// Whether a sensor has a Jacobian: H(x), or that of an expansion of its own.
template <class Model>
constexpr bool has_H() {
  using Point = typename TypeOfPoint<Model>::Type;
  if constexpr (std::is_same<Point, typename Model::NumericExpansion>::value) {
    return !std::is_void<typename TypeOfJacobian<Model>::Type>::value;
  } else {
    return !std::is_void<typename TypeOfPointJacobian<Model>::Type>::value;
  }
}

template <class Model>
constexpr bool check_params() {
  constexpr bool has_params = !std::is_same<ParamsOf<Model>, NoParams>::value;
  static_assert(
      !has_params || std::is_constructible<Model, const ParamsOf<Model>&>::value ||
          (std::is_default_constructible<Model>::value &&
           std::is_same<typename TypeOfParamsMember<Model>::Type, ParamsOf<Model>>::value),
      "your model has Params, but no member `Params params;`");
  static_assert(has_params || std::is_default_constructible<Model>::value,
                "your model has no Params and cannot be made without arguments either");
  return true;
}

/// Refuses a process that is not complete.
template <class Process>
struct CheckProcess {
  static constexpr int kStates = Process::kStates;
  using F = typename TypeOfF<Process>::Type;
  using Noise = typename TypeOfQ<Process>::Type;
  using Jacobian = typename TypeOfPhi<Process>::Type;
  using Input = typename TypeOfDeclaredInput<Process>::Type;
  static_assert(!std::is_void<F>::value,
                "your model has no f(x, dt): State f(const State& x, "
                "Scalar dt) const");
  static_assert(HasSize<F, kStates, 1>::value,
                "f(x, dt) of your model must give a State, a Vector<Scalar, N>");
  // The default Q is made by add_noise.
  using Inherited = typename Process::Covariance (
      ProcessModel<Process, typename Process::Scalar, kStates>::*)(typename Process::Scalar) const;
  static_assert(!std::is_void<Noise>::value &&
                    (!std::is_void<typename TypeOfAddNoise<Process>::Type>::value ||
                     !std::is_same<Inherited, typename TypeOfQMember<Process>::Type>::value),
                "your model has no Q(dt): Covariance Q(Scalar dt) const");
  static_assert(HasSize<Noise, kStates, kStates>::value,
                "Q(dt) of your model must give a Covariance, a Matrix<Scalar, N, N>");
  static_assert(HasSize<Jacobian, kStates, kStates>::value,
                "Phi(x, dt) of your model must give a Matrix<Scalar, N, N>");
  static_assert(input_size<Process>() <= kMaxInputs,
                "your model has more than 8 numbers in its Input");
  static_assert(std::is_same<Input, typename TypeOfInput<Process>::Type>::value,
                "your model must have both the type Input and the member `Input input;`, or "
                "neither");
  static constexpr bool kComplete = true;
};

/// Refuses a sensor that is not complete.
template <class Model>
struct CheckSensor {
  using Scalar = typename Model::Scalar;
  static constexpr int kStates = Model::kStates;
  static constexpr int kSize = Model::kSize;
  static constexpr int kObserved = Model::kObserved;
  using Value = typename TypeOfH<Model>::Type;
  using Noise = typename TypeOfR<Model>::Type;
  using Jacobian = typename TypeOfJacobian<Model>::Type;
  using InheritedPlace =
      void (MeasurementModel<Model, Scalar, kStates, kSize, kObserved>::*)(const Scalar*);
  static_assert(kSize <= kMaxSize, "your model measures more than 6 numbers");
  static_assert(Model::kPlace <= kMaxPlace, "your model has more than 3 numbers of kPlace");
  static_assert(!std::is_void<Value>::value,
                "your model has no h(x): Measurement h(const State& x) const");
  static_assert(HasSize<Value, kSize, 1>::value,
                "h(x) of your model must give a Measurement, a Vector<Scalar, M>");
  static_assert(!std::is_void<Noise>::value, "your model has no R(): Noise R() const");
  static_assert(HasSize<Noise, kSize, kSize>::value,
                "R() of your model must give a Noise, a Matrix<Scalar, M, M>");
  static_assert(HasSize<Jacobian, kSize, kObserved>::value,
                "H(x) of your model must give a Jacobian, a Matrix<Scalar, M, Observed>");
  static_assert(Model::kPlace == 0 ||
                    !std::is_same<typename TypeOfPlace<Model>::Type, InheritedPlace>::value,
                "your model has kPlace, but no place(p): void place(const Scalar* p)");
  static constexpr bool kComplete = true;
};

}  // namespace desk
}  // namespace auvest
