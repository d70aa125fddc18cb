// The robust measurement update: iteratively reweighted least squares, Eqs. (9)-(19) of the
// M-estimation EKF paper (Li, Du, Fan, Chen, Mao, Luo 2020), on the shared square-root form.
//
// The paper stacks prior and measurement and minimises the sum of rho over their residuals,
//
//     [x^; z] = [I; H] x + [delta; e],   x = (H~' Q H~)^-1 H~' Q Z~,   P = (H~' Q H~)^-1.
//
// In the coordinates of square_root_update.hpp the prior is y ~ N(0, I) and the measurement
// innovation = A y + e, e ~ N(0, E). Minimising with weights w is the plain update with the
// variances E_mm / w_m, so nothing is solved twice in two ways: each iteration is Potter's update
// from the same prior. A component of weight 0 is left out.
//
// Differs from Eqs. (9)-(19): the print does not whiten, here both blocks are (by L and by E), as
// the thresholds of Eq. (20) in multiples of sigma require. Only the measurement is weighted, the
// prior is not. The noise in Eq. (7) and the sign of J above Eq. (12) are misprinted.
//
// Off-diagonal elements of E are not divided by weights: an outlier is a component with extra
// noise of its own, which says nothing about the noise of the others.
#pragma once

#include <cstdint>

#include "auvest/robust/no_recovery.hpp"
#include "auvest/robust/robust_correction.hpp"

namespace auvest {

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
    std::uint8_t max_iterations = 10;  ///< solutions taken, >= 2; kInnovation needs no more than 2
    Scalar tolerance = Scalar(1e-3);   ///< >= 0: stop where no weight changes by more than this
  };

  Kernel kernel;
  Recovery recovery;
  Params params;

  explicit RobustUpdate(const Kernel& k = Kernel(), const Recovery& r = Recovery(),
                        const Params& p = Params())
      : kernel(k), recovery(r), params(p) {}

  /// A rule of GaussianFilter; arguments and statuses as those of SquareRootUpdate.
  template <int M, int O, int U, int N>
  AUVEST_INLINE Status operator()(Belief<Scalar, N>& belief, const Matrix<Scalar, O, O>& root,
                                  const Matrix<Scalar, U, O>& slope, Matrix<Scalar, M, O>& a,
                                  Matrix<Scalar, M, M>& noise,
                                  RobustCorrection<Scalar, M>& correction) {
    innovation_covariance(a, noise, correction.S);
    for (int m = 0; m < M; ++m) correction.weight(m) = Scalar(1);

    Posterior<Scalar, O> posterior;
    do {
      const Status status = solve(a, noise, correction, posterior);
      if (status != Status::kOk) return status;
      ++correction.iterations;
    } while (correction.iterations < params.max_iterations &&
             reweight(a, noise, posterior.y, correction) &&
             correction.decision != Decision::kRejected);
    if (correction.decision != Decision::kRejected) {
      Matrix<Scalar, O, O> moved;  // the recovery policy needs the prior's root
      math::copy(root, moved);
      if (!move_belief(belief, moved, slope, posterior)) return Status::kOverflow;
    }
    correction.recovered = recovery.after(correction, a, root, belief);
    return Status::kOk;
  }

  Status check() const {
    if (kernel.check() != Status::kOk) return kernel.check();
    if (recovery.check() != Status::kOk) return recovery.check();
    const bool valid = params.max_iterations >= 2 && math::is_nonnegative(params.tolerance);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  /// The posterior of the coordinates with the weights of `correction`. The NIS is that of the
  /// first solution, where all weights are 1.
  template <int M, int O>
  static Status solve(const Matrix<Scalar, M, O>& a, const Matrix<Scalar, M, M>& noise,
                      RobustCorrection<Scalar, M>& correction, Posterior<Scalar, O>& posterior) {
    Matrix<Scalar, M, O> rows;
    Matrix<Scalar, M, M> e;
    math::copy(a, rows);
    math::copy(noise, e);
    Vector<Scalar, M> innovation;
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
    if (!math::ldlt(e)) return Status::kNotPositiveDefinite;
    if (!potter(rows, e, innovation, posterior)) return Status::kOverflow;
    if (correction.iterations == 0) correction.nis = posterior.nis;
    return Status::kOk;
  }

  /// New weights from the residuals of the solution y, if they differ from the old ones. True if
  /// they do.
  template <int M, int O>
  bool reweight(const Matrix<Scalar, M, O>& a, const Matrix<Scalar, M, M>& noise,
                const Vector<Scalar, O>& y, RobustCorrection<Scalar, M>& correction) const {
    using math::sqrt;
    const bool post_fit = params.residual == Residual::kPostFit;
    Vector<Scalar, M> weight;
    bool changed = false;
    for (int m = 0; m < M; ++m) {
      Scalar residual = correction.innovation(m);
      if (post_fit) residual = math::minus_dot(residual, &a(m, 0), y.data(), O);
      const Scalar sigma = sqrt(post_fit ? noise(m, m) : correction.S(m, m));
      correction.standardised(m) = residual / sigma;
      weight(m) = kernel.weight(correction.standardised(m));
      const Scalar change = weight(m) - correction.weight(m);
      changed = changed || change > params.tolerance || -change > params.tolerance;
    }
    if (!changed) return false;
    math::copy(weight, correction.weight);
    bool all_full = true;
    bool all_zero = true;
    for (int m = 0; m < M; ++m) {
      all_full = all_full && !(weight(m) < Scalar(1));
      all_zero = all_zero && !(weight(m) > Scalar(0));
    }
    correction.decision = all_full   ? Decision::kAccepted
                          : all_zero ? Decision::kRejected
                                     : Decision::kDownweighted;
    return true;
  }
};

}  // namespace auvest
