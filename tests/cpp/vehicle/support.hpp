// What the tests of the vehicle share.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "auvest/vehicle/bluerov2_heavy.hpp"
#include "auvest/vehicle/integrate.hpp"
#include "auvest/vehicle/remus100.hpp"

namespace vehicle {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;

template <class Scalar, class Freedom = auvest::SixDof>
using Remus = auvest::Hull<auvest::Torpedo<Scalar>, Freedom>;

template <class Scalar>
using Yacht = auvest::Torpedo<Scalar, auvest::Keel<Scalar>>;

template <class Scalar>
using Rov = auvest::Hull<auvest::Rov<Scalar, 8>>;

template <class Hull>
typename Hull::Current current(double north, double east, double down) {
  using Scalar = typename Hull::Scalar;
  typename Hull::Current c;
  c << Scalar(north), Scalar(east), Scalar(down);
  return c;
}

/// A command of the torpedo: degrees and revolutions per minute.
template <class Hull>
typename Hull::Command command(double rudder_deg, double stern_deg, double rpm) {
  using Scalar = typename Hull::Scalar;
  typename Hull::Command c;
  c << Scalar(rudder_deg * kDegree), Scalar(stern_deg * kDegree), Scalar(rpm / 60);
  return c;
}

template <class Hull>
void run(const Hull& hull, typename Hull::State& x, const typename Hull::Command& command,
         const typename Hull::Current& current, double h, int steps) {
  using Scalar = typename Hull::Scalar;
  for (int k = 0; k < steps; ++k) auvest::Rk4::step(hull, x, command, current, Scalar(h));
}

/// Forces of a torpedo or ROV at rest in its frame but for the velocities: level, at an attitude or
/// with actuators.
template <class Hull>
Eigen::Matrix<double, 6, 1> forces(const Hull& hull, const double* nu,
                                   const double* angles = nullptr,
                                   const double* actuators = nullptr) {
  using Scalar = typename Hull::Scalar;
  Scalar velocities[6];
  Scalar state[Hull::kActuators];
  Scalar tau[6];
  typename Hull::State x = Hull::State::Zero();
  for (int i = 0; i < Hull::kVelocities; ++i) velocities[i] = Scalar(nu[i]);
  for (int i = 0; i < Hull::kActuators; ++i) state[i] = Scalar(actuators ? actuators[i] : 0);
  for (int i = 0; angles && i < 3; ++i) x(3 + i) = Scalar(angles[i]);
  hull.forces(hull.attitude(x), velocities, state, tau);
  Eigen::Matrix<double, 6, 1> result;
  for (int i = 0; i < 6; ++i) result(i) = double(tau[i]);
  return result;
}

/// Uniform numbers in [-1, 1], the same on every machine.
class Uniform {
 public:
  double operator()() { return 2 * (double(engine_()) / 4294967296.0) - 1; }

 private:
  std::mt19937 engine_;
};

}  // namespace vehicle
