// The one place that looks at the compiler and the platform.
//
// auvest promises the same float bits on every target. That holds only where the compiler keeps
// IEEE 754 semantics, so a build that gives them up is refused here, at compile time.
#pragma once

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0)
#error \
    "auvest: -ffast-math (also part of -Ofast) and its parts reorder and approximate float arithmetic. \
Compile without it; add -ffp-contract=off."
#endif

#include <cfloat>

#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0
#error \
    "auvest: this target evaluates float in a wider type (FLT_EVAL_METHOD is not 0), as the x87 unit \
does. Compile with -msse2 -mfpmath=sse."
#endif

static_assert(sizeof(float) == 4 && FLT_RADIX == 2 && FLT_MANT_DIG == 24,
              "auvest needs IEEE 754 binary32 as float");

// A fixed trip count, written out by the compiler. It changes speed, never the order of operations.
// (clang unrolls such loops by itself; gcc without optimisation would warn that it does not.)
#if defined(__GNUC__) && __GNUC__ >= 8 && !defined(__clang__) && !defined(__AVR__) && \
    defined(__OPTIMIZE__)
#define AUVEST_UNROLL _Pragma("GCC unroll 16")
#else
#define AUVEST_UNROLL
#endif

// Small kernels that must disappear into their caller.
#if defined(__GNUC__) && !defined(__AVR__)
#define AUVEST_INLINE inline __attribute__((always_inline))
#else
#define AUVEST_INLINE inline
#endif
