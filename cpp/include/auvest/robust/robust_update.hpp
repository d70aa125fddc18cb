// The robust measurement update: iteratively reweighted least squares, [MEKF 9] to [MEKF 19] of the
// M-estimation EKF paper (Li, Du, Fan, Chen, Mao, Luo 2020), on the shared square-root form.
//
// The paper stacks prior and measurement and minimises the sum of rho over their residuals,
//
//     [x^; z] = [I; H] x + [delta; e],   x = (H~' Q H~)^-1 H~' Q Z~,   P = (H~' Q H~)^-1.
//
// In the coordinates of square_root_update.hpp the prior is y ~ N(0, I) and the measurement
// innovation = A y + e, e ~ N(0, E). Minimising with weights w is the plain update with the
// variances E_mm / w_m, so nothing is solved twice in two ways: each iteration is Potter's update
// from the same prior. A component of weight 0 is left out. The weights of innovations do not
// depend on the solution, so that form takes one.
//
// Differs from [MEKF 9]: the print does not whiten, here both blocks are (by L and by E), as the
// thresholds of [MEKF 20] in multiples of sigma require. Differs from [MEKF 16]: only the
// measurement is weighted, the prior is not. The noise in [MEKF 7] and the sign of J above
// [MEKF 12] are misprinted.
//
// Off-diagonal elements of E are not divided by weights: an outlier is a component with extra
// noise of its own, which says nothing about the noise of the others.
#pragma once

#include <cstdint>

#include "auvest/robust/no_recovery.hpp"
#include "auvest/robust/robust_correction.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Which residual the kernel judges. The paper does not say.
enum class Residual : std::uint8_t {
  kInnovation,  ///< innovation / sqrt S_mm: asks less of a measurement where P is large
  kPostFit      ///< (innovation - A y) / sqrt E_mm: locks out more easily where P is large
};

template <class Kernel_, class Recovery_ = NoRecovery<typename Kernel_::Scalar>>
struct RobustUpdate {
  using Kernel = Kernel_;
  using Recovery = Recovery_;
  using Scalar = typename Kernel::Scalar;

  struct Params {
    Residual residual = Residual::kInnovation;
    std::uint8_t max_iterations = 10;  ///< of kPostFit, >= 2; kInnovation takes one
    Scalar tolerance = Scalar(1e-3);   ///< of kPostFit, >= 0: stop where no weight changes by more
  };

  Kernel kernel;
  Recovery recovery;
  Params params;

  explicit RobustUpdate(const Kernel& k = Kernel(), const Recovery& r = Recovery(),
                        const Params& p = Params())
      : kernel(k), recovery(r), params(p) {}

  /// A rule of GaussianFilter; arguments and statuses as those of SquareRootUpdate.
  template <int M, int O, int U, int N>
  AUVEST_INLINE Status operator()(Belief<Scalar, N>& belief, Matrix<Scalar, O, O>& root,
                                  const Matrix<Scalar, U, O>& slope, Matrix<Scalar, M, O>& a,
                                  Matrix<Scalar, M, M>& noise,
                                  RobustCorrection<Scalar, M>& correction) {
    innovation_covariance(a, noise, correction.S);
    Status status = Status::kOk;
    if (params.residual == Residual::kInnovation) {
      correction.iterations = 1;
      for (int m = 0; m < M; ++m)
        judge(m, correction.innovation(m), correction.S(m, m), correction);
    } else {
      status = settle(a, noise, correction);
    }
    decide(correction);
    if (status == Status::kOk && correction.decision == Decision::kAccepted) {
      status = correct_belief(belief, root, slope, a, noise, correction);
    } else if (status == Status::kOk) {
      status = correct_weighted(belief, root, slope, a, noise, correction);
    }
    // Without a weight of 0 the policy does not look at `a` and `root`, which are used up then.
    if (status == Status::kOk) correction.recovered = recovery.after(correction, a, root, belief);
    return status;
  }

