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
    Covariance q = Covariance::Zero();
    add_noise(q, dt);
    auvest::math::mirror_lower(q);
    return q;
  }

  // Optional: x <- f(x) and P <- Phi P Phi' + Q in place, from the structure of Phi. A third of the
  // step on the chip. Row by row, every element is formed from elements further down or to the
  // right, which still hold their old values; of P the lower triangle counts.
  void propagate(auvest::Belief<Scalar, 6>& belief, Scalar dt) const {
    Covariance& p = belief.P;
    const Scalar half = Scalar(0.5) * dt * dt;
    auvest::math::mirror_lower(p);
    for (int i = 0; i < 6; ++i) {
      Scalar* const row = &p(i, 0);
      const int count = i == 0 ? 5 : 6;
      if (i < 4) auvest::math::add_scaled(dt, row + 12, row, count);
      if (i < 2) auvest::math::add_scaled(half, row + 24, row, count);
      advance(row, i + 1, dt, half);
    }
    add_noise(p, dt);
    advance(belief.x.data(), 6, dt, half);
  }

  // Optional: whether the parameters make sense.
  auvest::Status check() const {
    const bool good = auvest::math::is_nonnegative(params.position_psd) &&
                      auvest::math::is_nonnegative(params.velocity_psd) &&
                      auvest::math::is_nonnegative(params.acceleration_psd);
    return good ? auvest::Status::kOk : auvest::Status::kBadParameter;
  }

 private:
  // The first `count` components of v <- Phi v.
  static void advance(Scalar* v, int count, Scalar dt, Scalar half) {
    auvest::math::add_scaled(dt, v + 2, v, count < 4 ? count : 4);
    auvest::math::add_scaled(half, v + 4, v, count < 2 ? count : 2);
  }

  // Adds Q to the lower triangle of p.
  void add_noise(Covariance& p, Scalar dt) const {
    const Scalar v = params.velocity_psd;
    const Scalar a = params.acceleration_psd;
    const Scalar dt2 = dt * dt;
    for (int i = 0; i < 2; ++i) {
      p(i, i) += dt * (params.position_psd + dt2 * (v / Scalar(3) + dt2 * (a / Scalar(20))));
      p(i + 2, i + 2) += dt * (v + dt2 * (a / Scalar(3)));
      p(i + 4, i + 4) += a * dt;
      p(i + 2, i) += dt2 * (v / Scalar(2) + dt2 * (a / Scalar(8)));
      p(i + 4, i) += dt2 * dt * (a / Scalar(6));
      p(i + 4, i + 2) += dt2 * (a / Scalar(2));
    }
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
    Noise noise;
    noise(0, 0) = params.sigma_range_m * params.sigma_range_m;
    noise(0, 1) = noise(1, 0) = Scalar(0);
    noise(1, 1) = params.sigma_bearing_rad * params.sigma_bearing_rad;
    return noise;
  }

  // The bearing is an angle: differences are wrapped.
  Measurement residual(const Measurement& z, const Measurement& predicted) const {
    Measurement difference;
    difference(0) = z(0) - predicted(0);
    difference(1) = auvest::math::wrap(z(1) - predicted(1));
    return difference;
  }

  // Optional: h about a state, so that the UKF need not subtract h(x + e) - h(x), in which digits
  // are lost. H(x) alone would serve the EKF.
  struct Expansion {
    Scalar offset[2];  // from the station
    Scalar square, inverse_square, range;
    Measurement centre;

    const Measurement& value() const { return centre; }

    Jacobian H() const {
      Jacobian jacobian;
      jacobian(0, 0) = offset[0] * (Scalar(1) / range);
      jacobian(0, 1) = offset[1] * (Scalar(1) / range);
      jacobian(1, 0) = -(offset[1] * inverse_square);
      jacobian(1, 1) = offset[0] * inverse_square;
      return jacobian;
    }

    // With d+- = h(x +- e) - h(x): their sum and their difference. Seen along the line of sight, e
    // is the fraction p of the range, and across it q (docs/algorithms/ukf.md).
    void deviations(const ObservedState& e, Measurement& sum, Measurement& difference) const {
      const Scalar one = Scalar(1);
      const Scalar p = auvest::math::dot(offset, e.data(), 2) * inverse_square;
      const Scalar q = auvest::math::cross(offset, e.data()) * inverse_square;
      const Scalar size = p * p + q * q;
      if (size < Scalar(0.25) * auvest::math::machine_epsilon<Scalar>()) {
        sum(0) = range * (q * q);
        sum(1) = -(p * (q + q));
        difference(0) = (range + range) * p;
        difference(1) = q + q;
        return;
      }
      // The ranges of both points, in units of the range between them.
      const Scalar further = auvest::math::sqrt((one + p) * (one + p) + q * q);
      const Scalar nearer = auvest::math::sqrt((one - p) * (one - p) + q * q);
      const Scalar w = one - size;
      // further * nearer - w, without the loss of digits where it is small
      Scalar g = further * nearer - w;
      if (w > Scalar(0)) g = (q + q) * (q + q) / (further * nearer + w);
      sum(0) = (range + range) * g / (further + nearer + Scalar(2));
      difference(0) = (range + range) * (p + p) / (further + nearer);
      sum(1) = auvest::math::atan2(-(p * (q + q)), one - p * p + q * q);
      difference(1) = auvest::math::atan2(q + q, w);
    }
  };

  Expansion about(const State& x) const {
    Expansion point;
    point.offset[0] = x(0) - params.station_x_m;
    point.offset[1] = x(1) - params.station_y_m;
    point.square = auvest::math::dot(point.offset, point.offset, 2);
    point.inverse_square = Scalar(1) / point.square;
    point.range = auvest::math::sqrt(point.square);
    point.centre(0) = point.range;
    point.centre(1) = auvest::math::atan2(point.offset[1], point.offset[0]);
    return point;
  }

  // Optional: close to the station, at the scale of the belief, the slope of the bearing says
  // nothing. There the measurement is taken as the position that it points to.
  bool near_field(const Expansion& point, const auvest::Matrix<Scalar, N, N>& P,
                  const Measurement& z, Measurement& innovation, Noise& noise) const {
    const Scalar reach = params.near_field * params.near_field * (P(0, 0) + P(1, 1));
    if (point.square > reach + Scalar(1e-30)) return false;
    Scalar sine, cosine;
    auvest::math::sincos_near(auvest::math::wrap(z(1)), sine, cosine);
    const Scalar range2 = z(0) * z(0);
    const Scalar var_range = params.sigma_range_m * params.sigma_range_m;
    const Scalar var_bearing = params.sigma_bearing_rad * params.sigma_bearing_rad;
    // Errors along and across the line of sight, turned into x and y.
    const Scalar along =
        auvest::math::sqrt(var_range + Scalar(0.75) * range2 * var_bearing * var_bearing);
    const Scalar across = auvest::math::sqrt((range2 + var_range) * var_bearing);
    const Scalar root[2][2] = {{along * cosine, -(across * sine)}, {along * sine, across * cosine}};
    innovation(0) = z(0) * cosine - point.offset[0];
    innovation(1) = z(0) * sine - point.offset[1];
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) noise(i, j) = auvest::math::dot(root[i], root[j], 2);
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
