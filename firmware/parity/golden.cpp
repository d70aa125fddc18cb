// Prints the hashes that auvest::self_test() must find, in its order: one of the functions, then a
// line per step of the golden trace.
#include <cstdio>

#include "auvest/self_test.hpp"

int main() {
  using namespace auvest;
  std::printf("%08lx\n", static_cast<unsigned long>(detail::hash_of_math()));
  detail::golden_trace([](SelfTestPart part, std::uint8_t step, std::uint32_t hash) {
    const bool last = part == SelfTestPart::kInterval;
    std::printf("%08lx%c", static_cast<unsigned long>(hash), last ? '\n' : ' ');
    return !last || step + 1 < detail::kGoldenSteps;
  });
  return 0;
}
