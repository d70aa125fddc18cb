// A smooth curve through waypoints: Catmull and Rom's cubic on the lengths of its chords. Between
// P_i and P_(i+1), h = |P_(i+1) - P_i| apart, t from 0 to 1,
//
//     H(t) = P_i + t h T_i + t^2 (3 C - h (2 T_i + T_(i+1))) + t^3 (h (T_i + T_(i+1)) - 2 C),
//     C = P_(i+1) - P_i,                                                              [GUIDE 19]
//     T_i = (h_i C_(i-1) / h_(i-1) + h_(i-1) C_i / h_i) / (h_(i-1) + h_i),            [GUIDE 20]
//
// at the first and the last waypoint the direction of the chord. Its direction does not jump; its
// curvature may, at a waypoint. It is local: a leg needs four waypoints and no system of equations.
// The point beside the vehicle is followed by Newton's method from where it was,
//
//     t <- t - f / f',   f = (H - p) . H',   f' = H' . H' + (H - p) . H'',            [GUIDE 21]
//
// within a quarter of a leg per step: it does not jump to another part of a plan that comes near.
// Where f' is less than half of H' . H' that stands for it: so near the centre of a bend it may be
// 0. After the last waypoint the plan holds the line of its end.
#pragma once

#include <cstdint>

#include "auvest/guidance/line.hpp"
#include "auvest/guidance/path_point.hpp"
#include "auvest/guidance/plan_report.hpp"
#include "auvest/guidance/waypoints.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class SplinePath {
 public:
  using Scalar = Scalar_;
  using Point = Waypoint<Scalar>;

  struct Params {
    /// The smallest circle the hull turns on [m], >= 0, for warnings only; 0: none
    Scalar hull_m = Scalar(0);

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("hull_m", hull_m);
    }
  };

  explicit SplinePath(const Params& params = Params())
      : params_(params),
        check_(math::is_nonnegative(params.hull_m) ? Status::kOk : Status::kBadParameter) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// What start() would say to a plan: kTightLeg where a leg bends more than the hull's circle.
  PlanReport examine(const Point* points, std::uint16_t count) const {
    PlanReport report = {PlanProblem::kTooFew, 0};
    if (count < 2) return report;
    report.problem = PlanProblem::kNone;
    for (std::uint16_t i = 0; i + 1 < count && report.problem == PlanProblem::kNone; ++i) {
      report.leg = i;
      Line<Scalar> chord;
      const Status status =
          chord.aim(points[i].x_m, points[i].y_m, points[i + 1].x_m, points[i + 1].y_m);
      if (status == Status::kNotFinite) report.problem = PlanProblem::kNotFinite;
      if (status == Status::kBadParameter) report.problem = PlanProblem::kTooClose;
    }
    if (report.problem != PlanProblem::kNone) return report;
    for (std::uint16_t i = 0; i + 1 < count; ++i) {
      report.leg = i;
      const Leg leg(points, count, i);
      for (int k = 0; k <= 16; ++k) {
        const Scalar bend = math::absolute(leg.at(Scalar(k) / Scalar(16)).curvature());
        if (!math::is_finite(bend)) report.problem = PlanProblem::kNotFinite;
        if (bend * params_.hull_m > Scalar(1)) report.problem = PlanProblem::kTightLeg;
        if (report.problem != PlanProblem::kNone) return report;
      }
    }
    report.leg = 0;
    return report;
  }

  /// Takes a plan and begins with its first leg. The waypoints stay where they are: they must live
  /// as long as the plan is in use. On anything but kOk the old plan goes on; report() says why.
  Status start(const Point* points, std::uint16_t count) {
    if (check_ != Status::kOk) return check_;
    report_ = examine(points, count);
    if (report_.status() != Status::kOk) return report_.status();
    points_ = points;
    count_ = count;
    finished_ = false;
    begin_leg(0, Scalar(0));
    return Status::kOk;
  }

  /// Goes on to the next leg where that is due, then says where (x, y) [m] is beside the path.
  /// `along_m` counts from the waypoint at which the leg began.
  Status locate(Scalar x, Scalar y, PathPoint<Scalar>& point) {
    if (count_ == 0) return Status::kNotInitialised;
    if (!math::is_finite(x) || !math::is_finite(y)) return Status::kNotFinite;
    if (!finished_) follow(x, y);
    const Jet jet = cubic_.at(t_);
    const Scalar speed = math::sqrt(jet.first[0] * jet.first[0] + jet.first[1] * jet.first[1]);
    PathPoint<Scalar> found;
    found.cosine = jet.first[0] / speed;
    found.sine = jet.first[1] / speed;
    found.direction_rad = math::atan2(found.sine, found.cosine);
    const Scalar dx = x - jet.value[0];
    const Scalar dy = y - jet.value[1];
    const Scalar ahead = dx * found.cosine + dy * found.sine;  // but for a rounding 0 on the curve
    found.cross_m = dy * found.cosine - dx * found.sine;
    found.curvature = finished_ ? Scalar(0) : jet.curvature();
    found.along_m = cubic_.length_to(t_) + ahead;
    if (!math::is_finite(found.along_m) || !math::is_finite(found.cross_m)) {
      return Status::kOverflow;
    }
    if (!finished_ && last() && !(t_ < Scalar(1))) finished_ = true;
    remaining_ = length_ - found.along_m;
    point = found;
    return Status::kOk;
  }

  const PlanReport& report() const { return report_; }  ///< on the plan that start() saw last
  std::uint16_t leg() const { return leg_; }            ///< from 0
  /// True once the last waypoint has been passed.
  bool finished() const { return finished_; }
  /// To the end of the leg, as of the last locate() [m]; negative beyond the last waypoint.
  Scalar remaining_m() const { return remaining_; }
  const Params& params() const { return params_; }

 private:
  /// A point of the curve and its derivatives by t.
  struct Jet {
    Scalar value[2], first[2], second[2];

    Scalar curvature() const {
      const Scalar square = first[0] * first[0] + first[1] * first[1];
      return (first[0] * second[1] - first[1] * second[0]) / (square * math::sqrt(square));
    }
  };

  /// The cubic of a leg.
  struct Leg {
    Scalar c[4][2];

    Leg() {
      for (auto& pair : c) pair[0] = pair[1] = Scalar(0);
    }
    Leg(const Point* points, std::uint16_t count, std::uint16_t i) {
      Scalar chord[2], begin[2], end[2];
      const Scalar h = between(points[i], points[i + 1], chord);
      tangent(points, count, i, begin);
      tangent(points, count, static_cast<std::uint16_t>(i + 1), end);
      c[0][0] = points[i].x_m;
      c[0][1] = points[i].y_m;
      for (int k = 0; k < 2; ++k) {  // [GUIDE 19]
        c[1][k] = h * begin[k];
        c[2][k] = Scalar(3) * chord[k] - h * (Scalar(2) * begin[k] + end[k]);
        c[3][k] = h * (begin[k] + end[k]) - Scalar(2) * chord[k];
      }
    }

    Jet at(Scalar t) const {
      Jet jet;
      for (int k = 0; k < 2; ++k) {
        jet.value[k] = c[0][k] + t * (c[1][k] + t * (c[2][k] + t * c[3][k]));
        jet.first[k] = c[1][k] + t * (Scalar(2) * c[2][k] + Scalar(3) * t * c[3][k]);
        jet.second[k] = Scalar(2) * c[2][k] + Scalar(6) * t * c[3][k];
      }
      return jet;
    }

    /// Length from 0 to t: Gauss's five points.
    Scalar length_to(Scalar t) const {
      static const double kPlace[5] = {0.046910077030668, 0.2307653449471585, 0.5,
                                       0.7692346550528415, 0.953089922969332};
      static const double kWeight[5] = {0.11846344252809454, 0.23931433524968324,
                                        0.28444444444444444, 0.23931433524968324,
                                        0.11846344252809454};
      Scalar sum = Scalar(0);
      for (int k = 0; k < 5; ++k) {
        const Jet jet = at(t * Scalar(kPlace[k]));
        const Scalar square = jet.first[0] * jet.first[0] + jet.first[1] * jet.first[1];
        sum = sum + Scalar(kWeight[k]) * math::sqrt(square);
      }
      return t * sum;
    }

    static Scalar between(const Point& from, const Point& to, Scalar (&chord)[2]) {
      chord[0] = to.x_m - from.x_m;
      chord[1] = to.y_m - from.y_m;
      return math::sqrt(chord[0] * chord[0] + chord[1] * chord[1]);
    }

    static void tangent(const Point* points, std::uint16_t count, std::uint16_t i,
                        Scalar (&tangent)[2]) {
      Scalar before[2] = {Scalar(0), Scalar(0)};
      Scalar after[2] = {Scalar(0), Scalar(0)};
      const bool first = i == 0;
      const bool last = i + 1 == count;
      const Scalar h0 = first ? Scalar(0) : between(points[i - 1], points[i], before);
      const Scalar h1 = last ? Scalar(0) : between(points[i], points[i + 1], after);
      for (int k = 0; k < 2; ++k) {
        if (first || last) {
          tangent[k] = first ? after[k] / h1 : before[k] / h0;
        } else {
          tangent[k] = (h1 * (before[k] / h0) + h0 * (after[k] / h1)) / (h0 + h1);  // [GUIDE 20]
        }
      }
    }
  };

  bool last() const { return leg_ + 2 == count_; }

  void begin_leg(std::uint16_t leg, Scalar t) {
    leg_ = leg;
    cubic_ = Leg(points_, count_, leg);
    length_ = cubic_.length_to(Scalar(1));
    t_ = t;
  }

  /// Moves t to the point of the curve beside (x, y), over as many legs as it takes.
  void follow(Scalar x, Scalar y) {
    for (int k = 0; k < kSteps;) {
      const Jet jet = cubic_.at(t_);
      const Scalar dx = jet.value[0] - x;
      const Scalar dy = jet.value[1] - y;
      const Scalar f = dx * jet.first[0] + dy * jet.first[1];
      const Scalar square = jet.first[0] * jet.first[0] + jet.first[1] * jet.first[1];
      const Scalar slope = square + dx * jet.second[0] + dy * jet.second[1];
      const Scalar down = slope > Scalar(0.5) * square ? slope : square;
      const Scalar most = Scalar(0.25);
      t_ = t_ - math::clamp(f / down, -most, most);  // [GUIDE 21]
      ++k;
      if (!(t_ < Scalar(1)) && !last()) {
        begin_leg(static_cast<std::uint16_t>(leg_ + 1), Scalar(0));
        k = 0;
      }
    }
    t_ = math::clamp(t_, Scalar(0), Scalar(1));
  }

  static const int kSteps = 4;

  Params params_;
  Status check_;
  const Point* points_ = nullptr;
  std::uint16_t count_ = 0;
  std::uint16_t leg_ = 0;
  bool finished_ = false;
  PlanReport report_ = {PlanProblem::kTooFew, 0};
  Leg cubic_;
  Scalar length_ = Scalar(0);
  Scalar t_ = Scalar(0);
  Scalar remaining_ = Scalar(0);
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
