// A circle, or an arc of one, as a path, [GUIDE 2]. With lam = 1 clockwise from above (positive yaw
// rate) and lam = -1 anticlockwise, and R (u_x, u_y) the vehicle's position from the centre,
//
//     pi_h = atan2(u_y, u_x) + lam pi/2,   e = lam (R - distance from the centre),   kappa = lam /
//     R,
//
// after which every guidance law is what it is on a line. sin pi_h = lam u_x and cos pi_h = -lam
// u_y need no trigonometry.
#pragma once

#include "auvest/guidance/path_point.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class Circle {
 public:
  using Scalar = Scalar_;

  /// Of radius 1 m about the origin, clockwise from its north, until set() or leave() says
  /// otherwise.
  Circle()
      : x_(Scalar(0)),
        y_(Scalar(0)),
        curvature_(Scalar(1)),
        radius_(Scalar(1)),
        start_(math::half_pi<Scalar>()),
        length_(math::two_pi<Scalar>()),
        half_turn_(half_turn()) {}

  /// The circle about (x, y) [m] whose radius [m] is positive clockwise and negative anticlockwise.
  /// Its beginning is at its north. kNotFinite, or kBadParameter for a radius of 0; the circle is
  /// then what it was.
  Status set(Scalar x, Scalar y, Scalar signed_radius_m) {
    const Scalar quarter = math::half_pi<Scalar>();
    return place(x, y, signed_radius_m, signed_radius_m < Scalar(0) ? -quarter : quarter,
                 math::two_pi<Scalar>());
  }

  /// The arc that leaves (x, y) [m] in the direction with this sine and cosine and turns by so many
  /// rad, 0 < turn <= 2 pi, clockwise where the radius [m] is positive. Statuses as of set().
  Status leave(Scalar x, Scalar y, Scalar sine, Scalar cosine, Scalar signed_radius_m,
               Scalar turn_rad) {
    if (!math::is_finite(sine) || !math::is_finite(cosine)) return Status::kNotFinite;
    return place(x - signed_radius_m * sine, y + signed_radius_m * cosine, signed_radius_m,
                 math::atan2(sine, cosine), turn_rad);
  }

  /// The point beside a vehicle at (x, y) [m]. `along_m` counts from the beginning of the arc and
  /// jumps by a turn opposite to the middle of the arc. At the centre itself the point is that at
  /// the north of the circle.
  PathPoint<Scalar> locate(Scalar x, Scalar y) const {
    const Scalar dx = x - x_;
    const Scalar dy = y - y_;
    const Scalar distance = math::sqrt(dx * dx + dy * dy);
    const bool centre = !math::is_positive(distance);
    const Scalar north = centre ? Scalar(1) : dx / distance;
    const Scalar east = centre ? Scalar(0) : dy / distance;
    const bool anticlockwise = curvature_ < Scalar(0);
    PathPoint<Scalar> point;
    // [GUIDE 2]
    point.sine = anticlockwise ? -north : north;
    point.cosine = anticlockwise ? east : -east;
    point.direction_rad = math::atan2(point.sine, point.cosine);
    point.cross_m = anticlockwise ? distance - radius_ : radius_ - distance;
    point.curvature = curvature_;
    const Scalar turned = point.direction_rad - start_;
    const Scalar ahead = anticlockwise ? -turned : turned;
    point.along_m = radius_ * (half_turn_ + math::wrap(ahead - half_turn_));
    return point;
  }

  Scalar length_m() const { return length_; }
  Scalar radius_m() const { return radius_; }

 private:
  Status place(Scalar x, Scalar y, Scalar signed_radius_m, Scalar start_rad, Scalar turn_rad) {
    const Scalar radius = signed_radius_m < Scalar(0) ? -signed_radius_m : signed_radius_m;
    if (!math::is_finite(x) || !math::is_finite(y) || !math::is_finite(radius) ||
        !math::is_finite(turn_rad)) {
      return Status::kNotFinite;
    }
    if (!math::is_positive(radius) || !math::is_positive(turn_rad) ||
        turn_rad > math::two_pi<Scalar>()) {
      return Status::kBadParameter;
    }
    x_ = x;
    y_ = y;
    curvature_ = Scalar(1) / signed_radius_m;
    radius_ = radius;
    start_ = start_rad;
    length_ = radius * turn_rad;
    half_turn_ = half_turn();
    return Status::kOk;
  }

  Scalar half_turn() const { return Scalar(0.5) * length_ / radius_; }

  Scalar x_, y_;      // of the centre
  Scalar curvature_;  // signed
  Scalar radius_;
  Scalar start_;  // direction where it begins
  Scalar length_;
  Scalar half_turn_;  // from its beginning to its middle [rad]
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
