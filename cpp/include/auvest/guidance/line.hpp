// A straight line as a path: along-track and cross-track distance, [GUIDE 1].
//
//     s = dx cos pi_h + dy sin pi_h,   e = -dx sin pi_h + dy cos pi_h,   (dx, dy) from its
//     beginning
//
// Sine, cosine and angle are formed once, by aim(): a chip then has four products per step. The
// line goes on beyond its end.
#pragma once

#include "auvest/guidance/path_point.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class Line {
 public:
  using Scalar = Scalar_;

  /// From the origin to the north, until aim() says otherwise.
  Line()
      : x_(Scalar(0)),
        y_(Scalar(0)),
        sine_(Scalar(0)),
        cosine_(Scalar(1)),
        direction_(Scalar(0)),
        length_(Scalar(0)) {}

  /// The line from (x, y) to (to_x, to_y) [m]. kNotFinite, or kBadParameter if the two coincide;
  /// the line is then what it was.
  Status aim(Scalar x, Scalar y, Scalar to_x, Scalar to_y) {
    const Scalar dx = to_x - x;
    const Scalar dy = to_y - y;
    const Scalar length = math::sqrt(dx * dx + dy * dy);
    if (!math::is_finite(x) || !math::is_finite(y) || !math::is_finite(length)) {
      return Status::kNotFinite;
    }
    if (!math::is_positive(length)) return Status::kBadParameter;
    x_ = x;
    y_ = y;
    sine_ = dy / length;
    cosine_ = dx / length;
    direction_ = math::atan2(dy, dx);
    length_ = length;
    return Status::kOk;
  }

  /// The line that leaves (x, y) [m] in the direction with this sine and cosine and is so long [m].
  /// kNotFinite, or kBadParameter for a length that is not positive; the line is then what it was.
  Status leave(Scalar x, Scalar y, Scalar sine, Scalar cosine, Scalar length_m) {
    if (!math::is_finite(x) || !math::is_finite(y) || !math::is_finite(sine) ||
        !math::is_finite(cosine) || !math::is_finite(length_m)) {
      return Status::kNotFinite;
    }
    if (!math::is_positive(length_m)) return Status::kBadParameter;
    x_ = x;
    y_ = y;
    sine_ = sine;
    cosine_ = cosine;
    direction_ = math::atan2(sine, cosine);
    length_ = length_m;
    return Status::kOk;
  }

  /// The point beside a vehicle at (x, y) [m].
  PathPoint<Scalar> locate(Scalar x, Scalar y) const {
    const Scalar dx = x - x_;
    const Scalar dy = y - y_;
    PathPoint<Scalar> point;
    point.direction_rad = direction_;
    point.sine = sine_;
    point.cosine = cosine_;
    // [GUIDE 1]
    point.along_m = dx * cosine_ + dy * sine_;
    point.cross_m = dy * cosine_ - dx * sine_;
    point.curvature = Scalar(0);
    return point;
  }

  Scalar length_m() const { return length_; }
  Scalar sine() const { return sine_; }      ///< of its direction
  Scalar cosine() const { return cosine_; }  ///< of its direction

 private:
  Scalar x_, y_;
  Scalar sine_, cosine_;
  Scalar direction_;
  Scalar length_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
