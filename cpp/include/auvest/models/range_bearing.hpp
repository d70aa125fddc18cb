// Range and bearing from a fixed station, [AUKF 6] of the AUKF paper (Deng, Yin, Duan 2019).
//
//   r = |D| + v_r,  bearing = atan2(D_y, D_x) + v_b,  D = (x, y) - station
//
// Differs from [AUKF 6]: atan2 where the paper prints arctan, and residuals wrapped to (-pi, pi].
//
// Deviations in closed form, [UKF R1] to [UKF B2]. With the complex number u = p + i q,
//     p = D.e / |D|^2,   q = (D x e) / |D|^2,
// a sigma point D + e is D (1 + u). Everything the unscented transform needs follows from
// a+- = |1 +- u| and w = 1 - |u|^2, and nothing cancels (derived in docs/algorithms/ukf.md):
//     range    d+ - d- = 4 |D| p / (a+ + a-)
//              d+ + d- = 2 |D| g / (a+ + a- + 2),  g = a+ a- - w = 4 q^2 / (a+ a- + w)
//     bearing  d+ - d- = arg((1 + u) conj(1 - u)) = atan2(2 q, w)
//              d+ + d- = arg((1 + u)(1 - u))      = atan2(-2 p q, 1 - p^2 + q^2)
// Seen from the station, the segment from D - e to D + e subtends less than pi, so none of these
// angles needs wrapping. To first order in |u|^2 they are 2 |D| p, |D| q^2, 2 q and -2 p q, and for
// |u|^2 below epsilon / 4 the difference is lost in rounding.
//
// Near the station. Where the spread of the belief reaches the range, neither the slope of the
// bearing at the mean nor a few points around it describe what was measured; at the station itself
// the bearing is not even defined. There the measurement is taken as what it says about the
// position, c = station + r (cos b, sin b), which is linear in the state. Its error has, along the
// measured direction, the mean square sigma_r^2 + 3/4 r^2 sigma_b^4 and, across it,
// (r^2 + sigma_r^2) sigma_b^2.
#pragma once

#include "auvest/math/angle.hpp"
#include "auvest/math/resolution.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/measurement_model.hpp"
#include "auvest/models/range_limits.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_, int N>
struct RangeBearing : MeasurementModel<RangeBearing<Scalar_, N>, Scalar_, N, 2, 2> {
  using Base = MeasurementModel<RangeBearing<Scalar_, N>, Scalar_, N, 2, 2>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;
  static constexpr bool kClosedForm = true;
  static constexpr int kPlace = 2;

