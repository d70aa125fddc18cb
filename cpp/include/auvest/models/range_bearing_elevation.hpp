// Slant range, bearing and elevation from a fixed station: a USBL, for states that begin with
// [x, y, z].
//
//     r = |D| + v_r,  bearing = atan2(D_y, D_x) + v_b,  elevation = atan2(D_z, rho) + v_e,
//     D = (x, y, z) - station,  rho = |(D_x, D_y)|
//
// The bearing counts from +x towards +y, the elevation from the horizontal towards +z: where z
// points down it is the depression, and an angle from the vertical below is pi / 2 minus it.
// Residuals are wrapped to (-pi, pi].
//
// Deviations in closed form; range_bearing.hpp has those in the plane. With the half sum h and the
// half difference d of |1 +- u| - 1, functions of p = D.e / |D|^2 and q = |D x e| / |D|^2 alone,
//
//     |D +- e| = |D| (1 + h +- d)
//     d = 2 p / (a+ + a-),   h = g / (a+ + a- + 2),   g = a+ a- - w = 4 q^2 / (a+ a- + w)
//     a+- = |1 +- (p + i q)|,   w = 1 - p^2 - q^2
//
// which holds in space as in the plane. The bearing is that of the plane, with p_o and q_o of the
// horizontal parts of D and e, and rho+- = rho (1 + h_o +- d_o). For the elevation take the complex
// number C = rho + i D_z. Divided by C, those of D +- e are A +- B with
//
//     A = 1 + h_o rho / C,   B = (d_o rho + i e_z) / C,
//
// where A - 1 and B^2 are of second order. Arguments of products add:
//
//     elevation  d+ + d- = arg((A + B)(A - B))       = arg(A^2 - B^2)
//                d+ - d- = arg((A + B) conj(A - B))  = arg(|A|^2 - |B|^2 + 2 i Im(B conj A))
//
// Nothing cancels but what cancels in the sum itself.
//
// Near the vertical through the station. There the bearing turns by any angle over a short way, and
// on it bearing and slopes are not defined; near the station this is so for the elevation too.
// Where the spread of the belief reaches the vertical or the station, the measurement is taken as
// what it says about the position, c = station + r n, which is linear in the state. With n the
// measured direction, m the one above it (towards more elevation), b the horizontal one across, k
// the horizontal one along, and c_e the cosine of the elevation, the mean square of its error is,
// to fourth order in the angles and with s^2 = r^2 + sigma_r^2,
//
//     sigma_r^2 n n' + s^2 sigma_e^2 m m' + s^2 (c_e^2 + sigma_e^2 (1 - c_e^2)) sigma_b^2 b b'
//         + s^2 (sigma_e^4 n n' / 2 + c_e^2 sigma_b^4 k k' / 2 + t t' / 4)
//     with t = sigma_e^2 n + c_e sigma_b^2 k
//
// This is what the model's noise says, and that has a bearing as good above the station as at the
// horizon. An instrument has not: its error across is an angle sigma on the sphere,
// sigma_b = sigma / cos(elevation) up to 1, and should be given so, with a model per measurement.
#pragma once

#include "auvest/math/angle.hpp"
#include "auvest/math/resolution.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/measurement_model.hpp"
#include "auvest/models/range_limits.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Whatever the number of states.
template <class Scalar>
struct RangeBearingElevationParams : RangeLimits<Scalar> {
  Scalar station_x_m = Scalar(0);
  Scalar station_y_m = Scalar(0);
  Scalar station_z_m = Scalar(0);
  Scalar sigma_range_m = Scalar(0.5);         ///< standard deviation of v_r
  Scalar sigma_bearing_rad = Scalar(0.01);    ///< standard deviation of v_b
  Scalar sigma_elevation_rad = Scalar(0.01);  ///< standard deviation of v_e
  /// Position form below this many standard deviations sqrt(P_xx + P_yy) of horizontal distance or
  /// sqrt(P_xx + P_yy + P_zz) of range. 0: only below 1e-15 m.
  Scalar near_field = Scalar(5);

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    v("station_x_m", station_x_m);
    v("station_y_m", station_y_m);
    v("station_z_m", station_z_m);
    v("sigma_range_m", sigma_range_m);
    v("sigma_bearing_rad", sigma_bearing_rad);
    v("sigma_elevation_rad", sigma_elevation_rad);
    v("near_field", near_field);
    RangeLimits<Scalar>::visit(v);
  }
};

