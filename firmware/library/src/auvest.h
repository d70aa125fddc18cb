// auvest: estimators for small autonomous underwater vehicles. Everything, in one include, named as
// Arduino expects it.
#pragma once

#include "auvest/auvest.hpp"
