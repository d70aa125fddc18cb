// The shortest curve between two poses that never turns on less than a radius R (Dubins 1957): an
// arc, a line and an arc, or three arcs, with side s = 1 clockwise from above and -1 anticlockwise.
// The circle of side s beside a pose (p, psi) has its centre at c = p + s R n(psi), with
// n(psi) = (-sin psi, cos psi). With D = c2 - c1 of direction theta, the heading h on the line is
//
//     s1 = s2:    h = theta,                          L = |D|,                        [GUIDE 16]
//     s1 = -s2:   h = theta + s1 atan2(2 R, L),       L = sqrt(|D|^2 - 4 R^2),        [GUIDE 17]
//
// and three arcs s, -s, s meet at the headings, on either side (+-) of D,
//
//     h1 = theta +- a + s pi/2,   h2 = theta + pi -+ a + s pi/2,                      [GUIDE 18]
//
// with cos a = |D| / (4 R).
//
// Of these eight the shortest is taken; the first of equals, in the order above. A turn of almost
// 2 pi, which only rounding makes of none, counts as none.
#pragma once

#include <cstdint>
#include <limits>

#include "auvest/guidance/path_point.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Where a path begins or ends: north and east [m], and the direction there [rad].
template <class Scalar>
struct PathPose {
  Scalar x_m, y_m, heading_rad;
};

/// A part of a curve: where it begins, which way it turns and how far it goes.
template <class Scalar>
struct DubinsPart {
  Scalar x_m = Scalar(0), y_m = Scalar(0);
  Scalar sine = Scalar(0), cosine = Scalar(1);  ///< of the direction where it begins
  Scalar length_m = Scalar(0);
  std::int8_t side = 0;  ///< 1 clockwise, -1 anticlockwise, 0 straight on
};

template <class Scalar_>
struct DubinsCurve {
  using Scalar = Scalar_;
  using Part = DubinsPart<Scalar>;

  Part parts[3];
  Scalar length_m = Scalar(0);

  /// What is shorter than this, in radii, is none: a rounding.
  static constexpr Scalar smallest() {
    return Scalar(std::numeric_limits<Scalar>::digits > 30 ? 1e-7 : 1e-3);
  }
};

namespace detail {

/// The search for the shortest curve.
template <class Scalar>
class DubinsSearch {
 public:
  using Curve = DubinsCurve<Scalar>;
  using Part = DubinsPart<Scalar>;

  DubinsSearch(const PathPose<Scalar>& from, const PathPose<Scalar>& to, Scalar radius)
      : from_(from), to_(to), radius_(radius) {
    math::sincos(from.heading_rad, sine_[0], cosine_[0]);
    math::sincos(to.heading_rad, sine_[1], cosine_[1]);
    for (int first = 1; first >= -1; first -= 2) {
      for (int last = 1; last >= -1; last -= 2) look(first, last);
    }
  }

  bool found() const { return found_; }
  Scalar length_m() const { return length_; }

  /// Writes the parts of the shortest curve.
  void write(Curve& curve) const {
    Scalar x = from_.x_m, y = from_.y_m, sine = sine_[0], cosine = cosine_[0];
    curve.length_m = length_;
    for (int i = 0; i < 3; ++i) {
      Part& part = curve.parts[i];
      part.x_m = x;
      part.y_m = y;
      part.sine = sine;
      part.cosine = cosine;
      part.length_m = lengths_[i];
      part.side = sides_[i];
      if (i == 2) return;
      Scalar next_sine = sine, next_cosine = cosine;
      if (part.side != 0) math::sincos(headings_[i == 0 ? 0 : 1], next_sine, next_cosine);
      const Scalar bend = Scalar(part.side) * radius_;
      // On a circle the point is c - s R n(h).
      x = part.side != 0 ? x + bend * (next_sine - sine) : x + part.length_m * cosine;
      y = part.side != 0 ? y + bend * (cosine - next_cosine) : y + part.length_m * sine;
      sine = next_sine;
      cosine = next_cosine;
    }
  }

