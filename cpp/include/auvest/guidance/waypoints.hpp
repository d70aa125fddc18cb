// A plan of waypoints: straight legs, with corners or with arcs that the hull can fly between them.
//
// A leg is left on the along-track distance, [GUIDE 3], and not on a circle of acceptance: a
// vehicle that misses such a circle would turn back for it. With corners the lead is `switch_m`;
// with arcs of radius R it is where the arc begins, [GUIDE 4],
//
//     len - s < lead,   lead = R tan(|turn| / 2) = R |sin turn| / (1 + cos turn).
//
// What the switch to the next leg takes (its direction, its arc) is formed in periods that do not
// switch, one thing in each: no period has all of it to do.
//
// After the last waypoint the plan holds the line of its last leg, or turns on a circle that begins
// where the leg ends (end_radius_m). Both are there for as long as locate() is asked.
//
//     static const auvest::Waypoint<float> plan[] = {{0, 0}, {100, 0}, {100, 40}};
//     auvest::Waypoints<float> path;
//     path.start(plan, 3);                           // kOk, or report().problem says what is wrong
//     auvest::PathPoint<float> point;
//     path.locate(x, y, point);                      // each period
#pragma once

#include <cstdint>

#include "auvest/guidance/circle.hpp"
#include "auvest/guidance/line.hpp"
#include "auvest/guidance/path_point.hpp"
#include "auvest/guidance/plan_report.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// North and east [m]: 8 bytes each in float.
template <class Scalar>
struct Waypoint {
  Scalar x_m, y_m;
};

template <class Scalar_>
class Waypoints {
 public:
  using Scalar = Scalar_;
  using Point = Waypoint<Scalar>;

