// What a filter asks of a measurement model, and the defaults a model inherits.
//
// A measurement model is a plain struct. It derives from
// MeasurementModel<Itself, Scalar, N, M, Observed>, where the measurement depends on the first
// `Observed` states only (leave it out if on all of them), and offers
//
//     Vector<Scalar, M>           h(x)   the measurement without noise
//     Matrix<Scalar, M, M>        R()    covariance of its noise
//     Matrix<Scalar, M, Observed> H(x)   Jacobian of h (EKF only)
//     Status                      check()  kOk, kBadParameter if a parameter is out of range, or
//                                          kFarFromOrigin if a coordinate is (resolution.hpp);
//                                          for who builds the model, once: an update does not ask
//
// It may override
//
//     residual(z, predicted)      z - predicted, wrapped where a component is an angle
//     about(x)                    an expansion with deviations in closed form
//     kClosedForm                 true if it does
//     admits(z)                   kOk, or why the sensor cannot have measured these finite numbers
//     second_order(point, root, innovation, noise)
//                                 for the EKF: takes the mean of the second-order term of h, over
//                                 the belief with P_oo = root root', off the innovation and adds
//                                 its covariance to `noise`
//     kPlace, place(p)            how many numbers come with each measurement and are no part of it
//                                 (where a station or a leader stood, how an instrument was
//                                 headed), and their setter: for records in which they change
//     kCircle, centre(p)          true where the measurement is the distance of the first two
//                                 states from a point (p[0], p[1]), and that point: for GaussianSum
//     near_field(point, P, z, innovation, noise)
//                                 for a model with M = Observed: true where h is useless at the
//                                 scale of the belief; the filter then takes the measurement as one
//                                 of the observed states themselves, x_o + innovation, with
//                                 covariance `noise`. `point` is about(x)
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Derived, class Scalar_, int N, int M, int Observed = N>
struct MeasurementModel {
  static_assert(0 < Observed && Observed <= N, "Observed counts leading states");
  using Scalar = Scalar_;
  using State = Vector<Scalar, N>;
  using ObservedState = Vector<Scalar, Observed>;
  using Measurement = Vector<Scalar, M>;
  using Noise = Matrix<Scalar, M, M>;
  using Jacobian = Matrix<Scalar, M, Observed>;
  static constexpr int kStates = N;
  static constexpr int kSize = M;
  static constexpr int kObserved = Observed;
  static constexpr bool kClosedForm = false;
  static constexpr int kPlace = 0;
  static constexpr bool kCircle = false;

  /// h about x, with deviations by subtraction (wrapped by `residual`).
  struct NumericExpansion {
    const Derived& model;
    State x;
    Measurement centre;

    const Measurement& value() const { return centre; }
    Jacobian H() const { return model.H(x); }

    /// sum = d+ + d-, difference = d+ - d-, where d+- = h(x +- e) - h(x) and e moves the observed
    /// states.
    void deviations(const ObservedState& e, Measurement& sum, Measurement& difference) const {
      State plus = x;
      State minus = x;
      for (int i = 0; i < Observed; ++i) {
        plus(i) = x(i) + e(i);
        minus(i) = x(i) - e(i);
      }
      const Measurement d_plus = model.residual(model.h(plus), centre);
      const Measurement d_minus = model.residual(model.h(minus), centre);
      for (int i = 0; i < M; ++i) {
        sum(i) = d_plus(i) + d_minus(i);
        difference(i) = d_plus(i) - d_minus(i);
      }
    }
  };

  NumericExpansion about(const State& x) const {
    return NumericExpansion{derived(), x, derived().h(x)};
  }

  void place(const Scalar*) {}

  Status admits(const Measurement&) const { return Status::kOk; }

  Measurement residual(const Measurement& z, const Measurement& predicted) const {
    Measurement difference;
    for (int i = 0; i < M; ++i) difference(i) = z(i) - predicted(i);
    return difference;
  }

  template <class Point>
  void second_order(const Point&, const Matrix<Scalar, Observed, Observed>&, Measurement&,
                    Noise&) const {}

  template <class Point>
  bool near_field(const Point&, const Matrix<Scalar, N, N>&, const Measurement&, Measurement&,
                  Noise&) const {
    return false;
  }

  Status check() const { return Status::kOk; }

 private:
  const Derived& derived() const { return static_cast<const Derived&>(*this); }
};

/// A measurement as a caller may write it, as the model has it: one number, or any expression. What
/// does not fit is one error, here, and not some of Eigen's.
template <class Model>
struct MeasurementOf {
  using Measurement = typename Model::Measurement;
  using Scalar = typename Measurement::Scalar;

  static Measurement from(Scalar z) {
    static_assert(Model::kSize == 1,
                  "this sensor measures more than one number: give a Vector of them");
    Measurement one;
    one(0) = z;
    return one;
  }

  template <class Z>
  static Measurement from(const Eigen::MatrixBase<Z>& z) {
    constexpr int kRows = Z::RowsAtCompileTime;
    constexpr int kWanted = Measurement::RowsAtCompileTime;
    constexpr bool kFits = kRows == kWanted || kRows == Eigen::Dynamic || kWanted == Eigen::Dynamic;
    constexpr bool kAlike = IsSame<typename Z::Scalar, Scalar>::value;
    static_assert(kFits, "z has not as many numbers as this sensor measures");
    static_assert(kAlike, "z is of another number type than the sensor: z.cast<float>() gives it");
    return evaluate(z, Possible < kFits && kAlike > ());
  }

 private:
  template <bool>
  struct Possible {};

  template <class Z>
  static Measurement evaluate(const Z& z, Possible<true>) {
    return z;
  }
  template <class Z>
  static Measurement evaluate(const Z&, Possible<false>) {
    return Measurement();
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
