// Sets the rounding mode, before main, to upward.
#include <cfenv>

__attribute__((constructor)) static void upward() { std::fesetround(FE_UPWARD); }
