// auvest: estimators for small autonomous underwater vehicles. Everything, in one include, named as
// Arduino expects it.
#pragma once

#define AUVEST_ARDUINO_LIBRARY  // the assembler sources beside this file take part
#include "auvest/auvest.hpp"