  struct Params {
    /// R: at corners, the distance before the end of a leg at which the next one begins [m], >= 0
    Scalar switch_m = Scalar(10);
    /// Radius of the arcs between the legs [m], >= 0; 0: corners
    Scalar arc_m = Scalar(0);
    /// The smallest circle the hull turns on [m], >= 0, for warnings only; 0: none
    Scalar hull_m = Scalar(0);
    /// Radius of the circle after the last leg [m], positive clockwise; 0: the line goes on
    Scalar end_radius_m = Scalar(0);

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("switch_m", switch_m);
      v("arc_m", arc_m);
      v("hull_m", hull_m);
      v("end_radius_m", end_radius_m);
    }
  };

  explicit Waypoints(const Params& params = Params())
      : params_(params),
        check_(valid(params) ? Status::kOk : Status::kBadParameter),
        points_(nullptr),
        count_(0),
        leg_(0),
        where_(Where::kLeg),
        formed_(Formed::kAll) {
    report_.problem = PlanProblem::kTooFew;
    report_.leg = 0;
  }

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// What start() would say to a plan.
  PlanReport examine(const Point* points, std::uint16_t count) const {
    PlanReport report = {PlanProblem::kTooFew, 0};
    if (count < 2) return report;
    report.problem = PlanProblem::kNone;
    PlanReport warning = report;
    Line<Scalar> leg;
    Scalar lead = Scalar(0);  // used up by the arc at the beginning of the leg
    for (std::uint16_t i = 0; i + 1 < count; ++i) {
      report.leg = i;
      const Status status = aim(leg, points, i);
      if (status == Status::kNotFinite) report.problem = PlanProblem::kNotFinite;
      if (status == Status::kBadParameter) report.problem = PlanProblem::kTooClose;
      if (report.problem != PlanProblem::kNone) return report;
      Corner corner = {Scalar(0), Scalar(0)};
      const bool last = i + 2 == count;
      if (!last) {
        Line<Scalar> next;
        const Status after = aim(next, points, static_cast<std::uint16_t>(i + 1));
        if (after == Status::kOk) corner = corner_between(leg, next);
      }
      const bool arcs = params_.arc_m > Scalar(0);
      if (!arcs && !(leg.length_m() > params_.switch_m)) report.problem = PlanProblem::kTooClose;
      if (arcs && !(lead + corner.lead <= leg.length_m())) report.problem = PlanProblem::kNoRoom;
      if (report.problem != PlanProblem::kNone) return report;
      const bool turns = !last && corner.turn != Scalar(0);
      const bool tight = arcs ? turns && params_.arc_m < params_.hull_m
                              : leg.length_m() < Scalar(2) * params_.hull_m;
      if (tight && warning.problem == PlanProblem::kNone) {
        warning.problem = PlanProblem::kTightLeg;
        warning.leg = i;
      }
      lead = corner.lead;
    }
    return warning;
  }

  /// Takes a plan and begins with its first leg. The waypoints stay where they are: they must live
  /// as long as the plan is in use. On anything but kOk the old plan goes on; report() says why.
  Status start(const Point* points, std::uint16_t count) {
    if (check_ != Status::kOk) return check_;
    report_ = examine(points, count);
    if (report_.status() != Status::kOk) return report_.status();
    points_ = points;
    count_ = count;
    aim(line_, points_, 0);
    take_line(0);
    begin_leg(0);
    return Status::kOk;
  }

  /// Switches the leg where that is due, then says where (x, y) [m] is beside the path. `along_m`
  /// counts from the waypoint at which the leg began, or from the beginning of the arc.
  Status locate(Scalar x, Scalar y, PathPoint<Scalar>& point) {
    if (count_ == 0) return Status::kNotInitialised;
    if (!math::is_finite(x) || !math::is_finite(y)) return Status::kNotFinite;
    PathPoint<Scalar> found = here(x, y);
    if (!math::is_finite(found.along_m) || !math::is_finite(found.cross_m)) {
      return Status::kOverflow;
    }
    remaining_ = length() - found.along_m;
    if (!due()) {
      form_ahead();
    } else {
      do {
        advance();
        found = here(x, y);
        remaining_ = length() - found.along_m;
      } while (due());
    }
    if (circling()) remaining_ = Scalar(0);
    point = found;
    return Status::kOk;
  }

  /// Where (x, y) [m] is beside the leg or arc as it is, without a switch; as locate() otherwise.
  PathPoint<Scalar> beside(Scalar x, Scalar y) const { return here(x, y); }

  const PlanReport& report() const { return report_; }  ///< on the plan that start() saw last
  std::uint16_t leg() const { return leg_; }  ///< from 0; an arc belongs to the leg before
  bool on_arc() const { return where_ == Where::kArc; }
  /// True once the last waypoint has been passed.
  bool finished() const { return where_ == Where::kEnd; }
  /// To the end of the leg or arc, as of the last locate() [m]; negative on the line beyond the
  /// last waypoint, 0 on the circle there.
  Scalar remaining_m() const { return remaining_; }
  const Params& params() const { return params_; }

 private:
  static bool valid(const Params& p) {
    return math::is_nonnegative(p.switch_m) && math::is_nonnegative(p.arc_m) &&
           math::is_nonnegative(p.hull_m) && math::is_finite(p.end_radius_m);
  }

  enum class Where : std::uint8_t { kLeg, kArc, kEnd };

  struct Corner {
    Scalar turn;  // [rad], positive clockwise
    Scalar lead;  // [m]
  };

  static Status aim(Line<Scalar>& line, const Point* points, std::uint16_t i) {
    return line.aim(points[i].x_m, points[i].y_m, points[i + 1].x_m, points[i + 1].y_m);
  }

  Corner corner_between(const Line<Scalar>& a, const Line<Scalar>& b) const {
    const Scalar sine = a.cosine() * b.sine() - a.sine() * b.cosine();
    const Scalar cosine = a.cosine() * b.cosine() + a.sine() * b.sine();
    Corner corner;
    corner.turn = math::atan2(sine, cosine);
    // [GUIDE 4]: infinite where the plan turns back
    corner.lead = params_.arc_m * (sine < Scalar(0) ? -sine : sine) / (Scalar(1) + cosine);
    return corner;
  }

  bool last() const { return leg_ + 2 == count_; }

  bool circling() const { return where_ == Where::kEnd && params_.end_radius_m != Scalar(0); }

  PathPoint<Scalar> here(Scalar x, Scalar y) const {
    return where_ == Where::kArc || circling() ? arc_.locate(x, y) : line_.locate(x, y);
  }

  Scalar length() const { return where_ == Where::kArc ? arc_.length_m() : line_.length_m(); }

  bool due() const {
    if (where_ == Where::kEnd) return false;
    return !(remaining_ > Scalar(0)) || (where_ == Where::kLeg && remaining_ < lead_);  // [GUIDE 3]
  }

  // Of the end of `line_`, what is there, in this order. The line on an arc is already that of the
  // leg behind it.
  enum class Formed : std::uint8_t { kLine, kNext, kCorner, kAll };

  std::uint16_t leg_of_line() const {
    return static_cast<std::uint16_t>(where_ == Where::kArc ? leg_ + 1 : leg_);
  }
  bool arcs() const { return params_.arc_m > Scalar(0); }

  /// Forms the next thing of the end of the line; its arc not before that is free.
  void form() {
    switch (formed_) {
      case Formed::kLine:
        aim(next_, points_, static_cast<std::uint16_t>(leg_of_line() + 1));
        formed_ = arcs() ? Formed::kNext : Formed::kAll;
        return;
      case Formed::kNext: {
        const Corner corner = corner_between(line_, next_);
        turn_ = corner.turn;
        lead_ = corner.lead;
        formed_ = turn_ != Scalar(0) ? Formed::kCorner : Formed::kAll;
        return;
      }
      case Formed::kCorner: {
        const Point& corner = points_[leg_ + 1];
        const bool anticlockwise = turn_ < Scalar(0);
        const Status status =
            arc_.leave(corner.x_m - lead_ * line_.cosine(), corner.y_m - lead_ * line_.sine(),
                       line_.sine(), line_.cosine(), anticlockwise ? -params_.arc_m : params_.arc_m,
                       anticlockwise ? -turn_ : turn_);
        if (status != Status::kOk) turn_ = Scalar(0);  // too far out for an arc in this precision
        formed_ = Formed::kAll;
        return;
      }
      case Formed::kAll:
        return;
    }
  }
  void form_ahead() {
    if (formed_ != Formed::kCorner || where_ == Where::kLeg) form();
  }
  void form_up_to(Formed wanted) {
    while (formed_ < wanted) form();
  }

  /// `line_` is now this leg's, and nothing of its end is there.
  void take_line(std::uint16_t leg) {
    const bool last = leg + 2 == count_;
    turn_ = Scalar(0);
    lead_ = last ? Scalar(0) : params_.switch_m;
    formed_ = last ? Formed::kAll : Formed::kLine;
  }
  void begin_leg(std::uint16_t leg) {
    leg_ = leg;
    where_ = Where::kLeg;
    remaining_ = line_.length_m();
    if (arcs()) form_up_to(Formed::kCorner);
  }

  void advance() {
    const std::uint16_t next = static_cast<std::uint16_t>(leg_ + 1);
    if (where_ == Where::kArc) return begin_leg(next);
    if (last()) {
      where_ = Where::kEnd;
      if (circling()) {
        arc_.leave(points_[next].x_m, points_[next].y_m, line_.sine(), line_.cosine(),
                   params_.end_radius_m, math::two_pi<Scalar>());
      }
      return;
    }
    form_up_to(Formed::kAll);
    const bool rounded = turn_ != Scalar(0);
    line_ = next_;
    take_line(next);
    if (!rounded) return begin_leg(next);
    where_ = Where::kArc;
  }

  Params params_;
  Status check_;
  const Point* points_;
  std::uint16_t count_;
  std::uint16_t leg_;
  Where where_;
  Formed formed_;
  PlanReport report_;
  Line<Scalar> line_, next_;
  Circle<Scalar> arc_;
  Scalar lead_ = Scalar(0);
  Scalar turn_ = Scalar(0);
  Scalar remaining_ = Scalar(0);
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
