// What the controllers with an integral have in common: the limits of their command, and an
// integral that does not wind up, [CONTROL 1]: while the command is cut off at a limit, it takes
// only what leads away from that limit (conditional integration),
//
//     I <- I + dt error   unless the error asks for more of what is cut off.
//
// Such a controller offers propose(..., step), which computes a step and changes nothing that is
// seen, and update(..., command), which also takes it: so several controllers can step together or
// not at all.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// One step of a controller.
template <class Scalar>
struct ControlStep {
  Scalar command = Scalar(0);
  Scalar integral = Scalar(0);  ///< after the step
  bool saturated = false;
};

template <class Scalar_>
class IntegratingControl {
 public:
  using Scalar = Scalar_;
  using Step = ControlStep<Scalar>;

  /// kBadParameter if a parameter is out of range: everything else then refuses, too.
  Status check() const { return check_; }
  bool saturated() const { return saturated_; }  ///< in the last step
  Scalar integral() const { return integral_; }  ///< of the error, over time

  /// Goes on with this integral; what is not a number is refused.
  Status restart(Scalar integral = Scalar(0)) {
    if (!math::is_finite(integral)) return Status::kNotFinite;
    integral_ = integral;
    saturated_ = false;
    return Status::kOk;
  }

  /// Takes a step that was proposed.
  void accept(const Step& step) {
    integral_ = step.integral;
    saturated_ = step.saturated;
  }

 protected:
  explicit IntegratingControl(bool valid)
      : check_(valid ? Status::kOk : Status::kBadParameter),
        saturated_(false),
        integral_(Scalar(0)) {}

  /// kOk where the parameters are valid, each of these values is finite, and time goes on.
  template <class... Values>
  Status admit(Scalar dt, Values... values) const {
    if (check_ != Status::kOk) return check_;
    if (!all_finite(dt, values...)) return Status::kNotFinite;
    return dt < Scalar(0) ? Status::kTimeBackwards : Status::kOk;
  }

  /// Takes a step that was proposed with this status, if that is kOk.
  Status take(Status proposed, const Step& step, Scalar& command) {
    if (proposed != Status::kOk) return proposed;
    accept(step);
    command = step.command;
    return Status::kOk;
  }

  /// The step that gives `wished` within its limits. `raises`: a positive error raises the command.
  Status limit(Scalar wished, Scalar low, Scalar high, Scalar error, bool raises, Scalar dt,
               Step& step) const {
    if (!math::is_finite(wished)) return Status::kOverflow;
    const bool above = wished > high;
    const bool below = wished < low;
    step.command = above ? high : below ? low : wished;
    step.saturated = above || below;
    const bool adds = error > Scalar(0) ? (raises ? above : below) : (raises ? below : above);
    step.integral = adds ? integral_ : integral_ + dt * error;  // [CONTROL 1]
    return Status::kOk;
  }

 private:
  static bool all_finite() { return true; }
  template <class... Others>
  static bool all_finite(Scalar first, Others... others) {
    return math::is_finite(first) && all_finite(others...);
  }

  Status check_;
  bool saturated_;
  Scalar integral_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
