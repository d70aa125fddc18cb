// Models of your own, as auvest.load_models("my_models.hpp") takes them in Python and a sketch
// takes them on the chip: a vehicle with constant acceleration, and range and bearing from a
// station.
//
// The library has both (ExactAcceleration, RangeBearing). Here they are written again from their
// equations, and give the same bits: cpp/examples/my_models.cpp and the Python tests compare them.
// What a model must have, and what it may have, stands in docs/models.md.
#pragma once

#include "auvest/auvest.hpp"

/// State x, y [m], vx, vy [m/s], ax, ay [m/s^2].
template <class Scalar_>
struct MyAcceleration : auvest::ProcessModel<MyAcceleration<Scalar_>, Scalar_, 6> {
  using Base = auvest::ProcessModel<MyAcceleration<Scalar_>, Scalar_, 6>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;

  // Optional. In Python a sensor and a process match where the names of their states do.
  static constexpr const char* kStateNames = "x_m y_m vx_m_s vy_m_s ax_m_s2 ay_m_s2";
  // Optional. f is linear: a UKF needs no points for it.
  static constexpr bool kLinear = true;

  // Optional: parameters, which become arguments in Python.
  struct Params {
    Scalar position_psd = Scalar(1e-6);      // power of the noise on the position [m^2/s]
    Scalar velocity_psd = Scalar(1e-4);      // on the velocity [m^2/s^3]
    Scalar acceleration_psd = Scalar(1e-5);  // on the acceleration [m^2/s^5]

    template <class Visitor>
    void visit(Visitor&& v) {
      v("position_psd", position_psd);
      v("velocity_psd", velocity_psd);
      v("acceleration_psd", acceleration_psd);
    }
  };

  Params params;

  explicit MyAcceleration(const Params& p = Params()) : params(p) {}

  State f(const State& x, Scalar dt) const {
    const Scalar half = Scalar(0.5) * dt * dt;
    State next = x;
    for (int i = 0; i < 2; ++i) {
      next(i) = x(i) + dt * x(i + 2) + half * x(i + 4);
      next(i + 2) = x(i + 2) + dt * x(i + 4);
    }
    return next;
  }

  // The Jacobian of f.
  Covariance Phi(const State&, Scalar dt) const {
    Covariance phi = Covariance::Identity();
    for (int i = 0; i < 2; ++i) {
      phi(i, i + 2) = phi(i + 2, i + 4) = dt;
      phi(i, i + 4) = Scalar(0.5) * dt * dt;
    }
    return phi;
  }

  // The integral of Phi(s) diag(psd) Phi(s)' over s from 0 to dt.
  Covariance Q(Scalar dt) const {
    const Scalar p = params.position_psd;
    const Scalar v = params.velocity_psd;
    const Scalar a = params.acceleration_psd;
    const Scalar dt2 = dt * dt;
    Covariance q = Covariance::Zero();
    for (int i = 0; i < 2; ++i) {
      q(i, i) = dt * (p + dt2 * (v / Scalar(3) + dt2 * (a / Scalar(20))));
      q(i + 2, i + 2) = dt * (v + dt2 * (a / Scalar(3)));
      q(i + 4, i + 4) = a * dt;
      q(i, i + 2) = q(i + 2, i) = dt2 * (v / Scalar(2) + dt2 * (a / Scalar(8)));
      q(i, i + 4) = q(i + 4, i) = dt2 * dt * (a / Scalar(6));
      q(i + 2, i + 4) = q(i + 4, i + 2) = dt2 * (a / Scalar(2));
    }
    return q;
  }

  // Optional: whether the parameters make sense.
  auvest::Status check() const {
    const bool good = auvest::math::is_nonnegative(params.position_psd) &&
                      auvest::math::is_nonnegative(params.velocity_psd) &&
                      auvest::math::is_nonnegative(params.acceleration_psd);
    return good ? auvest::Status::kOk : auvest::Status::kBadParameter;
  }
};

/// Range [m] and bearing [rad, from +x towards +y] from a station, for N >= 2 states of which the
/// first two are the position.
template <class Scalar_, int N>
struct MyRangeBearing : auvest::MeasurementModel<MyRangeBearing<Scalar_, N>, Scalar_, N, 2, 2> {
  using Base = auvest::MeasurementModel<MyRangeBearing<Scalar_, N>, Scalar_, N, 2, 2>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::ObservedState;
  using typename Base::State;

  static constexpr const char* kStateNames = "x_m y_m";
  static constexpr const char* kMeasureNames = "range_m bearing_rad";
  static constexpr int kPlace = 2;           // the station may come with each measurement
  static constexpr bool kClosedForm = true;  // about(x) has deviations in closed form

  struct Params {
    Scalar station_x_m = Scalar(0.2);
    Scalar station_y_m = Scalar(2);
    Scalar sigma_range_m = Scalar(0.05);
    Scalar sigma_bearing_rad = Scalar(0.01);
    Scalar near_field = Scalar(5);  // standard deviations of the position

    template <class Visitor>
    void visit(Visitor&& v) {
      v("station_x_m", station_x_m);
      v("station_y_m", station_y_m);
      v("sigma_range_m", sigma_range_m);
      v("sigma_bearing_rad", sigma_bearing_rad);
      v("near_field", near_field);
    }
  };

