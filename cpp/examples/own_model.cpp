// How to write your own models: a vehicle that turns, seen by range only from two beacons.
//
// The requirements are listed at the top of models/process_model.hpp and measurement_model.hpp and
// explained in docs/models.md. Everything not written here is inherited.
#include <cmath>
#include <cstdio>

#include "auvest/auvest.hpp"

namespace {

using auvest::Matrix;
using auvest::Vector;

// State: x, y [m], heading [rad], speed [m/s], turn rate [rad/s].
template <class Scalar_>
struct CoordinatedTurn : auvest::ProcessModel<CoordinatedTurn<Scalar_>, Scalar_, 5> {
  using Scalar = Scalar_;
  using State = Vector<Scalar, 5>;
  using Covariance = Matrix<Scalar, 5, 5>;

  Scalar speed_psd = Scalar(1e-4);  // [m^2/s^3]
  Scalar turn_psd = Scalar(1e-5);   // [rad^2/s^3]

  // Midpoint rule: exact for a straight line, third order in the turn.
  State f(const State& x, Scalar dt) const {
    Scalar s, c;
    auvest::math::sincos(x(2) + Scalar(0.5) * dt * x(4), s, c);
    State next = x;
    next(0) = x(0) + dt * x(3) * c;
    next(1) = x(1) + dt * x(3) * s;
    next(2) = auvest::math::wrap(x(2) + dt * x(4));
    return next;
  }

  // f wraps the heading, so differences of headings are wrapped too.
  State residual(const State& a, const State& b) const {
    State difference = a - b;
    difference(2) = auvest::math::wrap(difference(2));
    return difference;
  }

  Covariance Q(Scalar dt) const {
    Covariance q = Covariance::Zero();
    q(0, 0) = q(1, 1) = Scalar(1e-6) * dt;
    q(2, 2) = Scalar(1e-6) * dt;
    q(3, 3) = speed_psd * dt;
    q(4, 4) = turn_psd * dt;
    return q;
  }
};

// The distance to a beacon sees the first two of the five states.
template <class Scalar_>
struct BeaconRange : auvest::MeasurementModel<BeaconRange<Scalar_>, Scalar_, 5, 1, 2> {
  using Scalar = Scalar_;
  using Base = auvest::MeasurementModel<BeaconRange<Scalar_>, Scalar_, 5, 1, 2>;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::State;

  Scalar beacon_x, beacon_y;  // [m]
  Scalar sigma_m;

  BeaconRange(Scalar x, Scalar y, Scalar sigma) : beacon_x(x), beacon_y(y), sigma_m(sigma) {}

  Measurement h(const State& x) const {
    const Scalar dx = x(0) - beacon_x;
    const Scalar dy = x(1) - beacon_y;
    return Measurement(auvest::math::sqrt(dx * dx + dy * dy));
  }
  Noise R() const { return Noise(sigma_m * sigma_m); }
};

}  // namespace

int main() {
  using Filter = auvest::Ukf<CoordinatedTurn<double>>;
  Filter filter{CoordinatedTurn<double>()};
  Vector<double, 5> x0;
  x0 << 1, -1, 0.1, 0.9, 0;
  Matrix<double, 5, 5> P0 = Matrix<double, 5, 5>::Zero();
  const double variances[5] = {4, 4, 0.05, 0.05, 0.001};
  for (int i = 0; i < 5; ++i) P0(i, i) = variances[i];
  if (filter.reset(x0, P0) != auvest::Status::kOk) return 1;

  const BeaconRange<double> beacons[2] = {{-20, -30, 0.1}, {60, -20, 0.1}};
  auvest::math::Random random(1);
  CoordinatedTurn<double> vehicle;
  Vector<double, 5> truth;
  truth << 0, 0, 0, 1, 0.05;
  for (int k = 1; k <= 600; ++k) {
    truth = vehicle.f(truth, 0.5);
    if (filter.predict(0.5) != auvest::Status::kOk) return 1;
    const BeaconRange<double>& beacon = beacons[k % 2];  // the beacons answer in turn
    auto z = beacon.h(truth);
    z(0) += 0.1 * random.normal<double>();
    const auto correction = filter.update(z, beacon);
    if (correction.status != auvest::Status::kOk) {
      std::fprintf(stderr, "step %d: %s\n", k, auvest::describe(correction.status));
      return 1;
    }
  }
  const double error = std::hypot(filter.x()(0) - truth(0), filter.x()(1) - truth(1));
  std::printf(
      "position error after 300 s, two turns and a half: %.2f m, turn rate %.3f rad/s (true "
      "0.050)\n",
      error, filter.x()(4));
  return error < 0.5 ? 0 : 1;
}