  struct Params : RangeLimits<Scalar> {
    Scalar station_x_m = Scalar(0.2);         ///< b_x, Table 1
    Scalar station_y_m = Scalar(2);           ///< b_y, Table 1
    Scalar sigma_range_m = Scalar(0.05);      ///< standard deviation of v_r (not in the paper)
    Scalar sigma_bearing_rad = Scalar(0.01);  ///< standard deviation of v_b (not in the paper)
    /// Position form below this many standard deviations sqrt(P_xx + P_yy) of range: enough that
    /// the estimate is never on the wrong side of the station. 0: only below 1e-15 m.
    Scalar near_field = Scalar(5);

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("station_x_m", station_x_m);
      v("station_y_m", station_y_m);
      v("sigma_range_m", sigma_range_m);
      v("sigma_bearing_rad", sigma_bearing_rad);
      v("near_field", near_field);
      RangeLimits<Scalar>::visit(v);
    }
  };

  Params params;

  explicit constexpr RangeBearing(const Params& p = Params()) : params(p) {}

  /// Moves the station to (p[0], p[1]) [m].
  void place(const Scalar* p) {
    params.station_x_m = p[0];
    params.station_y_m = p[1];
  }

  struct Expansion {
    Scalar offset[2];  // D
    Scalar square, range, inverse_square;
    Measurement centre;

    const Measurement& value() const { return centre; }

    Jacobian H() const {
      const Scalar inverse = Scalar(1) / range;
      Jacobian jacobian;
      jacobian(0, 0) = offset[0] * inverse;
      jacobian(0, 1) = offset[1] * inverse;
      jacobian(1, 0) = -(offset[1] * inverse_square);
      jacobian(1, 1) = offset[0] * inverse_square;
      return jacobian;
    }

    AUVEST_INLINE void deviations(const ObservedState& e, Measurement& sum,
                                  Measurement& difference) const {
      using math::atan2;
      const Scalar one = Scalar(1);
      const Scalar p = math::dot(offset, e.data(), 2) * inverse_square;
      const Scalar q = math::cross(offset, e.data()) * inverse_square;
      const Scalar two_q = q + q;
      const Scalar two_range = range + range;
      const Scalar pp = p * p;
      const Scalar qq = q * q;
      const Scalar uu = pp + qq;
      if (uu < Scalar(0.25) * math::machine_epsilon<Scalar>()) {
        sum(0) = range * qq;
        difference(0) = two_range * p;
        sum(1) = -(p * two_q);
        difference(1) = two_q;
        return;
      }
      const Scalar w = one - uu;
      const Scalar a_plus = length(one + p, qq);
      const Scalar a_minus = length(one - p, qq);
      const Scalar a_sum = a_plus + a_minus;
      const Scalar a_product = a_plus * a_minus;
      Scalar g = a_product - w;
      if (w > Scalar(0)) g = two_q * two_q / (a_product + w);  // [UKF R3]
      sum(0) = two_range * g / (a_sum + Scalar(2));            // [UKF R2]
      difference(0) = two_range * (p + p) / a_sum;             // [UKF R1]
      sum(1) = atan2(-(p * two_q), (one - pp) + qq);           // [UKF B1]
      difference(1) = atan2(two_q, w);                         // [UKF B2]
    }

   private:
    /// |1 + u|, from 1 + p and q^2.
    static AUVEST_INLINE Scalar length(Scalar one_p, Scalar qq) {
      return math::sqrt(one_p * one_p + qq);
    }
  };

  AUVEST_INLINE Expansion about(const State& x) const {
    using math::atan2;
    using math::sqrt;
    Expansion point;
    point.offset[0] = x(0) - params.station_x_m;
    point.offset[1] = x(1) - params.station_y_m;
    point.square = math::dot(point.offset, point.offset, 2);
    point.range = sqrt(point.square);
    point.inverse_square = Scalar(1) / point.square;
    // [AUKF 6]
    point.centre(0) = point.range;
    point.centre(1) = atan2(point.offset[1], point.offset[0]);
    return point;
  }

  /// Range and bearing without noise; at the station itself range 0 and bearing 0.
  Measurement h(const State& x) const {
    using math::atan2;
    using math::sqrt;
    const Scalar dx = x(0) - params.station_x_m;
    const Scalar dy = x(1) - params.station_y_m;
    Measurement z;
    z(0) = sqrt(dx * dx + dy * dy);  // [AUKF 6]
    z(1) = atan2(dy, dx);
    return z;
  }

  /// Jacobian of h for range and bearing; not defined (not finite) at the station itself, where the
  /// filters use the near field.
  Jacobian H(const State& x) const { return about(x).H(); }

  Noise R() const {
    Noise noise;
    noise(0, 0) = params.sigma_range_m * params.sigma_range_m;
    noise(1, 0) = noise(0, 1) = Scalar(0);
    noise(1, 1) = params.sigma_bearing_rad * params.sigma_bearing_rad;
    return noise;
  }

  Measurement residual(const Measurement& z, const Measurement& predicted) const {
    Measurement difference;
    difference(0) = z(0) - predicted(0);
    difference(1) = math::wrap(z(1) - predicted(1));
    return difference;
  }

  Status admits(const Measurement& z) const { return params.admits(z(0)); }

  /// The bend of the range over a belief as wide as far: only where it is more than three sigma of
  /// the range, so that elsewhere the EKF is the textbook's. Without it the range claims to know
  /// the position along the line of sight to centimetres and its variance across it, of kilometres,
  /// takes all digits of the format.
  AUVEST_INLINE void second_order(const Expansion& point, const Matrix<Scalar, 2, 2>& root,
                                  Measurement& innovation, Noise& noise) const {
    // L' n |D| with n across the line of sight
    const Scalar first = point.offset[0] * root(1, 0) - point.offset[1] * root(0, 0);
    const Scalar second = point.offset[0] * root(1, 1);
    const Scalar inverse = Scalar(1) / point.range;
    const Scalar twice = (first * first + second * second) * point.inverse_square * inverse;
    const Scalar bend = Scalar(0.5) * twice;
    if (!(twice * bend > Scalar(9) * noise(0, 0))) return;
    innovation(0) = innovation(0) - bend;
    noise(0, 0) = noise(0, 0) + twice * bend;
  }

  AUVEST_INLINE bool near_field(const Expansion& point, const Matrix<Scalar, N, N>& P,
                                const Measurement& z, Measurement& innovation, Noise& noise) const {
    const Scalar reach = params.near_field * params.near_field * (P(0, 0) + P(1, 1));
    if (point.square > reach + Scalar(1e-30)) return false;  // [UKF N1]
    as_position(point, z, innovation, noise);
    return true;
  }

  Status check() const {
    const bool valid = math::is_finite(params.station_x_m) && math::is_finite(params.station_y_m) &&
                       math::is_positive(params.sigma_range_m) &&
                       math::is_positive(params.sigma_bearing_rad) &&
                       math::is_nonnegative(params.near_field) && params.valid();
    if (!valid) return Status::kBadParameter;
    const Scalar variance = params.sigma_range_m * params.sigma_range_m;
    const bool far = math::is_coarse(params.station_x_m, variance) ||
                     math::is_coarse(params.station_y_m, variance);
    return far ? Status::kFarFromOrigin : Status::kOk;
  }

 protected:
  AUVEST_INLINE void as_position(const Expansion& point, const Measurement& z,
                                 Measurement& innovation, Noise& noise) const {
    Scalar sine, cosine;
    math::sincos_near(math::wrap(z(1)), sine, cosine);
    const Scalar range2 = z(0) * z(0);
    const Scalar var_range = params.sigma_range_m * params.sigma_range_m;
    const Scalar var_bearing = params.sigma_bearing_rad * params.sigma_bearing_rad;
    // [UKF N2] [UKF N3]
    const Scalar along = math::sqrt(var_range + Scalar(0.75) * range2 * var_bearing * var_bearing);
    const Scalar across = math::sqrt((range2 + var_range) * var_bearing);
    const Scalar root[2][2] = {{along * cosine, -(across * sine)}, {along * sine, across * cosine}};
    innovation(0) = z(0) * cosine - point.offset[0];
    innovation(1) = z(0) * sine - point.offset[1];
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) noise(i, j) = math::dot(root[i], root[j], 2);
    }
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