  Params params;

  explicit MyRangeBearing(const Params& p = Params()) : params(p) {}

  void place(const Scalar* p) {
    params.station_x_m = p[0];
    params.station_y_m = p[1];
  }

  Measurement h(const State& x) const {
    const Scalar dx = x(0) - params.station_x_m;
    const Scalar dy = x(1) - params.station_y_m;
    Measurement z;
    z(0) = auvest::math::sqrt(dx * dx + dy * dy);
    z(1) = auvest::math::atan2(dy, dx);
    return z;
  }

  Noise R() const {
    Noise noise = Noise::Zero();
    noise(0, 0) = params.sigma_range_m * params.sigma_range_m;
    noise(1, 1) = params.sigma_bearing_rad * params.sigma_bearing_rad;
    return noise;
  }

  // The bearing is an angle: differences are wrapped.
  Measurement residual(const Measurement& z, const Measurement& predicted) const {
    Measurement difference = z - predicted;
    difference(1) = auvest::math::wrap(difference(1));
    return difference;
  }

  // Optional: h about a state, so that the UKF need not subtract h(x + e) - h(x), in which digits
  // are lost. H(x) alone would serve the EKF.
  struct Expansion {
    Scalar dx, dy, square, range;
    Measurement centre;

    const Measurement& value() const { return centre; }

    Jacobian H() const {
      Jacobian jacobian;
      jacobian << dx * (Scalar(1) / range), dy * (Scalar(1) / range),  //
          -(dy * (Scalar(1) / square)), dx * (Scalar(1) / square);
      return jacobian;
    }

    // With d+- = h(x +- e) - h(x): their sum and their difference. Seen along the line of sight, e
    // is the fraction p of the range, and across it q (docs/algorithms/ukf.md).
    void deviations(const ObservedState& e, Measurement& sum, Measurement& difference) const {
      const Scalar one = Scalar(1);
      const Scalar p = (dx * e(0) + dy * e(1)) * (one / square);
      const Scalar q = (dx * e(1) - dy * e(0)) * (one / square);
      const Scalar size = p * p + q * q;
      if (size < Scalar(0.25) * auvest::math::machine_epsilon<Scalar>()) {
        sum << range * (q * q), -(p * (Scalar(2) * q));
        difference << Scalar(2) * range * p, Scalar(2) * q;
        return;
      }
      // The ranges of both points, in units of the range between them.
      const Scalar further = auvest::math::sqrt((one + p) * (one + p) + q * q);
      const Scalar nearer = auvest::math::sqrt((one - p) * (one - p) + q * q);
      const Scalar w = one - size;
      // further * nearer - w, without the loss of digits where it is small
      Scalar g = further * nearer - w;
      if (w > Scalar(0)) g = Scalar(2) * q * (Scalar(2) * q) / (further * nearer + w);
      sum(0) = Scalar(2) * range * g / (further + nearer + Scalar(2));
      difference(0) = Scalar(2) * range * (Scalar(2) * p) / (further + nearer);
      sum(1) = auvest::math::atan2(-(p * (Scalar(2) * q)), one - p * p + q * q);
      difference(1) = auvest::math::atan2(Scalar(2) * q, w);
    }
  };

  Expansion about(const State& x) const {
    Expansion point;
    point.dx = x(0) - params.station_x_m;
    point.dy = x(1) - params.station_y_m;
    point.square = point.dx * point.dx + point.dy * point.dy;
    point.centre = h(x);
    point.range = point.centre(0);
    return point;
  }

  // Optional: close to the station, at the scale of the belief, the slope of the bearing says
  // nothing. There the measurement is taken as the position that it points to.
  bool near_field(const Expansion& point, const auvest::Matrix<Scalar, N, N>& P,
                  const Measurement& z, Measurement& innovation, Noise& noise) const {
    const Scalar reach = params.near_field * params.near_field * (P(0, 0) + P(1, 1));
    if (point.square > reach + Scalar(1e-30)) return false;
    Scalar sine, cosine;
    auvest::math::sincos(auvest::math::wrap(z(1)), sine, cosine);
    const Scalar range2 = z(0) * z(0);
    const Scalar var_range = params.sigma_range_m * params.sigma_range_m;
    const Scalar var_bearing = params.sigma_bearing_rad * params.sigma_bearing_rad;
    // Errors along and across the line of sight, turned into x and y.
    const Scalar along =
        auvest::math::sqrt(var_range + Scalar(0.75) * range2 * var_bearing * var_bearing);
    const Scalar across = auvest::math::sqrt((range2 + var_range) * var_bearing);
    auvest::Matrix<Scalar, 2, 2> root;
    root << along * cosine, -(across * sine), along * sine, across * cosine;
    innovation << z(0) * cosine - point.dx, z(0) * sine - point.dy;
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        noise(i, j) = root(i, 0) * root(j, 0) + root(i, 1) * root(j, 1);
      }
    }
    return true;
  }

  auvest::Status check() const {
    using namespace auvest::math;
    const bool good = is_finite(params.station_x_m) && is_finite(params.station_y_m) &&
                      is_positive(params.sigma_range_m) && is_positive(params.sigma_bearing_rad) &&
                      is_nonnegative(params.near_field);
    return good ? auvest::Status::kOk : auvest::Status::kBadParameter;
  }
};