template <class Scalar_, int N>
struct RangeBearingElevation
    : MeasurementModel<RangeBearingElevation<Scalar_, N>, Scalar_, N, 3, 3> {
  using Base = MeasurementModel<RangeBearingElevation<Scalar_, N>, Scalar_, N, 3, 3>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;
  static constexpr bool kClosedForm = true;
  static constexpr int kPlace = 3;

  using Params = RangeBearingElevationParams<Scalar>;

  Params params;

  explicit RangeBearingElevation(const Params& p = Params()) : params(p) {}

  /// Moves the station to (p[0], p[1], p[2]) [m].
  void place(const Scalar* p) {
    params.station_x_m = p[0];
    params.station_y_m = p[1];
    params.station_z_m = p[2];
  }

  struct Expansion {
    Scalar offset[3];                                  // D
    Scalar square, range, inverse_square;              // |D|^2, |D|, 1 / |D|^2
    Scalar level_square, level, inverse_level_square;  // the same of its horizontal part, rho
    Measurement centre;

    const Measurement& value() const { return centre; }

    Jacobian H() const {
      const Scalar inverse = Scalar(1) / range;
      const Scalar slope = offset[2] * inverse_square / level;
      Jacobian jacobian;
      for (int i = 0; i < 3; ++i) jacobian(0, i) = offset[i] * inverse;
      jacobian(1, 0) = -(offset[1] * inverse_level_square);
      jacobian(1, 1) = offset[0] * inverse_level_square;
      jacobian(1, 2) = Scalar(0);
      jacobian(2, 0) = -(offset[0] * slope);
      jacobian(2, 1) = -(offset[1] * slope);
      jacobian(2, 2) = level * inverse_square;
      return jacobian;
    }

    AUVEST_INLINE void deviations(const ObservedState& e, Measurement& sum,
                                  Measurement& difference) const {
      using math::atan2;
      const Scalar one = Scalar(1);
      const Scalar across[3] = {offset[1] * e(2) - offset[2] * e(1),
                                offset[2] * e(0) - offset[0] * e(2), math::cross(offset, e.data())};
      const Scalar q_square = math::dot(across, across, 3) * inverse_square * inverse_square;
      const Lengths slant(math::dot(offset, e.data(), 3) * inverse_square, q_square);
      sum(0) = (range + range) * slant.half_sum;
      difference(0) = (range + range) * slant.half_difference;

      const Scalar p = math::dot(offset, e.data(), 2) * inverse_level_square;
      const Scalar q = across[2] * inverse_level_square;
      const Scalar two_q = q + q;
      const Scalar rest = one - p * p;
      sum(1) = atan2(-(p * two_q), rest + q * q);
      difference(1) = atan2(two_q, rest - q * q);

      const Lengths horizontal(p, q * q);
      const Scalar cc = level_square * inverse_square;  // cosine^2 and cosine sine
      const Scalar cs = level * offset[2] * inverse_square;
      const Scalar rise = e(2) * inverse_square;
      const Scalar a[2] = {one + horizontal.half_sum * cc, -(horizontal.half_sum * cs)};
      const Scalar b[2] = {horizontal.half_difference * cc + offset[2] * rise,
                           level * rise - horizontal.half_difference * cs};
      const Scalar turn_sum = a[0] * a[1] - b[0] * b[1];
      const Scalar turn_difference = a[0] * b[1] - a[1] * b[0];
      sum(2) =
          atan2(turn_sum + turn_sum, (a[0] * a[0] + b[1] * b[1]) - (a[1] * a[1] + b[0] * b[0]));
      difference(2) =
          atan2(turn_difference + turn_difference, math::dot(a, a, 2) - math::dot(b, b, 2));
    }

   private:
    /// h and d.
    struct Lengths {
      Scalar half_sum, half_difference;

      AUVEST_INLINE Lengths(Scalar p, Scalar qq) {
        using math::sqrt;
        const Scalar one = Scalar(1);
        const Scalar w = one - (p * p + qq);
        const Scalar a_plus = sqrt((one + p) * (one + p) + qq);
        const Scalar a_minus = sqrt((one - p) * (one - p) + qq);
        const Scalar a_sum = a_plus + a_minus;
        const Scalar product = a_plus * a_minus;
        const Scalar g = w > Scalar(0) ? Scalar(4) * qq / (product + w) : product - w;
        half_sum = g / (a_sum + Scalar(2));
        half_difference = (p + p) / a_sum;
      }
    };
  };

  AUVEST_INLINE Expansion about(const State& x) const {
    using math::atan2;
    using math::sqrt;
    Expansion point;
    point.offset[0] = x(0) - params.station_x_m;
    point.offset[1] = x(1) - params.station_y_m;
    point.offset[2] = x(2) - params.station_z_m;
    point.level_square = math::dot(point.offset, point.offset, 2);
    point.square = point.level_square + point.offset[2] * point.offset[2];
    point.level = sqrt(point.level_square);
    point.range = sqrt(point.square);
    point.inverse_square = Scalar(1) / point.square;
    point.inverse_level_square = Scalar(1) / point.level_square;
    point.centre(0) = point.range;
    point.centre(1) = atan2(point.offset[1], point.offset[0]);
    point.centre(2) = atan2(point.offset[2], point.level);
    return point;
  }

  /// Without noise. On the vertical through the station the bearing is 0, at the station all is.
  Measurement h(const State& x) const { return about(x).centre; }

  /// Not defined (not finite) on the vertical through the station, where the filters use the near
  /// field.
  Jacobian H(const State& x) const { return about(x).H(); }

  Noise R() const {
    Noise noise;
    math::set_zero(noise);
    noise(0, 0) = params.sigma_range_m * params.sigma_range_m;
    noise(1, 1) = params.sigma_bearing_rad * params.sigma_bearing_rad;
    noise(2, 2) = params.sigma_elevation_rad * params.sigma_elevation_rad;
    return noise;
  }

  Measurement residual(const Measurement& z, const Measurement& predicted) const {
    using math::wrap;
    Measurement difference;
    difference(0) = z(0) - predicted(0);
    difference(1) = wrap(z(1) - predicted(1));
    difference(2) = wrap(z(2) - predicted(2));
    return difference;
  }

  Status admits(const Measurement& z) const { return params.admits(z(0)); }

  /// As RangeBearing's: the bend of the range, where it is more than three sigma of it. Its
  /// variance is that of a belief which is wide in one direction across the line of sight; it is
  /// less in two.
  AUVEST_INLINE void second_order(const Expansion& point, const Matrix<Scalar, 3, 3>& root,
                                  Measurement& innovation, Noise& noise) const {
    const Scalar* const d = point.offset;
    Scalar across = Scalar(0);  // |L x D|^2
    for (int k = 0; k < 3; ++k) {
      const Scalar x = d[1] * root(2, k) - d[2] * root(1, k);
      const Scalar y = d[2] * root(0, k) - d[0] * root(2, k);
      const Scalar z = d[0] * root(1, k) - d[1] * root(0, k);
      across = across + (x * x + y * y + z * z);
    }
    const Scalar twice = across * point.inverse_square / point.range;
    const Scalar bend = Scalar(0.5) * twice;
    if (!(twice * bend > Scalar(9) * noise(0, 0))) return;
    innovation(0) = innovation(0) - bend;
    noise(0, 0) = noise(0, 0) + twice * bend;
  }

  AUVEST_INLINE bool near_field(const Expansion& point, const Matrix<Scalar, N, N>& P,
                                const Measurement& z, Measurement& innovation, Noise& noise) const {
    const Scalar factor = params.near_field * params.near_field;
    const Scalar level = P(0, 0) + P(1, 1);
    const bool far = point.level_square > factor * level + Scalar(1e-30) &&
                     point.square > factor * (level + P(2, 2)) + Scalar(1e-30);
    if (!far) as_position(point, z, innovation, noise);
    return !far;
  }

  Status check() const {
    const bool valid = math::is_finite(params.station_x_m) && math::is_finite(params.station_y_m) &&
                       math::is_finite(params.station_z_m) &&
                       math::is_positive(params.sigma_range_m) &&
                       math::is_positive(params.sigma_bearing_rad) &&
                       math::is_positive(params.sigma_elevation_rad) &&
                       math::is_nonnegative(params.near_field) && params.valid();
    if (!valid) return Status::kBadParameter;
    const Scalar variance = params.sigma_range_m * params.sigma_range_m;
    const bool far = math::is_coarse(params.station_x_m, variance) ||
                     math::is_coarse(params.station_y_m, variance) ||
                     math::is_coarse(params.station_z_m, variance);
    return far ? Status::kFarFromOrigin : Status::kOk;
  }

 private:
  AUVEST_INLINE void as_position(const Expansion& point, const Measurement& z,
                                 Measurement& innovation, Noise& noise) const {
    using math::sqrt;
    using math::wrap;
    Scalar sb, cb, se, ce;
    math::sincos_near(wrap(z(1)), sb, cb);
    math::sincos_near(wrap(z(2)), se, ce);
    const Scalar var_range = params.sigma_range_m * params.sigma_range_m;
    const Scalar var_bearing = params.sigma_bearing_rad * params.sigma_bearing_rad;
    const Scalar var_elevation = params.sigma_elevation_rad * params.sigma_elevation_rad;
    const Scalar s = sqrt(z(0) * z(0) + var_range);
    const Scalar half = Scalar(0.5);
    const Scalar along = sqrt(var_range + half * s * s * var_elevation * var_elevation);  // n
    const Scalar up = s * params.sigma_elevation_rad;                                     // m
    const Scalar across =
        s * params.sigma_bearing_rad * sqrt(ce * ce + var_elevation * (se * se));  // b
    const Scalar bow = s * ce * var_bearing;                                       // k
    const Scalar flat = Scalar(0.70710678118654752) * bow;
    const Scalar both = half * s * var_elevation;  // n, of t
    const Scalar n[3] = {ce * cb, ce * sb, se};
    const Scalar m[3] = {-(se * cb), -(se * sb), ce};
    const Scalar b[3] = {-sb, cb, Scalar(0)};
    const Scalar k[3] = {cb, sb, Scalar(0)};
    Scalar root[3][5];
    for (int i = 0; i < 3; ++i) {
      innovation(i) = z(0) * n[i] - point.offset[i];
      root[i][0] = along * n[i];
      root[i][1] = up * m[i];
      root[i][2] = across * b[i];
      root[i][3] = flat * k[i];
      root[i][4] = both * n[i] + half * bow * k[i];
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) noise(i, j) = math::dot(root[i], root[j], 5);
    }
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
