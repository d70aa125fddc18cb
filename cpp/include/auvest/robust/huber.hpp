// Huber's kernel (1964): squares up to k sigma, absolute values beyond. Nothing is ever rejected,
// so a filter with it cannot lock out; a gross error still pulls with k sigma.
//
//     psi(t) = t       |t| < k
//              k sgn t  else
#pragma once

#include "auvest/robust/kernel.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct Huber : Kernel<Huber<Scalar_>, Scalar_> {
  using Scalar = Scalar_;

  struct Params {
    Scalar k = Scalar(1.345);  ///< [sigma], > 0; 1.345 keeps 95 % efficiency on Gaussian noise

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("k", k);
    }
  };

  Params params;

  explicit Huber(const Params& p = Params()) : params(p) {}

  Scalar weight(Scalar t) const {
    const Scalar size = this->magnitude(t);
    return size < params.k ? Scalar(1) : params.k / size;
  }

  Scalar rho(Scalar t) const {
    const Scalar size = this->magnitude(t);
    return size < params.k ? Scalar(0.5) * size * size : params.k * (size - Scalar(0.5) * params.k);
  }

  Status check() const {
    return this->is_threshold(params.k) ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
