// Where a vehicle is beside its path: what a path tells and a guidance law reads.
//
// x is north, y is east, angles count from north to east, so that "to starboard" is positive.
#pragma once

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The point of a path beside a vehicle.
template <class Scalar>
struct PathPoint {
  Scalar direction_rad = Scalar(0);  ///< pi_h: the path's own direction there
  Scalar sine = Scalar(0);           ///< of pi_h
  Scalar cosine = Scalar(1);         ///< of pi_h
  Scalar along_m = Scalar(0);  ///< s: distance along the path from where it (or its leg) begins
  Scalar cross_m =
      Scalar(0);  ///< e: the vehicle's distance from the path, positive to starboard of it
  Scalar curvature =
      Scalar(0);  ///< kappa [1/m]: positive where the path turns clockwise, 0 on a line
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
