// What a controller is to follow: a wanted value with its first two derivatives.
#pragma once

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// In the unit of the value: rad for a heading or pitch, m for a depth.
template <class Scalar>
struct Reference {
  Scalar value = Scalar(0);
  Scalar rate = Scalar(0);          ///< per s
  Scalar acceleration = Scalar(0);  ///< per s^2
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
