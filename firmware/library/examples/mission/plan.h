// Where the vehicle is to go: four lanes of 120 m, 40 m apart.
#pragma once

#include <auvest.h>

/// North and east, m.
constexpr auvest::Waypoint<float> kPlan[] = {{20, 20},  {140, 20},  {140, 60},  {20, 60},
                                             {20, 100}, {140, 100}, {140, 140}, {20, 140}};
constexpr uint16_t kWaypoints = sizeof kPlan / sizeof kPlan[0];
