// The scaled sigma points and the constants of their transform in deviation form.
//
// c = n + lambda = alpha^2 (n + kappa). The textbook weights are 1/(2c) and lambda/c: for the
// paper's alpha = 1e-6 that is 1.7e11 and -2e12, which cancel to nothing in 32 bits. Written with
// deviations from the centre point the 1/c parts cancel on paper instead, [UKF D1] to [UKF D4]
// (docs/algorithms/ukf.md):
//
//     m    = sum_i (d_i+ + d_i-) / (2c)
//     mean = h(x) + m
//     P_yy = sum_i (s_i s_i' + t_i t_i') + (beta - alpha^2) m m'
//            with s_i = (d_i+ + d_i-) / (2 sqrt c),  t_i = (d_i+ - d_i-) / (2 sqrt c)
//     P_xy = sum_i L_i t_i'
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct SigmaPoints {
  struct Params {
    Scalar alpha = Scalar(1);   ///< spread of the points, 1e-8..1; Table 1: 1e-6
    Scalar beta = Scalar(2);    ///< prior knowledge, >= alpha^2; 2 is best for a Gaussian; Table 1
    Scalar kappa = Scalar(-3);  ///< secondary scaling, n + kappa > 0; Table 1, where n = 6

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("alpha", alpha);
      v("beta", beta);
      v("kappa", kappa);
    }
  };

  Scalar sqrt_c;       ///< sigma points lie at x +- sqrt_c L_i
  Scalar half_sqrt_c;  ///< 1 / (2 sqrt c): turns sums and differences into s_i and t_i
  Scalar mean_weight;  ///< 1 / sqrt c: m = mean_weight sum_i s_i
  Scalar centre_root;  ///< sqrt(beta - alpha^2), whose square is the weight of m m'
  Status status;       ///< kBadParameter if the parameters are out of range
  bool fine;           ///< c is so small that subtracted deviations would have lost their digits

  SigmaPoints(const Params& params, int n) {
    using math::is_finite;
    using math::sqrt;
    const Scalar scale = Scalar(n) + params.kappa;
    const Scalar c = params.alpha * params.alpha * scale;
    const bool valid = math::within(params.alpha, Scalar(1e-8), Scalar(1)) &&
                       params.beta >= params.alpha * params.alpha && is_finite(params.beta) &&
                       is_finite(params.kappa) && scale > Scalar(0);
    status = valid ? Status::kOk : Status::kBadParameter;
    sqrt_c = valid ? sqrt(c) : Scalar(1);
    half_sqrt_c = Scalar(0.5) / sqrt_c;
    mean_weight = Scalar(1) / sqrt_c;
    centre_root = valid ? sqrt(params.beta - params.alpha * params.alpha) : Scalar(0);
    // Subtraction leaves h(x+e) - h(x) with an error of one ulp of h, and the transform divides
    // its second differences by c: below c = sqrt(epsilon) fewer than half the digits are left.
    fine = c * c < math::machine_epsilon<Scalar>();
  }

  /// The transform about `point`, whose deviations depend on the first O states, with the root L of
  /// their covariance. In: the additive noise covariance (lower triangle) in
  /// `e`. Out: the columns t_i of `t`, the shift m of the mean, and e + sum s_i s_i' + (beta -
  /// alpha^2) m m', so that P_yy = t t' + e and P_oy = L t'. Value: Scalar, or a batch of such.
  template <class Point, class Value, int O, int M>
  AUVEST_INLINE void transform(const Point& point, const Matrix<Value, O, O>& root,
                               Matrix<Value, M, O>& t, Vector<Value, M>& shift,
                               Matrix<Value, M, M>& e) const {
    Matrix<Value, M, O + 1> s;  // the s_i and, last, the term of the mean
    AUVEST_UNROLL
    for (int k = 0; k < O; ++k) {
      Vector<Value, O> step;
      AUVEST_UNROLL
      for (int i = 0; i < O; ++i) step(i) = sqrt_c * root(i, k);
      Vector<Value, M> sum;
      Vector<Value, M> difference;
      point.deviations(step, sum, difference);
      AUVEST_UNROLL
      for (int m = 0; m < M; ++m) {
        // [UKF D4]
        t(m, k) = half_sqrt_c * difference(m);
        s(m, k) = half_sqrt_c * sum(m);
      }
    }
    AUVEST_UNROLL
    for (int m = 0; m < M; ++m) {
      Value total = s(m, 0);
      AUVEST_UNROLL
      for (int k = 1; k < O; ++k) total = total + s(m, k);
      shift(m) = mean_weight * total;  // [UKF D1]
      // [UKF D2], but for t t'
      s(m, O) = centre_root * shift(m);
      AUVEST_UNROLL
      for (int l = 0; l <= m; ++l) e(m, l) = math::plus_dot(e(m, l), &s(m, 0), &s(l, 0), O + 1);
    }
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
