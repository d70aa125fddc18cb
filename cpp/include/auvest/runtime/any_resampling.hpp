// A resampling policy chosen at run time, for Python.
#pragma once

#include <cstdint>

#include "auvest/particles/resampling.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

struct AnyResampling {
  enum class Kind : std::uint8_t { kSystematic, kStratified, kResidual, kMultinomial };

  Kind kind = Kind::kSystematic;

  template <class Scalar>
  void count(Scalar* w, int n, math::Random& random) const {
    switch (kind) {
      case Kind::kStratified:
        return StratifiedResampling::count(w, n, random);
      case Kind::kResidual:
        return ResidualResampling::count(w, n, random);
      case Kind::kMultinomial:
        return MultinomialResampling::count(w, n, random);
      case Kind::kSystematic:
        break;
    }
    SystematicResampling::count(w, n, random);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
