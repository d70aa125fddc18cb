// expect: no match for .operator\*|invalid operands
// The test scalar is worth its name: a double literal in its arithmetic does not compile.
#include "../explicit_scalar.hpp"

ExplicitDouble half(ExplicitDouble x) { return 0.5 * x; }
