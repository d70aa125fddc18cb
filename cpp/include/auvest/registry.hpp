// Every process and every sensor that a filter of the family can have, once. What lists them reads
// this: the Python module, the records of the parity tests, the table of `auvest filters`.
//
// AUVEST_PROCESSES(X): X(name, type over `Scalar`), one line per state.
// AUVEST_SENSORS(X):   X(name, template over <Scalar, states>, states of the processes it is for).
#pragma once

#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/odometry.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/speed_heading.hpp"

#define AUVEST_PROCESSES(X)                                    \
  X("EulerAcceleration", EulerAcceleration<Scalar>)            \
  X("ExactAcceleration", ExactAcceleration<Scalar>)            \
  X("SpeedHeading", SpeedHeading<Scalar>)                      \
  X("SpeedHeadingBias", SpeedHeading<Scalar, true>)            \
  X("SpeedHeadingScale", SpeedHeading<Scalar, false, true>)    \
  X("SpeedHeadingBiasScale", SpeedHeading<Scalar, true, true>) \
  X("Odometry", Odometry<Scalar>)

#define AUVEST_SENSORS(X)                 \
  X("RangeBearing", RangeBearing, N >= 2) \
  X("LeaderRange", LeaderRange, N >= 2)