  Status check() const {
    if (kernel.check() != Status::kOk) return kernel.check();
    if (recovery.check() != Status::kOk) return recovery.check();
    const bool valid = params.max_iterations >= 2 && math::is_nonnegative(params.tolerance);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  /// Weight of component m from its residual with this variance.
  template <int M>
  void judge(int m, Scalar residual, Scalar variance,
             RobustCorrection<Scalar, M>& correction) const {
    using math::sqrt;
    correction.standardised(m) = residual / sqrt(variance);
    correction.weight(m) = kernel.weight(correction.standardised(m));  // [MEKF 16]
  }

  template <int M>
  static void decide(RobustCorrection<Scalar, M>& correction) {
    bool all_full = true;
    bool all_zero = true;
    for (int m = 0; m < M; ++m) {
      all_full = all_full && !(correction.weight(m) < Scalar(1));
      all_zero = all_zero && !(correction.weight(m) > Scalar(0));
    }
    correction.decision = all_full   ? Decision::kAccepted
                          : all_zero ? Decision::kRejected
                                     : Decision::kDownweighted;
  }

  /// The weights of post-fit residuals: solved and judged in turn until they stay.
  template <int M, int O>
  Status settle(const Matrix<Scalar, M, O>& a, const Matrix<Scalar, M, M>& noise,
                RobustCorrection<Scalar, M>& correction) const {
    for (int m = 0; m < M; ++m) correction.weight(m) = Scalar(1);
    correction.iterations = 0;
    bool settled = false;
    while (!settled) {
      Matrix<Scalar, M, O> rows;
      Matrix<Scalar, M, M> e;
      Vector<Scalar, M> innovation;
      weigh(a, noise, correction, rows, e, innovation);
      if (!math::ldlt(e)) return Status::kNotPositiveDefinite;
      Posterior<Scalar, O> posterior;
      if (!potter(rows, e, innovation, posterior)) return Status::kOverflow;  // [MEKF 18]
      ++correction.iterations;
      if (correction.iterations >= params.max_iterations) break;
      const Vector<Scalar, M> before = correction.weight;
      settled = true;
      bool all_zero = true;
      for (int m = 0; m < M; ++m) {
        // [MEKF 11]
        judge(m, math::minus_dot(correction.innovation(m), &a(m, 0), posterior.y.data(), O),
              noise(m, m), correction);
        const Scalar change = correction.weight(m) - before(m);
        settled = settled && !(change > params.tolerance || -change > params.tolerance);
        all_zero = all_zero && !(correction.weight(m) > Scalar(0));
      }
      if (settled) math::copy(before, correction.weight);
      settled = settled || all_zero;
    }
    return Status::kOk;
  }

  /// The update with the weights as they are, if one is not 1. The NIS is that of the plain update.
  template <int M, int O, int U, int N>
  AUVEST_OUTLINE AUVEST_INLINE static Status correct_weighted(
      Belief<Scalar, N>& belief, const Matrix<Scalar, O, O>& root,
      const Matrix<Scalar, U, O>& slope, const Matrix<Scalar, M, O>& a,
      const Matrix<Scalar, M, M>& noise, RobustCorrection<Scalar, M>& correction) {
    Matrix<Scalar, M, M> s;
    math::copy(noise, s);
    if (!math::ldlt(s)) return Status::kNotPositiveDefinite;
    math::copy(correction.S, s);
    if (!math::ldlt(s)) return Status::kNotPositiveDefinite;
    Vector<Scalar, M> residual;  // the innovation decorrelated
    Scalar nis = Scalar(0);
    for (int m = 0; m < M; ++m) {
      residual(m) = math::minus_dot(correction.innovation(m), &s(m, 0), residual.data(), m);
      nis = nis + residual(m) / s(m, m) * residual(m);
    }
    if (!math::is_finite(nis)) return Status::kOverflow;
    correction.nis = nis;
    if (correction.decision == Decision::kRejected) return Status::kOk;
    Matrix<Scalar, M, O> rows;
    Matrix<Scalar, M, M> e;
    Correction<Scalar, M> weighted(Status::kOk);
    weigh(a, noise, correction, rows, e, weighted.innovation);
    innovation_covariance(rows, e, weighted.S);
    Matrix<Scalar, O, O> moved;
    math::copy(root, moved);
    return correct_belief(belief, moved, slope, rows, e, weighted);  // [MEKF 18] [MEKF 19]
  }

  /// The same for one number: the NIS is known, and S grows as E does. Uses up all but `slope`.
  template <int O, int U, int N>
  AUVEST_INLINE Status correct_weighted(Belief<Scalar, N>& belief, Matrix<Scalar, O, O>& root,
                                        const Matrix<Scalar, U, O>& slope, Matrix<Scalar, 1, O>& a,
                                        Matrix<Scalar, 1, 1>& noise,
                                        RobustCorrection<Scalar, 1>& correction) const {
    if (!(noise(0, 0) > Scalar(0))) return Status::kNotPositiveDefinite;
    const Scalar s = correction.S(0, 0);
    const Scalar nis = params.residual == Residual::kInnovation
                           ? correction.standardised(0) * correction.standardised(0)
                           : correction.innovation(0) / s * correction.innovation(0);
    if (!math::is_finite(nis)) return Status::kOverflow;
    Status status = Status::kOk;
    if (correction.decision != Decision::kRejected) {
      const Scalar weighted = noise(0, 0) / correction.weight(0);
      correction.S(0, 0) = s + (weighted - noise(0, 0));
      noise(0, 0) = weighted;
      status = correct_belief(belief, root, slope, a, noise, correction);  // [MEKF 18] [MEKF 19]
      correction.S(0, 0) = s;
    }
    correction.nis = nis;
    return status;
  }

  /// A, E and the innovation with the weights as they are.
  template <int M, int O>
  static void weigh(const Matrix<Scalar, M, O>& a, const Matrix<Scalar, M, M>& noise,
                    const RobustCorrection<Scalar, M>& correction, Matrix<Scalar, M, O>& rows,
                    Matrix<Scalar, M, M>& e, Vector<Scalar, M>& innovation) {
    math::copy(a, rows);
    math::copy(noise, e);
    for (int m = 0; m < M; ++m) {
      const Scalar weight = correction.weight(m);
      if (weight > Scalar(0)) {
        innovation(m) = correction.innovation(m);
        if (weight < Scalar(1)) e(m, m) = e(m, m) / weight;
      } else {  // a measurement of nothing
        for (int k = 0; k < O; ++k) rows(m, k) = Scalar(0);
        for (int l = 0; l < m; ++l) e(m, l) = Scalar(0);
        for (int l = m + 1; l < M; ++l) e(l, m) = Scalar(0);
        e(m, m) = Scalar(1);
        innovation(m) = Scalar(0);
      }
    }
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
