// Every process and every sensor that a filter of the family can have, once. What lists them reads
// this: the Python module, the records of the parity tests, the table of `auvest filters`.
//
// AUVEST_PROCESSES(X): X(name, type over `Scalar`), one line per set of states.
// AUVEST_SENSORS(X):   X(name, which numbers of states N it suits, type over `Scalar` and N).
// A sensor suits a process whose state begins with what it observes; the names of the states say so
// (python/auvest/models).
#pragma once

#include "auvest/models/body_velocity.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/depth.hpp"
#include "auvest/models/heading_speed.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/odometry.hpp"
#include "auvest/models/odometry_constants.hpp"
#include "auvest/models/planar_hull.hpp"
#include "auvest/models/position.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/range_bearing_elevation.hpp"
#include "auvest/models/scaled_range.hpp"
#include "auvest/models/speed_heading.hpp"
#include "auvest/models/speed_heading_current.hpp"
#include "auvest/models/white_acceleration.hpp"

#define AUVEST_PROCESSES(X)                                    \
  X("EulerAcceleration", EulerAcceleration<Scalar>)            \
  X("ExactAcceleration", ExactAcceleration<Scalar>)            \
  X("SpeedHeading", SpeedHeading<Scalar>)                      \
  X("SpeedHeadingBias", SpeedHeading<Scalar, true>)            \
  X("SpeedHeadingScale", SpeedHeading<Scalar, false, true>)    \
  X("SpeedHeadingBiasScale", SpeedHeading<Scalar, true, true>) \
  X("SpeedHeadingCurrent", SpeedHeadingCurrent<Scalar>)        \
  X("Odometry", Odometry<Scalar>)                              \
  X("OdometryConstants", OdometryConstants<Scalar>)            \
  X("WhiteAcceleration2", WhiteAcceleration<Scalar, 2>)        \
  X("WhiteAcceleration3", WhiteAcceleration<Scalar, 3>)        \
  X("PlanarHull", PlanarHull<Scalar>)

#define AUVEST_SENSORS(X)                                              \
  X("RangeBearing", N >= 2, RangeBearing<Scalar, N>)                   \
  X("LeaderRange", N >= 2, LeaderRange<Scalar, N>)                     \
  X("Position2", N >= 2, Position<Scalar, N, 2>)                       \
  X("Position3", N == 6, Position<Scalar, N, 3>)                       \
  X("Depth", N == 6, Depth<Scalar, N>)                                 \
  X("BodyVelocity2", N == 4 || N == 6, BodyVelocity<Scalar, N, 2>)     \
  X("BodyVelocity3", N == 6, BodyVelocity<Scalar, N, 3>)               \
  X("RangeBearingElevation", N == 6, RangeBearingElevation<Scalar, N>) \
  X("HeadingSpeed", N == 8, HeadingSpeed<Scalar, N>)                   \
  X("ScaledRange", N == 8, ScaledRange<Scalar, N>)
