// Hampel's kernel (Andrews et al. 1972): as Huber's up to b sigma, then the influence falls in a
// straight line and ends at c sigma.
//
//     psi(t) = t                              |t| < a
//              a sgn t                        |t| < b
//              a (c - |t|) / (c - b) sgn t    |t| < c
//              0                              else
#pragma once

#include "auvest/robust/kernel.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct Hampel : Kernel<Hampel<Scalar_>, Scalar_> {
  using Scalar = Scalar_;

  struct Params {
    Scalar a = Scalar(1.7);  ///< [sigma], > 0: full weight below
    Scalar b = Scalar(3.4);  ///< [sigma], >= a: the influence falls above
    Scalar c = Scalar(8.5);  ///< [sigma], >= b: rejected from here on

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("a", a);
      v("b", b);
      v("c", c);
    }
  };

  Params params;

  explicit Hampel(const Params& p = Params()) : params(p) {}

  Scalar weight(Scalar t) const {
    const Scalar size = this->magnitude(t);
    if (size < params.a) return Scalar(1);
    if (size < params.b) return params.a / size;
    return size < params.c ? params.a * slope(size) / size : Scalar(0);
  }

  Scalar rho(Scalar t) const {
    const Scalar half = Scalar(0.5);
    const Scalar size = this->magnitude(t);
    if (size < params.a) return half * size * size;
    if (size < params.b) return params.a * (size - half * params.a);
    const Scalar left = size < params.c ? slope(size) : Scalar(0);
    return params.a *
           (params.b - half * params.a + half * (params.c - params.b) * (Scalar(1) - left * left));
  }

  Status check() const {
    const bool valid = this->is_threshold(params.a) && this->is_threshold(params.b, params.a) &&
                       this->is_threshold(params.c, params.b) &&
                       (math::is_finite(params.c) || !math::is_finite(params.b));
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  /// From 1 at b to 0 at c.
  Scalar slope(Scalar size) const { return (params.c - size) / (params.c - params.b); }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
