// A recovery policy chosen at run time, for Python: a rejection streak, or none.
#pragma once

#include "auvest/robust/rejection_streak.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct AnyRecovery {
  using Scalar = Scalar_;

  bool enabled = false;
  RejectionStreak<Scalar> streak;

  void restart() { streak.restart(); }
  void forget() { streak.forget(); }

  template <int M, int O, int N>
  bool after(const RobustCorrection<Scalar, M>& correction, const Matrix<Scalar, M, O>& a,
             const Matrix<Scalar, O, O>& root, Belief<Scalar, N>& belief) {
    return enabled && streak.after(correction, a, root, belief);
  }

  bool exhausted() const { return enabled && streak.exhausted(); }

  Status check() const { return streak.check(); }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
