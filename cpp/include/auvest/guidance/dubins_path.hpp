// A plan of poses, joined by the shortest curves that the hull can fly (dubins.hpp).
//
// The vehicle's place beside the part that it is on is followed, not searched for: on an arc it
// may be a whole turn from where it was. A part is left where its end is passed, [GUIDE 3] without
// a lead; after the last pose the plan holds the line in its direction. Legs are formed one by one,
// as they begin: a chip has that to do once per leg.
//
//     static const auvest::PathPose<float> plan[] = {{0, 0, 0}, {100, 40, 3.14f}};
//     auvest::DubinsPath<float> path;
//     path.start(plan, 2);                           // kOk, or report().problem says what is wrong
//     auvest::PathPoint<float> point;
//     path.locate(x, y, point);                      // each period
#pragma once

#include <cstdint>

#include "auvest/guidance/circle.hpp"
#include "auvest/guidance/dubins.hpp"
#include "auvest/guidance/line.hpp"
#include "auvest/guidance/path_point.hpp"
#include "auvest/guidance/plan_report.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
class DubinsPath {
 public:
  using Scalar = Scalar_;
  using Pose = PathPose<Scalar>;
  using Curve = DubinsCurve<Scalar>;

  struct Params {
    Scalar radius_m = Scalar(20);  ///< of the arcs, > 0
    /// The smallest circle the hull turns on [m], >= 0, for warnings only; 0: none
    Scalar hull_m = Scalar(0);

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("radius_m", radius_m);
      v("hull_m", hull_m);
    }
  };

  explicit DubinsPath(const Params& params = Params())
      : params_(params),
        check_(math::is_positive(params.radius_m) && math::is_nonnegative(params.hull_m)
                   ? Status::kOk
                   : Status::kBadParameter) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }

  /// What start() would say to a plan. Poses that coincide are kTooClose; what makes the hull turn
  /// on less than its circle is kTightLeg.
  PlanReport examine(const Pose* poses, std::uint16_t count) const {
    PlanReport report = {PlanProblem::kTooFew, 0};
    if (count < 2) return report;
    for (std::uint16_t i = 0; i + 1 < count; ++i) {
      Curve curve;
      report.leg = i;
      report.problem = PlanProblem::kNotFinite;
      if (shortest_curve(poses[i], poses[i + 1], params_.radius_m, curve) != Status::kOk) {
        return report;
      }
      report.problem = PlanProblem::kTooClose;
      if (!is_part(curve.length_m)) return report;
    }
    const bool tight = params_.radius_m < params_.hull_m;
    report.problem = tight ? PlanProblem::kTightLeg : PlanProblem::kNone;
    report.leg = 0;
    return report;
  }

  /// Takes a plan and begins with its first leg. The poses stay where they are: they must live as
  /// long as the plan is in use. On anything but kOk the old plan goes on; report() says why.
  Status start(const Pose* poses, std::uint16_t count) {
    if (check_ != Status::kOk) return check_;
    report_ = examine(poses, count);
    if (report_.status() != Status::kOk) return report_.status();
    poses_ = poses;
    count_ = count;
    finished_ = false;
    begin_leg(0);
    return Status::kOk;
  }

  /// Goes on to the next part where that is due, then says where (x, y) [m] is beside the path.
  /// `along_m` counts from the beginning of the part.
  Status locate(Scalar x, Scalar y, PathPoint<Scalar>& point) {
    if (count_ == 0) return Status::kNotInitialised;
    if (!math::is_finite(x) || !math::is_finite(y)) return Status::kNotFinite;
    PathPoint<Scalar> found = here(x, y);
    if (!math::is_finite(found.along_m) || !math::is_finite(found.cross_m)) {
      return Status::kOverflow;
    }
    while (!finished_ && !(found.along_m < part().length_m)) {
      advance();
      found = here(x, y);
    }
    along_ = found.along_m;
    point = found;
    return Status::kOk;
  }

  const PlanReport& report() const { return report_; }  ///< on the plan that start() saw last
  std::uint16_t leg() const { return leg_; }            ///< from 0
  const Curve& curve() const { return curve_; }         ///< of the leg
  bool on_arc() const { return !finished_ && count_ > 0 && part().side != 0; }
  /// True once the last pose has been passed.
  bool finished() const { return finished_; }
  /// To the end of the leg, as of the last locate() [m]; negative beyond the last pose.
  Scalar remaining_m() const {
    if (finished_) return -along_;
    Scalar sum = -along_;
    for (int i = part_; i < 3; ++i) sum = sum + curve_.parts[i].length_m;
    return sum;
  }
  const Params& params() const { return params_; }

 private:
  const DubinsPart<Scalar>& part() const { return curve_.parts[part_]; }

  bool is_part(Scalar length) const { return length > Curve::smallest() * params_.radius_m; }

  PathPoint<Scalar> here(Scalar x, Scalar y) const {
    if (finished_ || part().side == 0) return line_.locate(x, y);
    PathPoint<Scalar> point = arc_.locate(x, y);
    // The turn that is nearest to where it was.
    const Scalar half = math::pi<Scalar>() * params_.radius_m;
    if (point.along_m - along_ > half) point.along_m = point.along_m - (half + half);
    if (along_ - point.along_m > half) point.along_m = point.along_m + (half + half);
    return point;
  }

  void advance() {
    if (part_ < 2) {
      begin_part(part_ + 1);
    } else if (leg_ + 2 < count_) {
      begin_leg(static_cast<std::uint16_t>(leg_ + 1));
    } else {
      const Pose& last = poses_[count_ - 1];
      Scalar sine, cosine;
      math::sincos(last.heading_rad, sine, cosine);
      line_.leave(last.x_m, last.y_m, sine, cosine, params_.radius_m);
      finished_ = true;
      along_ = Scalar(0);
    }
  }

  void begin_leg(std::uint16_t leg) {
    leg_ = leg;
    shortest_curve(poses_[leg], poses_[leg + 1], params_.radius_m, curve_);
    begin_part(0);
  }

  void begin_part(int i) {
    part_ = i;
    along_ = Scalar(0);
    DubinsPart<Scalar>& p = curve_.parts[i];
    if (!is_part(p.length_m)) p.length_m = Scalar(0);
    if (p.length_m > Scalar(0) && p.side == 0) {
      line_.leave(p.x_m, p.y_m, p.sine, p.cosine, p.length_m);
    } else if (p.length_m > Scalar(0)) {
      const Scalar signed_radius = Scalar(p.side) * params_.radius_m;
      arc_.leave(p.x_m, p.y_m, p.sine, p.cosine, signed_radius, p.length_m / params_.radius_m);
    } else {
      advance();
    }
  }

  Params params_;
  Status check_;
  const Pose* poses_ = nullptr;
  std::uint16_t count_ = 0;
  std::uint16_t leg_ = 0;
  int part_ = 0;
  bool finished_ = false;
  PlanReport report_ = {PlanProblem::kTooFew, 0};
  Curve curve_;
  Line<Scalar> line_;
  Circle<Scalar> arc_;
  Scalar along_ = Scalar(0);  // of the part
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
