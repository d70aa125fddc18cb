// Position and attitude of a vehicle that is actuated in all six degrees of freedom: nonlinear PID,
// [CONTROL 11],
//
//     tau = -J(Theta)' (Kp e + Ki int e) - Kd nu + g(eta),   e = eta - eta_d, angles wrapped,
//     Kp = w^2 M_ii,   Kd = 2 w M_ii,   Ki = Kp w / 10,
//
// w per degree of freedom. Roll and pitch need a higher one where thrusters sit off the centre, as
// the horizontal ones of an ROV do: at 1 rad/s it tilts until it capsizes, at 3 rad/s by degrees.
//
// eta = [x y z phi theta psi], north, east, down, Euler angles zyx; J = diag(R, T).
#pragma once

#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

template <class Scalar_>
class PoseControl {
 public:
  using Scalar = Scalar_;
  using Vector6 = Vector<Scalar, 6>;

  struct Params {
    Vector6 inertia;    ///< M_ii, added mass included [kg, kg m^2], > 0; of `bluerov2_heavy`
    Vector6 frequency;  ///< w [rad/s], > 0

    Params() {
      const Scalar values[6] = {Scalar(19.86), Scalar(20.62), Scalar(32.18),
                                Scalar(0.449), Scalar(0.365), Scalar(0.592)};
      for (int i = 0; i < 6; ++i) {
        inertia(i) = values[i];
        frequency(i) = Scalar(i == 3 || i == 4 ? 3 : 1);
      }
    }

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("inertia", inertia);
      v("frequency", frequency);
    }
  };

  explicit PoseControl(const Params& params = Params())
      : params_(params), check_(valid(params) ? Status::kOk : Status::kBadParameter) {
    math::set_zero(integral_);
  }

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// Force and moment [N, N m] in the body's axes. `restoring` is g(eta), zero if it is not known;
  /// `saturated` whether the thrusters could not give the last tau: an error then takes from its
  /// integral but adds nothing. Refused, with nothing changed: what is not a number (kNotFinite),
  /// and a pitch beyond 80 degrees, where T is nearly singular (kSteepPitch).
  Status update(const Vector6& wanted, const Vector6& pose, const Vector6& velocity,
                const Vector6& restoring, bool saturated, Scalar dt, Vector6& tau) {
    if (check_ != Status::kOk) return check_;
    if (!math::all_finite(wanted) || !math::all_finite(pose) || !math::all_finite(velocity) ||
        !math::all_finite(restoring) || !math::is_finite(dt)) {
      return Status::kNotFinite;
    }
    if (dt < Scalar(0)) return Status::kTimeBackwards;
    if (math::absolute(math::wrap(pose(4))) > Scalar(1.3962634015954636))
      return Status::kSteepPitch;
    Vector6 error;
    Vector6 pull;  // Kp e + Ki int e
    for (int i = 0; i < 6; ++i) {
      const Scalar difference = pose(i) - wanted(i);
      error(i) = i < 3 ? difference : math::wrap(difference);
      const Scalar w = params_.frequency(i);
      pull(i) = w * w * params_.inertia(i) * (error(i) + Scalar(0.1) * w * integral_(i));
    }
    Vector6 turned;
    to_body(pose, pull, turned);
    Vector6 wished;
    for (int i = 0; i < 6; ++i) {
      const Scalar brake = Scalar(2) * params_.frequency(i) * params_.inertia(i);
      wished(i) = restoring(i) - turned(i) - brake * velocity(i);  // [CONTROL 11]
    }
    if (!math::all_finite(wished)) return Status::kOverflow;
    math::copy(wished, tau);
    for (int i = 0; i < 6; ++i) {
      const bool shrinks = (error(i) > Scalar(0) && integral_(i) < Scalar(0)) ||
                           (error(i) < Scalar(0) && integral_(i) > Scalar(0));
      if (!saturated || shrinks) integral_(i) = integral_(i) + dt * error(i);
    }
    return Status::kOk;
  }

  const Vector6& integral() const { return integral_; }  ///< int e [m s, rad s]
  void restart() { math::set_zero(integral_); }
  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    bool valid = true;
    for (int i = 0; i < 6; ++i) {
      valid = valid && math::is_positive(p.inertia(i)) && math::is_positive(p.frequency(i));
    }
    return valid;
  }

  /// J' v.
  static void to_body(const Vector6& pose, const Vector6& v, Vector6& body) {
    Scalar sine[3], cosine[3];
    for (int i = 0; i < 3; ++i) math::sincos(pose(i + 3), sine[i], cosine[i]);
    const Scalar sp = sine[0], cp = cosine[0];
    const Scalar st = sine[1], ct = cosine[1];
    const Scalar sy = sine[2], cy = cosine[2];
    const Scalar ahead = cy * v(0) + sy * v(1);
    const Scalar aside = cy * v(1) - sy * v(0);
    const Scalar down = st * ahead + ct * v(2);
    body(0) = ct * ahead - st * v(2);
    body(1) = cp * aside + sp * down;
    body(2) = cp * down - sp * aside;
    const Scalar turn = (st * v(3) + v(5)) / ct;
    body(3) = v(3);
    body(4) = cp * v(4) + sp * turn;
    body(5) = cp * turn - sp * v(4);
  }

  Params params_;
  Status check_;
  Vector6 integral_;
};

}  // namespace auvest
