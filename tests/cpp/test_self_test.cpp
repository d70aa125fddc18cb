// The self-test passes here, and says what is wrong where something is. (Other builds and targets:
// tests/parity.)

#include "auvest/self_test.hpp"

#include <doctest/doctest.h>

#include <cfenv>
#include <cstring>
#include <initializer_list>
#include <vector>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

using auvest::self_test;
using auvest::SelfTestPart;
using auvest::SelfTestResult;

TEST_CASE("self-test: passes in this build") {
  const SelfTestResult result = self_test();
  CHECK(result.ok());
  CHECK(result.failed == SelfTestPart::kNone);
  CHECK(result.index == 0);
}

TEST_CASE("self-test: a rounding mode that is not to nearest is found") {
  for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    REQUIRE(std::fesetround(mode) == 0);
    const SelfTestResult result = self_test();
    std::fesetround(FE_TONEAREST);
    CHECK(result.failed == SelfTestPart::kRounding);
    CHECK_FALSE(result.ok());
  }
  CHECK(self_test().ok());
}

#if defined(__SSE2__)
TEST_CASE("self-test: flushed subnormal results and operands are found") {
  const unsigned before = _mm_getcsr();
  const unsigned kFlushResults = 0x8000u;
  const unsigned kFlushOperands = 0x0040u;
  for (const unsigned flag : {kFlushResults, kFlushOperands}) {
    _mm_setcsr(before | flag);
    const SelfTestResult result = self_test();
    _mm_setcsr(before);
    CHECK(result.failed == SelfTestPart::kSubnormals);
  }
  CHECK(self_test().ok());
}
#endif

TEST_CASE("self-test: every golden value is compared, and the first that differs is named") {
  // What the trace reports, in its order.
  struct Report {
    SelfTestPart part;
    std::uint8_t step;
    std::uint32_t hash;
  };
  std::vector<Report> reports;
  auvest::detail::golden_trace([&](SelfTestPart part, std::uint8_t step, std::uint32_t hash) {
    reports.push_back(Report{part, step, hash});
    return part != SelfTestPart::kInterval || step + 1 < auvest::detail::kGoldenSteps;
  });
  REQUIRE(reports.size() == auvest::detail::kGoldenSteps * auvest::detail::kGoldenParts);
  for (const Report& wrong : reports) {
    auvest::detail::GoldenCheck check = {SelfTestResult{SelfTestPart::kNone, 0}};
    CHECK_FALSE(check(wrong.part, wrong.step, wrong.hash ^ 1u));
    CHECK(check.result.failed == wrong.part);
    CHECK(check.result.index == wrong.step);
  }
}

TEST_CASE("self-test: a single bit changes the hash") {
  for (int bit = 0; bit < 32; ++bit) {
    auvest::detail::BitHash a;
    auvest::detail::BitHash b;
    a.add(0x3f800000u);
    b.add(0x3f800000u ^ (1u << bit));
    CHECK(a.value() != b.value());
    a.add(1.5f);
    b.add(1.5f);
    CHECK(a.value() != b.value());
  }
}

TEST_CASE("self-test: every part has its own line") {
  std::vector<const char*> lines;
  for (int i = 0; i <= static_cast<int>(SelfTestPart::kInterval); ++i) {
    const char* line = auvest::describe(static_cast<SelfTestPart>(i));
    CHECK(std::strcmp(line, "unknown part") != 0);
    for (const char* other : lines) CHECK(std::strcmp(line, other) != 0);
    lines.push_back(line);
  }
  CHECK(std::strcmp(auvest::describe(static_cast<SelfTestPart>(99)), "unknown part") == 0);
}