 private:
  void look(int first, int last) {
    const Scalar r1 = Scalar(first) * radius_;
    const Scalar r2 = Scalar(last) * radius_;
    const Scalar dx = (to_.x_m - r2 * sine_[1]) - (from_.x_m - r1 * sine_[0]);
    const Scalar dy = (to_.y_m + r2 * cosine_[1]) - (from_.y_m + r1 * cosine_[0]);
    const Scalar square = dx * dx + dy * dy;
    const Scalar distance = math::sqrt(square);
    const Scalar theta = math::atan2(dy, dx);
    if (first == last) {
      // On one and the same circle there is no line, and no direction of it.
      const bool same = distance <= Curve::smallest() * radius_;
      const Scalar h = same ? from_.heading_rad : theta;
      offer(first, 0, last, h, h, same ? Scalar(0) : distance);  // [GUIDE 16]
      const Scalar ratio = distance / (Scalar(4) * radius_);
      if (!(ratio <= Scalar(1))) return;
      const Scalar a = math::atan2(math::sqrt(Scalar(1) - ratio * ratio), ratio);
      const Scalar quarter = Scalar(first) * math::half_pi<Scalar>();
      for (int side = 1; side >= -1; side -= 2) {  // [GUIDE 18]
        const Scalar h1 = theta + Scalar(side) * a + quarter;
        const Scalar h2 = theta + math::pi<Scalar>() - Scalar(side) * a + quarter;
        offer(first, -first, last, h1, h2, radius_ * turn(-first, h1, h2));
      }
      return;
    }
    const Scalar rest = square - Scalar(4) * radius_ * radius_;
    if (!(rest >= Scalar(0))) return;
    const Scalar straight = math::sqrt(rest);
    const Scalar h = theta + Scalar(first) * math::atan2(Scalar(2) * radius_, straight);
    offer(first, 0, last, h, h, straight);  // [GUIDE 17]
  }

  /// From heading a to heading b on this side, in [0, 2 pi).
  static Scalar turn(int side, Scalar a, Scalar b) {
    const Scalar turned = math::wrap(side > 0 ? b - a : a - b);
    const Scalar whole = turned < Scalar(0) ? turned + math::two_pi<Scalar>() : turned;
    return whole > math::two_pi<Scalar>() - Curve::smallest() ? Scalar(0) : whole;
  }

  void offer(int first, int middle, int last, Scalar h1, Scalar h2, Scalar length) {
    const Scalar begin = radius_ * turn(first, from_.heading_rad, h1);
    const Scalar end = radius_ * turn(last, h2, to_.heading_rad);
    const Scalar sum = begin + length + end;
    if (!math::is_finite(sum) || (found_ && !(sum < length_))) return;
    found_ = true;
    length_ = sum;
    const Scalar lengths[3] = {begin, length, end};
    const int sides[3] = {first, middle, last};
    for (int i = 0; i < 3; ++i) {
      lengths_[i] = lengths[i];
      sides_[i] = static_cast<std::int8_t>(sides[i]);
    }
    headings_[0] = h1;
    headings_[1] = h2;
  }

  PathPose<Scalar> from_, to_;
  Scalar radius_;
  Scalar sine_[2], cosine_[2];  // of the two headings
  bool found_ = false;
  Scalar length_ = Scalar(0);
  Scalar lengths_[3] = {Scalar(0), Scalar(0), Scalar(0)};
  Scalar headings_[2] = {Scalar(0), Scalar(0)};  // after the first part and after the second
  std::int8_t sides_[3] = {0, 0, 0};
};

}  // namespace detail

/// The shortest curve between two poses with this radius [m], > 0. On anything but kOk (kNotFinite,
/// kBadParameter, kOverflow) the curve is what it was.
template <class Scalar>
Status shortest_curve(const PathPose<Scalar>& from, const PathPose<Scalar>& to, Scalar radius_m,
                      DubinsCurve<Scalar>& curve) {
  for (const PathPose<Scalar>* pose : {&from, &to}) {
    if (!math::is_finite(pose->x_m) || !math::is_finite(pose->y_m) ||
        !math::is_finite(pose->heading_rad)) {
      return Status::kNotFinite;
    }
  }
  if (!math::is_finite(radius_m)) return Status::kNotFinite;
  if (!math::is_positive(radius_m)) return Status::kBadParameter;
  const detail::DubinsSearch<Scalar> search(from, to, radius_m);
  if (!search.found()) return Status::kOverflow;
  search.write(curve);
  return Status::kOk;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
