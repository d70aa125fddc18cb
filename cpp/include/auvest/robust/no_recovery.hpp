// The recovery policy that does nothing: a filter whose kernel rejects can lock out with it.
//
// A recovery policy is a plain struct that offers
//
//     void   restart()                          forget the past
//     void   forget()                           forget what was rejected: the belief has been
//                                               replaced
//     bool   after(correction, a, root, belief) told of every update; may widen the belief, and
//                                               says whether it did. H = A L^-1 (A: `a`, L: `root`)
//     bool   exhausted() const                  true while it would widen but has done so too often
//     Status check() const                      kOk, or kBadParameter if a parameter is out of
//     range
#pragma once

#include "auvest/robust/robust_correction.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct NoRecovery {
  using Scalar = Scalar_;
  struct Params {};

  explicit NoRecovery(const Params& = Params()) {}

  void restart() {}
  void forget() {}

  template <int M, int O, int N>
  bool after(const RobustCorrection<Scalar, M>&, const Matrix<Scalar, M, O>&,
             const Matrix<Scalar, O, O>&, Belief<Scalar, N>&) {
    return false;
  }

  bool exhausted() const { return false; }

  Status check() const { return Status::kOk; }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
