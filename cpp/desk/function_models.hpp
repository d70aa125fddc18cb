// Models that are functions: for a first try, in double precision, from Python or any other caller.
//
// Derivatives that are not given are central differences of fourth order,
//
//     f'(x) = (8 (f(x + h) - f(x - h)) - (f(x + 2 h) - f(x - 2 h))) / (12 h),
//
// with h = 1e-3 max(1, |x|): of a smooth function of its argument's size they are right to about
// 1e-12. What a function fails to give (an exception, kept by its caller) arrives as NaN, so that
// the filter refuses the step and stays as it was.
#pragma once

#include <array>
#include <functional>
#include <limits>

#include "auvest/math/angle.hpp"
#include "auvest/models/measurement_model.hpp"
#include "auvest/models/process_model.hpp"
#include "desk/catalogue.hpp"

namespace auvest {
namespace desk {

const int kMaxFunctionStates = 9;
const int kMaxFunctionSize = 4;

/// As in ProcessModel; arrays are row-major, `input` has as many numbers as the process is said to
/// have.
struct ProcessFunctions {
  std::function<void(const double* x, double dt, const double* input, double* out)> f;
  std::function<void(const double* x, double dt, const double* input, double* out)>
      Phi;  ///< or none
  std::function<void(double dt, const double* input, double* out)> Q;
  std::array<bool, kMaxFunctionStates> angle{};  ///< states that f wraps
  int inputs = 0;
};

/// As in MeasurementModel.
struct SensorFunctions {
  std::function<void(const double* x, double* out)> h;
  std::function<void(const double* x, double* out)> H;  ///< or none
  std::array<double, kMaxFunctionSize * kMaxFunctionSize> R{};
  std::array<bool, kMaxFunctionSize> angle{};
};

/// Column j of a Jacobian: `difference(step)` is function(x + step) - function(x - step) along j.
template <int Rows, int Cols, class Difference>
void differentiate(const Vector<double, Cols>& x, Matrix<double, Rows, Cols>& jacobian,
                   Difference difference) {
  for (int j = 0; j < Cols; ++j) {
    const double size = x(j) < 0 ? -x(j) : x(j);
    const double h = 1e-3 * (size > 1 ? size : 1.0);
    const Vector<double, Rows> near = difference(j, h);
    const Vector<double, Rows> far = difference(j, 2 * h);
    for (int i = 0; i < Rows; ++i) jacobian(i, j) = (8 * near(i) - far(i)) / (12 * h);
  }
}

template <int N>
struct FunctionProcess : ProcessModel<FunctionProcess<N>, double, N> {
  using Base = ProcessModel<FunctionProcess<N>, double, N>;
  using Scalar = double;
  using typename Base::Covariance;
  using typename Base::State;
  using Input = Vector<double, kMaxInputs>;

  ProcessFunctions functions;
  Input input = Input::Zero();

  explicit FunctionProcess(const ProcessFunctions& given) : functions(given) {}

  State f(const State& x, double dt) const {
    State next;
    functions.f(x.data(), dt, input.data(), next.data());
    return next;
  }

  Covariance Phi(const State& x, double dt) const {
    Covariance phi;
    if (functions.Phi) {
      functions.Phi(x.data(), dt, input.data(), phi.data());
    } else {
      differentiate(x, phi, [&](int j, double step) {
        State plus = x;
        State minus = x;
        plus(j) += step;
        minus(j) -= step;
        return residual(f(plus, dt), f(minus, dt));
      });
    }
    return phi;
  }

  Covariance Q(double dt) const {
    Covariance q;
    functions.Q(dt, input.data(), q.data());
    return q;
  }

  State residual(const State& a, const State& b) const {
    State difference;
    for (int i = 0; i < N; ++i) {
      const double d = a(i) - b(i);
      difference(i) = functions.angle[static_cast<std::size_t>(i)] ? math::wrap(d) : d;
    }
    return difference;
  }
};

template <int N, int M>
struct FunctionSensor : MeasurementModel<FunctionSensor<N, M>, double, N, M> {
  using Base = MeasurementModel<FunctionSensor<N, M>, double, N, M>;
  using Scalar = double;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::State;

  SensorFunctions functions;

  explicit FunctionSensor(const SensorFunctions& given) : functions(given) {}

  Measurement h(const State& x) const {
    Measurement z;
    functions.h(x.data(), z.data());
    return z;
  }

  Jacobian H(const State& x) const {
    Jacobian jacobian;
    if (functions.H) {
      functions.H(x.data(), jacobian.data());
    } else {
      differentiate(x, jacobian, [&](int j, double step) {
        State plus = x;
        State minus = x;
        plus(j) += step;
        minus(j) -= step;
        return residual(h(plus), h(minus));
      });
    }
    return jacobian;
  }

  Noise R() const {
    Noise noise;
    for (int i = 0; i < M * M; ++i) noise.data()[i] = functions.R[static_cast<std::size_t>(i)];
    return noise;
  }

  Measurement residual(const Measurement& z, const Measurement& predicted) const {
    Measurement difference;
    for (int i = 0; i < M; ++i) {
      const double d = z(i) - predicted(i);
      difference(i) = functions.angle[static_cast<std::size_t>(i)] ? math::wrap(d) : d;
    }
    return difference;
  }
};

/// The filters of the numbers of states that no model of the registry has.
void add_function_filters(Catalogue<double>& catalogue);

/// Null where there is no filter of so many states, or no sensor of so many numbers.
std::shared_ptr<const AnyProcess<double>> function_process(int states,
                                                           const ProcessFunctions& functions);
std::shared_ptr<AnySensor<double>> function_sensor(int states, int size,
                                                   const SensorFunctions& functions);

}  // namespace desk
}  // namespace auvest
