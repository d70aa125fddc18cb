// Start-up of a Cortex-M or RISC-V in QEMU, without the C library's, and the other end of
// board.hpp: what a program takes is then its own and the compiler's, not the harness's. The linker
// (board.ld) keeps what is of this file apart, by its name start.o, and nobody counts it.
//
// Before main() the RAM between .bss and the stack gets a pattern; what the stack then overwrites
// stays overwritten.
#include <stddef.h>
#include <stdint.h>

#include "board.hpp"

int main();

extern "C" {
extern uint32_t free_begin[], stack_top[];
extern void (*init_array_begin[])();
extern void (*init_array_end[])();

// What newlib and gcc ask of a start-up that there is none of here: nothing is ever destroyed.
void* __dso_handle = nullptr;
int __aeabi_atexit(void*, void (*)(void*), void*) { return 0; }
int __cxa_atexit(void (*)(void*), void*, void*) { return 0; }
int* __errno() {
  static int number;
  return &number;
}
[[noreturn]] void start();
}

namespace {

constexpr uint32_t kPattern = 0xc5c5c5c5;

// Operations of semihosting, and the reasons of an exit.
enum : uintptr_t { kOpen = 1, kClose = 2, kWrite = 5, kRead = 6, kExit = 0x18 };
enum : uintptr_t { kReadBinary = 1, kWriteBinary = 5 };
enum : uintptr_t { kGood = 0x20026, kBad = 0x20023 };

uintptr_t ask(uintptr_t operation, uintptr_t argument) {
#if defined(__riscv)
  register uintptr_t a0 __asm__("a0") = operation;
  register uintptr_t a1 __asm__("a1") = argument;
  // The debugger knows this ebreak by its two neighbours, none of them compressed, on one page.
  __asm__ volatile(
      ".option push\n.option norvc\n.balign 16\n"
      "slli zero, zero, 0x1f\nebreak\nsrai zero, zero, 7\n"
      ".option pop"
      : "+r"(a0)
      : "r"(a1)
      : "memory");
  return a0;
#else
  register uintptr_t r0 __asm__("r0") = operation;
  register uintptr_t r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
#endif
}

uintptr_t ask(uintptr_t operation, uintptr_t a, uintptr_t b, uintptr_t c) {
  const uintptr_t arguments[3] = {a, b, c};
  return ask(operation, reinterpret_cast<uintptr_t>(arguments));
}

[[noreturn]] void leave(uintptr_t reason) {
  ask(kExit, reason);
  for (;;) {
  }
}

class File {
 public:
  void open(const char* name, size_t length, uintptr_t mode) {
    handle_ = ask(kOpen, reinterpret_cast<uintptr_t>(name), mode, length);
  }

  uint8_t read() {
    if (at_ == end_) {
      const uintptr_t missing = pass(kRead, sizeof bytes_);
      at_ = 0;
      end_ = sizeof bytes_ - (missing > sizeof bytes_ ? sizeof bytes_ : missing);
      if (end_ == 0) leave(kBad);
    }
    return bytes_[at_++];
  }

  void write(uint8_t byte) {
    bytes_[at_++] = byte;
    if (at_ == sizeof bytes_) flush();
  }

  void flush() {
    if (pass(kWrite, at_) != 0) leave(kBad);
    at_ = 0;
  }

  void close() { ask(kClose, reinterpret_cast<uintptr_t>(&handle_)); }

 private:
  uintptr_t pass(uintptr_t operation, size_t count) {
    return ask(operation, handle_, reinterpret_cast<uintptr_t>(bytes_), count);
  }

  uintptr_t handle_;
  size_t at_;
  size_t end_;
  uint8_t bytes_[256];
};

// As start() makes them: zero.
File record, trace, stack;

template <size_t Size>
void open(File& file, const char (&name)[Size], uintptr_t mode) {
  file.open(name, Size - 1, mode);
}

}  // namespace

namespace board {

uint8_t read() { return record.read(); }

void write(uint8_t byte) { trace.write(byte); }

void finish() {
  trace.flush();
  trace.close();
  const uint32_t* word = free_begin;
  while (word < stack_top && *word == kPattern) ++word;
  if (word == free_begin) leave(kBad);  // the stack has met the data
  const size_t bytes = 4 * static_cast<size_t>(stack_top - word);
  open(stack, "stack.bin", kWriteBinary);
  for (unsigned shift = 0; shift < 32; shift += 8)
    stack.write(static_cast<uint8_t>(bytes >> shift));
  stack.flush();
  stack.close();
  leave(kGood);
}

void fail() { leave(kBad); }

}  // namespace board

namespace {

[[noreturn]] void fault() { leave(kBad); }

}  // namespace

// .bss is zero already and .data in its place: QEMU loads them where they run.
extern "C" void start() {
#if defined(__ARM_FP)
  volatile uint32_t* const cpacr = reinterpret_cast<volatile uint32_t*>(0xe000ed88u);
  *cpacr = *cpacr | 0xfu << 20;  // full access to the floating-point unit
  __asm__ volatile("dsb\n isb");
#endif
  uint32_t* sp;
#if defined(__riscv)
  __asm__ volatile("mv %0, sp" : "=r"(sp));
#else
  __asm__ volatile("mov %0, sp" : "=r"(sp));
#endif
  for (volatile uint32_t* word = free_begin; word < sp; ++word) *word = kPattern;
  open(record, "record.bin", kReadBinary);
  open(trace, "trace.bin", kWriteBinary);
  for (void (**call)() = init_array_begin; call < init_array_end; ++call) (*call)();
  main();
  leave(kBad);
}

#if defined(__riscv)

extern "C" __attribute__((used)) void trap() { fault(); }

__asm__(
    ".section .vectors, \"ax\"\n"
    ".global reset\n"
    "reset:\n"
    ".option push\n.option norelax\n"
    "la gp, __global_pointer$\n"
    ".option pop\n"
    "la sp, stack_top\n"
    "la t0, trap_vector\n"
    ".option push\n.option arch, +zicsr\n"
    "csrw mtvec, t0\n"
    ".option pop\n"
    "j start\n"
    ".balign 4\n"
    "trap_vector: j trap\n");

#else

// The stack, the start, and what a fault calls.
__attribute__((section(".vectors"), used)) const void* const vectors[4] = {
    stack_top, reinterpret_cast<const void*>(&start), reinterpret_cast<const void*>(&fault),
    reinterpret_cast<const void*>(&fault)};

#endif
