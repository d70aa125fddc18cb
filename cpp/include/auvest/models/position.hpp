// A fix of the position, in the plane or in space: GPS at the surface, or what a USBL makes of its
// ranges and angles. The first M = 2 or 3 of the N states, with an error of any covariance:
//
//     z = x_{0..M-1} + e,   e ~ N(0, R)
//
// In metres, on the axes of the state. Fixes have correlated errors: a USBL's are long across its
// line of sight and short along it, a GPS's are given as an ellipse. There is one model per fix if
// R changes from fix to fix.
//
// Linear, so the deviations are exact.
#pragma once

#include "auvest/models/measurement_model.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Whatever the number of states.
template <class Scalar, int M>
struct PositionParams {
  Matrix<Scalar, M, M> covariance_m2;  ///< R [m^2]; only its lower triangle is read. 1 m^2 I

  /// Names every member, in the order of stored records: the lower triangle row by row.
  template <class Visitor>
  void visit(Visitor&& v) {
    static const char* const names[] = {"var_x_m2",  "cov_xy_m2", "var_y_m2",
                                        "cov_xz_m2", "cov_yz_m2", "var_z_m2"};
    for (int i = 0, k = 0; i < M; ++i) {
      for (int j = 0; j <= i; ++j, ++k) v(names[k], covariance_m2(i, j));
    }
  }

  PositionParams() {
    for (int i = 0; i < M; ++i) {
      for (int j = 0; j < M; ++j) covariance_m2(i, j) = Scalar(i == j ? 1 : 0);
    }
  }
};

template <class Scalar_, int N, int M>
struct Position : MeasurementModel<Position<Scalar_, N, M>, Scalar_, N, M, M> {
  static_assert(M == 2 || M == 3, "a fix in the plane or in space");
  using Base = MeasurementModel<Position<Scalar_, N, M>, Scalar_, N, M, M>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;
  static constexpr bool kClosedForm = true;

  using Params = PositionParams<Scalar, M>;

  Params params;

  explicit Position(const Params& p = Params()) : params(p) {}

  struct Expansion {
    Measurement centre;

    const Measurement& value() const { return centre; }

    Jacobian H() const {
      Jacobian jacobian;
      math::set_zero(jacobian);
      for (int i = 0; i < M; ++i) jacobian(i, i) = Scalar(1);
      return jacobian;
    }

    AUVEST_INLINE void deviations(const ObservedState& e, Measurement& sum,
                                  Measurement& difference) const {
      AUVEST_UNROLL
      for (int i = 0; i < M; ++i) {
        sum(i) = Scalar(0);
        difference(i) = e(i) + e(i);
      }
    }
  };

  AUVEST_INLINE Expansion about(const State& x) const {
    Expansion point;
    AUVEST_UNROLL
    for (int i = 0; i < M; ++i) point.centre(i) = x(i);
    return point;
  }

  Measurement h(const State& x) const { return about(x).centre; }
  Jacobian H(const State& x) const { return about(x).H(); }

  Noise R() const {
    Noise noise = params.covariance_m2;
    math::mirror_lower(noise);
    return noise;
  }

  /// kBadParameter also if R is not positive definite.
  Status check() const {
    const bool valid = math::lower_finite(params.covariance_m2) &&
                       math::is_positive_definite(params.covariance_m2);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
