// expect: ffast-math
#define __FAST_MATH__ 1
#include "auvest/auvest.hpp"
