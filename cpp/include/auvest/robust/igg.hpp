// The three-segment kernel IGG (Zhou 1989), [MEKF 20] of the M-estimation EKF paper (Li, Du, Fan,
// Chen, Mao, Luo 2020):
//
//     weight(t) = 1         |t| < k0
//                 k0 / |t|  |t| < k1
//                 0         else
//
// Differs from [MEKF 20]: the printed rho is t^2/2, c |t| and a constant d with c and d not given.
// c = k0 makes psi continuous at k0 and gives the weights above; the constants below make rho
// continuous, which no weight depends on. (The remark after [MEKF 20], l1 for t -> 0 and l2 for
// t -> infinity, is the wrong way round.)
#pragma once

#include "auvest/robust/kernel.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct Igg : Kernel<Igg<Scalar_>, Scalar_> {
  using Scalar = Scalar_;

  struct Params {
    Scalar k0 = Scalar(1.5);  ///< [sigma], > 0: full weight below; as in [MEKF 20]
    Scalar k1 = Scalar(3);    ///< [sigma], >= k0: rejected from here on; as in [MEKF 20], often 2.5

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("k0", k0);
      v("k1", k1);
    }
  };

  Params params;

  explicit Igg(const Params& p = Params()) : params(p) {}

  Scalar weight(Scalar t) const {
    const Scalar size = this->magnitude(t);
    // [MEKF 20]
    if (size < params.k0) return Scalar(1);
    return size < params.k1 ? params.k0 / size : Scalar(0);
  }

  Scalar rho(Scalar t) const {
    const Scalar size = this->magnitude(t);
    // [MEKF 20]
    if (size < params.k0) return Scalar(0.5) * size * size;
    return params.k0 * ((size < params.k1 ? size : params.k1) - Scalar(0.5) * params.k0);
  }

  Status check() const {
    const bool valid = this->is_threshold(params.k0) && this->is_threshold(params.k1, params.k0);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
