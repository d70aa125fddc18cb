// What a filter asks of a process model, and the defaults a model inherits.
//
// A process model is a plain struct. It derives from ProcessModel<Itself, Scalar, N> and offers
//
//     Vector<Scalar, N>    f(x, dt)    the state after dt seconds without noise
//     Matrix<Scalar, N, N> Q(dt)       covariance of the process noise of those dt seconds; or
//                                      add_noise(P, dt), which adds it to a lower triangle
//     Matrix<Scalar, N, N> Phi(x, dt)  Jacobian of f with respect to x (EKF only)
//     Status               check()     kOk, or kBadParameter if a parameter is out of range
//
// It may override
//
//     residual(a, b)         a - b, wrapped where a state is an angle that f wraps
//     about(x, dt)           an expansion with deviations in closed form (see NumericExpansion)
//     kClosedForm            true if it does
//     propagate(belief, dt)  x <- f, P <- Phi P Phi' + Q in place, from the structure of Phi
//     kLinear                true if f is linear in x: the UKF then calls propagate, which is exact
//     kTranslation           true if f moves every state by the same, and Q does not depend on x
//     kPosition              how many of the first states are the position: 2
//     Input, input           type and value of what drives the process (a Vector), for
//                            predict(dt, input)
//     position_variance(belief, dt)
//                            P_xx + P_yy after dt, for interval policies
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Derived, class Scalar_, int N>
struct ProcessModel {
  using Scalar = Scalar_;
  using State = Vector<Scalar, N>;
  using Covariance = Matrix<Scalar, N, N>;
  static constexpr int kStates = N;
  static constexpr bool kLinear = false;
  static constexpr bool kClosedForm = false;
  static constexpr bool kTranslation = false;
  static constexpr int kPosition = N < 2 ? N : 2;

  static constexpr bool translates() { return Derived::kTranslation; }
  static constexpr int position_states() { return Derived::kPosition; }

  /// f about x, with deviations by subtraction: f(x + e) - f(x) loses the digits that f(x) and
  /// f(x + e) share, so filters limit how small alpha may be (see SigmaPoints).
  struct NumericExpansion {
    const Derived& model;
    State x;
    Scalar dt;
    State centre;

    const State& value() const { return centre; }

    /// sum = d+ + d-, difference = d+ - d-, where d+- = f(x +- e) - f(x).
    void deviations(const State& e, State& sum, State& difference) const {
      const State d_plus = model.residual(model.f(x + e, dt), centre);
      const State d_minus = model.residual(model.f(x - e, dt), centre);
      for (int i = 0; i < N; ++i) {
        sum(i) = d_plus(i) + d_minus(i);
        difference(i) = d_plus(i) - d_minus(i);
      }
    }
  };

  /// From the model's add_noise(P, dt), for a model that has no Q of its own.
  Covariance Q(Scalar dt) const {
    Covariance q;
    math::set_zero(q);
    derived().add_noise(q, dt);
    math::mirror_lower(q);
    return q;
  }

  NumericExpansion about(const State& x, Scalar dt) const {
    return NumericExpansion{derived(), x, dt, derived().f(x, dt)};
  }

  void propagate(Belief<Scalar, N>& belief, Scalar dt) const {
    const Covariance noise = derived().Q(dt);
    belief.P = math::symmetric_product(derived().Phi(belief.x, dt), belief.P);
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j <= i; ++j) belief.P(i, j) = belief.P(i, j) + noise(i, j);
    }
    belief.x = derived().f(belief.x, dt);
  }

  /// P_xx + P_yy (the variances of the first two states) after dt seconds under the input as it is.
  Scalar position_variance(const Belief<Scalar, N>& belief, Scalar dt) const {
    Belief<Scalar, N> later = belief;
    math::mirror_lower(later.P);
    derived().propagate(later, dt);
    return N > 1 ? later.P(0, 0) + later.P(N > 1 ? 1 : 0, N > 1 ? 1 : 0) : later.P(0, 0);
  }

  State residual(const State& a, const State& b) const {
    State difference;
    for (int i = 0; i < N; ++i) difference(i) = a(i) - b(i);
    return difference;
  }

  Status check() const { return Status::kOk; }

 private:
  const Derived& derived() const { return static_cast<const Derived&>(*this); }
};

/// The input of a process that has none.
struct NoInput {};

/// Whether a process has an input, of which type, and whether what is `Given` can be it.
template <class Process>
class InputOf {
  static constexpr bool agree(int rows, int given) {
    return rows == given || rows == Eigen::Dynamic || given == Eigen::Dynamic;
  }

  template <class Input, class Given>
  static constexpr bool alike(const typename Input::Scalar*, const typename Given::Scalar*) {
    return IsSame<typename Input::Scalar, typename Given::Scalar>::value &&
           agree(Input::RowsAtCompileTime, Given::RowsAtCompileTime);
  }
  template <class Input, class Given>
  static constexpr bool alike(...) {
    return IsSame<Input, Given>::value;
  }

  template <class P>
  static constexpr bool declared(const typename P::Input*) {
    return true;
  }
  template <class P>
  static constexpr bool declared(...) {
    return false;
  }
  // Never defined.
  template <class P>
  static typename P::Input type(const typename P::Input*);
  template <class P>
  static NoInput type(...);
  template <class P, class Given>
  static constexpr bool takes(const typename P::Input*) {
    return alike<typename P::Input, Given>(nullptr, nullptr);
  }
  template <class P, class Given>
  static constexpr bool takes(...) {
    return false;
  }

 public:
  static constexpr bool kExists = declared<Process>(nullptr);
  using Type = decltype(type<Process>(nullptr));

  template <class Given>
  static constexpr bool can_be() {
    return takes<Process, Given>(nullptr);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
