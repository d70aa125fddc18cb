// An integral that does not wind up, [CONTROL 1]: while the command is cut off at a limit, it takes
// only what leads away from that limit (conditional integration).
//
//     I <- I + dt error   unless   error * excess > 0,
//
// `excess` being the command as wished less the command as given, in the sense in which a positive
// error raises it: 0 while nothing is cut off.
#pragma once

#include "auvest/config.hpp"

namespace auvest {

template <class Scalar_>
class Integrator {
 public:
  using Scalar = Scalar_;

  Integrator() : value_(Scalar(0)) {}

  void add(Scalar error, Scalar dt, Scalar excess) {
    const bool deeper =
        (error > Scalar(0) && excess > Scalar(0)) || (error < Scalar(0) && excess < Scalar(0));
    if (!deeper) value_ = value_ + dt * error;  // [CONTROL 1]
  }

  Scalar value() const { return value_; }
  void restart(Scalar value = Scalar(0)) { value_ = value; }

 private:
  Scalar value_;
};

}  // namespace auvest
