// Eigen's core: the one place that includes it, so that it compiles wherever auvest does.
//
// On a host this is <Eigen/Core> as the user has configured it. Arduino and avr-gcc need help, and
// all of it is taken back at the end of this file, except the options of Eigen itself.
#pragma once

// Eigen's warnings are not the user's. (On AVR, -isystem would make its templates extern "C".)
#pragma GCC system_header

#include "auvest/config.hpp"

// Macros of <Arduino.h> and <stdlib.h> with names that Eigen gives to functions and arguments.
#pragma push_macro("abs")
#pragma push_macro("B1")
#pragma push_macro("F")
#pragma push_macro("max")
#pragma push_macro("min")
#pragma push_macro("round")

// The Arduino library leaves out Eigen's vector code: no board has a use for it.
#if defined(ARDUINO) && !defined(EIGEN_DONT_VECTORIZE)
#define EIGEN_DONT_VECTORIZE
#endif

#if defined(__AVR__)
#include <stdint.h>
#include <stdlib.h>

#include <new>

#ifndef EIGEN_NO_IO
#define EIGEN_NO_IO
#endif
// No assertions: at run time they cost flash; at compile time some overflow an int of 16 bits (the
// host builds have them all).
#ifndef EIGEN_NO_DEBUG
#define EIGEN_NO_DEBUG
#endif
#ifndef EIGEN_NO_STATIC_ASSERT
#define EIGEN_NO_STATIC_ASSERT
#endif
// Eigen in C++03, which asks less of the standard library.
#ifndef EIGEN_MAX_CPP_VER
#define EIGEN_MAX_CPP_VER 3
#endif

// avr-libc's uint16_t is unsigned int, where Eigen's bfloat16 counts on unsigned short.
typedef unsigned short auvest_uint16_for_eigen;
#define uint16_t auvest_uint16_for_eigen
#endif

#undef abs
#undef B1
#undef F
#undef max
#undef min
#undef round

#include <Eigen/Core>  // not found: Debian has it in libeigen3-dev, add -I/usr/include/eigen3

#if defined(__AVR__)
#undef uint16_t
#endif

#pragma pop_macro("abs")
#pragma pop_macro("B1")
#pragma pop_macro("F")
#pragma pop_macro("max")
#pragma pop_macro("min")
#pragma pop_macro("round")

#if !EIGEN_VERSION_AT_LEAST(3, 4, 0)
#error "auvest: this Eigen is too old; use 3.4 or later."
#endif
