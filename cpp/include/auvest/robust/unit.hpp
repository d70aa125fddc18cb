// The kernel of least squares, rho = t^2 / 2: every residual counts fully. A filter with it is the
// filter without a kernel, bit for bit.
#pragma once

#include "auvest/robust/kernel.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct Unit : Kernel<Unit<Scalar_>, Scalar_> {
  using Scalar = Scalar_;
  struct Params {
    template <class Visitor>
    void visit(Visitor&&) {}
  };

  explicit Unit(const Params& = Params()) {}

  Scalar weight(Scalar) const { return Scalar(1); }
  Scalar rho(Scalar t) const { return Scalar(0.5) * t * t; }
  Status check() const { return Status::kOk; }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
