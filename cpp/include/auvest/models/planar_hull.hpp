// A torpedo in the horizontal plane, driven by its own commands: state [x, y, psi, u, v, r, Vx, Vy]
// (m, rad, m/s, rad/s, m/s), the velocities through the water, the current in the state. The
// model-aided filter of a vehicle without a log: what rudder and propeller do to the hull
// (vehicle/hull.hpp) tells how it moves.
//
//     d(x, y)/dt = R(psi) (u, v) + V,   d(psi)/dt = r,   M d(u, v, r)/dt = tau(u, v, r, rudder, n)
//
// x is north, y east, psi from north to east. What drives it is what the actuators do over the
// step and not what they are told: a fin of remus100 follows its command within 0.1 s, its
// propeller within 1 s. Steps of RK4 of `step_s` at most.
//
// Noise: forces on surge and sway and a moment in yaw, through M^-1; a random walk of the current;
// white on the position. That of the velocities reaches place and heading with the next step.
//
// Phi: place and current in closed form, the heading by the way through the water that it turns,
// the velocities by central differences: six more evaluations of f.
#pragma once

#include <cstdint>

#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/process_model.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "auvest/vehicle/flow.hpp"
#include "auvest/vehicle/frames.hpp"
#include "auvest/vehicle/freedom.hpp"
#include "auvest/vehicle/hull.hpp"
#include "auvest/vehicle/remus100.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct PlanarHull : ProcessModel<PlanarHull<Scalar_>, Scalar_, 8> {
  using Base = ProcessModel<PlanarHull<Scalar_>, Scalar_, 8>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;
  using Input = Vector<Scalar, 2>;  ///< rudder (rad), propeller (rev/s)
  using Body = Hull<Torpedo<Scalar>, ThreeDof>;

  struct Params {
    Scalar surge_psd = Scalar(1);        ///< of the force ahead [N^2 s], >= 0
    Scalar sway_psd = Scalar(1);         ///< of the force to starboard [N^2 s], >= 0
    Scalar yaw_psd = Scalar(0.1);        ///< of the moment in yaw [N^2 m^2 s], >= 0
    Scalar position_psd = Scalar(1e-3);  ///< white on the position [m^2/s], >= 0
    Scalar current_psd = Scalar(1e-5);   ///< walk of the current [m^2/s^3], >= 0
    Scalar step_s = Scalar(0.1);         ///< of RK4 at most [s], 0.01 to 0.5

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("surge_psd", surge_psd);
      v("sway_psd", sway_psd);
      v("yaw_psd", yaw_psd);
      v("position_psd", position_psd);
      v("current_psd", current_psd);
      v("step_s", step_s);
    }
  };

  Params params;
  Input input;

  explicit PlanarHull(const Params& p = Params(),
                      const typename Body::Params& hull = remus100<Scalar>())
      : params(p), hull_(hull) {
    math::set_zero(input);
    form_push();
  }

  State f(const State& x, Scalar dt) const {
    const Scalar actuators[3] = {input(0), Scalar(0), input(1)};
    const Scalar longest = Scalar(kMostSteps) * params.step_s;
    const Scalar moving = dt < longest ? dt : longest;
    const std::uint16_t steps = steps_in(moving);
    const Scalar h = moving / Scalar(steps);
    State next = x;
    for (std::uint16_t k = 0; k < steps; ++k) step(next, actuators, h);
    if (moving < dt) turn_steadily(next, dt - moving);
    next(2) = math::wrap(next(2));
    return next;
  }

  Covariance Phi(const State& x, Scalar dt) const {
    Covariance phi;
    math::set_zero(phi);
    for (int i = 0; i < 8; ++i) phi(i, i) = Scalar(1);
    phi(0, 6) = phi(1, 7) = dt;
    // From the origin and without current, which change nothing but digits.
    State here = x;
    here(0) = here(1) = here(6) = here(7) = Scalar(0);
    const State next = f(here, dt);
    phi(0, 2) = -next(1);
    phi(1, 2) = next(0);
    const Scalar e = Scalar(0.00390625);  // the same in every precision: |v| v has a bend at 0
    for (int j = 3; j < 6; ++j) {
      State up = here, down = here;
      up(j) = here(j) + e;
      down(j) = here(j) - e;
      const State d = residual(f(up, dt), f(down, dt));
      for (int i = 0; i < 6; ++i) phi(i, j) = d(i) / (e + e);
    }
    return phi;
  }

  State residual(const State& a, const State& b) const {
    State difference = Base::residual(a, b);
    difference(2) = math::wrap(difference(2));
    return difference;
  }

  Status check() const {
    const Scalar not_negative[] = {params.surge_psd, params.sway_psd, params.yaw_psd,
                                   params.position_psd, params.current_psd};
    for (const Scalar value : not_negative) {
      if (!math::is_nonnegative(value)) return Status::kBadParameter;
    }
    const bool steps = math::within(params.step_s, Scalar(0.01), Scalar(0.5));
    return steps ? hull_.check() : Status::kBadParameter;
  }

  /// Adds Q(dt) to a lower triangle.
  template <class Value>
  AUVEST_INLINE void add_noise(Matrix<Value, 8, 8>& p, Scalar dt) const {
    const Scalar walk = params.current_psd * dt;
    for (int i = 0; i < 2; ++i) {
      p(i, i) = p(i, i) + Value(dt * params.position_psd + walk * dt * dt / Scalar(3));
      p(i + 6, i) = p(i + 6, i) + Value(walk * dt / Scalar(2));
      p(i + 6, i + 6) = p(i + 6, i + 6) + Value(walk);
    }
    // What is more than 20 s ago the damping has taken.
    const Scalar felt = dt < Scalar(20) ? dt : Scalar(20);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j <= i; ++j) p(3 + i, 3 + j) = p(3 + i, 3 + j) + Value(push_(i, j) * felt);
    }
  }

 private:
  /// After so many steps the speeds no longer change: 7 minutes of 0.1 s, 20 times the longest time
  /// constant.
  static constexpr std::uint16_t kMostSteps = 4096;

  /// Steps of equal length, none longer than step_s.
  std::uint16_t steps_in(Scalar dt) const {
    std::uint16_t steps = 1;
    while (steps < kMostSteps && Scalar(steps) * params.step_s < dt) ++steps;
    return steps;
  }

  /// dt more seconds on a circle, or a line: the chord of the way through the water, and the drift.
  void turn_steadily(State& x, Scalar dt) const {
    const Scalar half = Scalar(0.5) * x(5) * dt;
    Scalar sine, cosine;
    math::sincos(half, sine, cosine);
    const Scalar chord = math::absolute(half) < Scalar(1e-3) ? dt : dt * (sine / half);
    math::sincos(x(2) + half, sine, cosine);
    x(0) = x(0) + chord * (x(3) * cosine - x(4) * sine) + dt * x(6);
    x(1) = x(1) + chord * (x(3) * sine + x(4) * cosine) + dt * x(7);
    x(2) = x(2) + (half + half);
  }

  void rate(const State& x, const Scalar* actuators, State& slope) const {
    const Attitude<Scalar> attitude = Attitude<Scalar>::of(x.data(), ThreeDof());
    const Scalar current[3] = {x(6), x(7), Scalar(0)};
    Flow<Scalar> flow;
    flow.set(x.data() + 3, false, ThreeDof());
    pose_rates<ThreeDof>(attitude, flow.nu, current, slope.data());
    hull_.acceleration(attitude, x.data() + 3, actuators, slope.data() + 3);
  }

  /// RK4, with the actuators where they are.
  void step(State& x, const Scalar* actuators, Scalar h) const {
    State slope, sum, stage;
    math::set_zero(slope);
    math::set_zero(sum);
    stage = x;
    for (int k = 0; k < 4; ++k) {
      rate(stage, actuators, slope);
      math::add_scaled(Scalar(k == 0 || k == 3 ? 1 : 2), slope.data(), sum.data(), 6);
      if (k == 3) break;
      stage = x;
      math::add_scaled(k == 2 ? h : Scalar(0.5) * h, slope.data(), stage.data(), 6);
    }
    math::add_scaled(h / Scalar(6), sum.data(), x.data(), 6);
  }

  /// M^-1 q M^-1, per second.
  void form_push() {
    Matrix<Scalar, 3, 3> m, inverse;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j)
        m(i, j) = hull_.mass_matrix()(ThreeDof::axis(i), ThreeDof::axis(j));
    }
    for (int i = 0; i < 3; ++i) {
      const int a = (i + 1) % 3, b = (i + 2) % 3;
      for (int j = 0; j < 3; ++j) {
        const int c = (j + 1) % 3, d = (j + 2) % 3;
        inverse(j, i) = m(a, c) * m(b, d) - m(a, d) * m(b, c);
      }
    }
    const Scalar det = m(0, 0) * inverse(0, 0) + m(0, 1) * inverse(1, 0) + m(0, 2) * inverse(2, 0);
    const Scalar q[3] = {params.surge_psd, params.sway_psd, params.yaw_psd};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        Scalar sum = Scalar(0);
        for (int k = 0; k < 3; ++k) sum = sum + inverse(i, k) * q[k] * inverse(j, k);
        push_(i, j) = sum / (det * det);
      }
    }
  }

  Body hull_;
  Matrix<Scalar, 3, 3> push_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
