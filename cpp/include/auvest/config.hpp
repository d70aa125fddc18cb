// What auvest asks of the compiler, and the words that differ between compilers and chips.
//
// auvest promises the same float bits on every target. That holds only where the compiler keeps
// IEEE 754 semantics, so a build that gives them up is refused here, at compile time.
#pragma once

#if !defined(__GNUC__)
#error "auvest: compile with GCC or Clang."
#elif !defined(__clang__) && __GNUC__ < 5
#error "auvest: this GCC is too old; use GCC 5 or later (Arduino AVR Boards 1.6.22 or later)."
#endif

#if __cplusplus < 201103L
#error "auvest: compile as C++11 or later, for example with -std=gnu++11."
#endif

#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ > 0)
#error \
    "auvest: -ffast-math (also part of -Ofast) and its parts reorder and approximate float arithmetic. \
Compile without it; add -ffp-contract=off."
#endif

#if !__has_include(<cfloat>)
#error \
    "auvest: avr-gcc has no C++ standard headers. Use the Arduino library auvest, which has them, or \
add firmware/avr_std to the include path."
#endif
#include <cfloat>

#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0
#error \
    "auvest: this target evaluates float in a wider type (FLT_EVAL_METHOD is not 0), as the x87 unit \
does. Compile with -msse2 -mfpmath=sse."
#endif

static_assert(sizeof(float) == 4 && FLT_RADIX == 2 && FLT_MANT_DIG == 24,
              "auvest needs IEEE 754 binary32 as float");

// A fixed trip count, written out by the compiler. It changes speed, never the order of operations:
// where compiling takes longer than it is worth, a build may define it as nothing.
// (clang unrolls such loops by itself; gcc without optimisation would warn that it does not.)
#if !defined(AUVEST_UNROLL)
#if __GNUC__ >= 8 && !defined(__clang__) && !defined(__AVR__) && defined(__OPTIMIZE__)
#define AUVEST_UNROLL _Pragma("GCC unroll 16")
#else
#define AUVEST_UNROLL
#endif
#endif

// Small kernels that must disappear into their caller; where compiling that takes longer than it is
// worth, a build may define it as inline.
#if !defined(AUVEST_INLINE)
#if defined(__AVR__)
#define AUVEST_INLINE inline
#else
#define AUVEST_INLINE inline __attribute__((always_inline))
#endif
#endif

// What only hands things on, and takes more flash and stack called than inlined: on every target.
#define AUVEST_ALWAYS_INLINE inline __attribute__((always_inline))

// On the 8-bit chip a function that is called once is still called: inlined, its frame would lie on
// the stack for as long as its caller's. Nor is it copied to suit the arguments of one call.
#if defined(__AVR__)
#define AUVEST_OUTLINE __attribute__((noinline, noclone))
#else
#define AUVEST_OUTLINE
#endif

// The same for the functions with most of the arithmetic. They go to a section of their own, which
// lies behind the float routines while all else lies before them: a call over less than 4 KiB takes
// half of the flash.
#if defined(__AVR__)
#define AUVEST_OUTLINE_HOT __attribute__((noinline, noclone, hot))
#else
#define AUVEST_OUTLINE_HOT
#endif

// Tables of 32-bit words that an AVR leaves in flash: in RAM they would take room from the filters.
#if defined(__AVR__)
#include <avr/pgmspace.h>
#define AUVEST_IN_FLASH PROGMEM
#define AUVEST_FROM_FLASH(address) pgm_read_dword(address)
#else
#define AUVEST_IN_FLASH
#define AUVEST_FROM_FLASH(address) (*(address))
#endif

// The Arduino library brings some routines in assembler; without its sources they are C++.
#if defined(AUVEST_ARDUINO_LIBRARY) && defined(__AVR_HAVE_MUL__) && defined(__AVR_HAVE_JMP_CALL__)
#define AUVEST_AVR_KERNELS
#endif

// What is rarely run: called, so that it takes no registers from what is often run.
#define AUVEST_COLD __attribute__((cold, noinline))

// One program may hold code for several instruction sets, and choose at run time. Of an inline
// function that is compiled for two of them the linker keeps one, whichever it meets first; so all
// of auvest lies in an inline namespace of the set that its file is compiled for, and the two are
// two functions. Nobody needs to write the name. A build may define another, for flags not told
// apart here.
#if !defined(AUVEST_INSTRUCTIONS)
#if defined(__AVX512F__)
#define AUVEST_INSTRUCTIONS with_avx512
#elif defined(__AVX2__)
#define AUVEST_INSTRUCTIONS with_avx2
#elif defined(__AVX__)
#define AUVEST_INSTRUCTIONS with_avx
#elif defined(__SSE4_1__)
#define AUVEST_INSTRUCTIONS with_sse4
#else
#define AUVEST_INSTRUCTIONS baseline
#endif
#endif
