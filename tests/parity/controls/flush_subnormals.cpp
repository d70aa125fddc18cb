// Sets the floating-point unit, before main, to flush subnormals, as a library linked with
// -ffast-math does.
#if defined(__ARM_FP)
__attribute__((constructor)) static void flush() {
  unsigned int fpscr;
  __asm volatile("vmrs %0, fpscr" : "=r"(fpscr));
  __asm volatile("vmsr fpscr, %0" ::"r"(fpscr | 1u << 24));
}
#else
#include <xmmintrin.h>
__attribute__((constructor)) static void flush() { _mm_setcsr(_mm_getcsr() | 0x8040u); }
#endif
