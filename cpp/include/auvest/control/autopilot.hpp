// The controllers of a torpedo together: from what guidance asks for to rudder, stern planes and
// propeller, once per period.
//
//     auvest::Autopilot<float> autopilot;
//     auvest::AutopilotReadings<float> now;              // once: the heading it starts at
//     autopilot.restart(now.heading_rad);
//     auvest::TorpedoCommand<float> out;                 // each period of 0.1 s:
//     autopilot.update(command, 1.5f, 5.0f, now, 0.1f, out);
#pragma once

#include "auvest/control/depth_control.hpp"
#include "auvest/control/heading_control.hpp"
#include "auvest/control/heading_reference.hpp"
#include "auvest/control/pitch_control.hpp"
#include "auvest/control/reference.hpp"
#include "auvest/control/speed_control.hpp"
#include "auvest/guidance/guidance_law.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {

/// What the controllers read of the vehicle.
template <class Scalar>
struct AutopilotReadings {
  Scalar heading_rad = Scalar(0);       ///< psi
  Scalar yaw_rate_rad_s = Scalar(0);    ///< r
  Scalar speed_m_s = Scalar(0);         ///< u_r, through the water
  Scalar depth_m = Scalar(0);           ///< z, down
  Scalar pitch_rad = Scalar(0);         ///< theta
  Scalar pitch_rate_rad_s = Scalar(0);  ///< q
};

/// What the actuators of a torpedo are told.
template <class Scalar>
struct TorpedoCommand {
  Scalar rudder_rad = Scalar(0);        ///< positive: to starboard
  Scalar stern_planes_rad = Scalar(0);  ///< positive: nose down
  Scalar propeller_rev_s = Scalar(0);
};

template <class Scalar_>
class Autopilot {
 public:
  using Scalar = Scalar_;

  struct Params {
    typename HeadingReference<Scalar>::Params reference;
    typename HeadingControl<Scalar>::Params heading;
    typename SpeedControl<Scalar>::Params speed;
    typename DepthControl<Scalar>::Params depth;
    typename PitchControl<Scalar>::Params pitch;

    /// Names every member, in the order of stored records: groups, each with a visit of its own.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("reference", reference);
      v("heading", heading);
      v("speed", speed);
      v("depth", depth);
      v("pitch", pitch);
    }
  };

  explicit Autopilot(const Params& params = Params())
      : reference_(params.reference),
        heading_(params.heading),
        speed_(params.speed),
        depth_(params.depth),
        pitch_(params.pitch) {}

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const {
    const Status parts[] = {reference_.check(), heading_.check(), speed_.check(), depth_.check(),
                            pitch_.check()};
    for (const Status part : parts) {
      if (part != Status::kOk) return part;
    }
    return Status::kOk;
  }

  /// Begins at this heading [rad], the vehicle's own, with empty integrals.
  Status restart(Scalar heading_rad) {
    const Status status = reference_.restart(heading_rad);
    if (status != Status::kOk) return status;
    heading_.restart();
    speed_.restart();
    depth_.restart();
    pitch_.restart();
    return Status::kOk;
  }

  /// The actuators' commands for the next dt seconds, at this speed through the water [m/s] and
  /// depth [m]. On anything but kOk nothing has changed, the command neither.
  Status update(const GuidanceCommand<Scalar>& wanted, Scalar speed_m_s, Scalar depth_m,
                const AutopilotReadings<Scalar>& now, Scalar dt, TorpedoCommand<Scalar>& command) {
    Reference<Scalar> reference;
    ControlStep<Scalar> rudder, propeller, pitch, planes;
    Status status = reference_.propose(wanted, dt, reference);
    if (status != Status::kOk) return status;
    status =
        heading_.propose(reference, now.heading_rad, now.yaw_rate_rad_s, now.speed_m_s, dt, rudder);
    if (status != Status::kOk) return status;
    status = speed_.propose(speed_m_s, now.speed_m_s, dt, propeller);
    if (status != Status::kOk) return status;
    status = depth_.propose(depth_m, now.depth_m, dt, pitch);
    if (status != Status::kOk) return status;
    status = pitch_.propose(pitch.command, now.pitch_rad, now.pitch_rate_rad_s, dt, planes);
    if (status != Status::kOk) return status;
    reference_.accept(reference);
    heading_.accept(rudder);
    speed_.accept(propeller);
    depth_.accept(pitch);
    pitch_.accept(planes);
    command.rudder_rad = rudder.command;
    command.stern_planes_rad = planes.command;
    command.propeller_rev_s = propeller.command;
    return Status::kOk;
  }

  const HeadingReference<Scalar>& reference() const { return reference_; }
  const HeadingControl<Scalar>& heading() const { return heading_; }
  const SpeedControl<Scalar>& speed() const { return speed_; }
  const DepthControl<Scalar>& depth() const { return depth_; }
  const PitchControl<Scalar>& pitch() const { return pitch_; }

 private:
  HeadingReference<Scalar> reference_;
  HeadingControl<Scalar> heading_;
  SpeedControl<Scalar> speed_;
  DepthControl<Scalar> depth_;
  PitchControl<Scalar> pitch_;
};

}  // namespace auvest
