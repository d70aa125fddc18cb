// Start-up of a Cortex-M in QEMU: the two vectors that matter, then newlib's _start, which asks the
// debugger (semihosting) for the command line.
#include <cstdint>

extern "C" {
void _start();
extern std::uint32_t stack_top[];

void reset() {
#if defined(__ARM_FP)
  volatile std::uint32_t* const cpacr = reinterpret_cast<volatile std::uint32_t*>(0xe000ed88u);
  *cpacr |= 0xfu << 20;  // full access to the floating-point unit
  __asm volatile("dsb\n isb");
#endif
  _start();
}

// A fault shows as a locked-up processor: QEMU stops with a message.
__attribute__((section(".vectors"), used))
const void* const vectors[2] = {stack_top, reinterpret_cast<const void*>(&reset)};
}
