// Cubature Kalman filter (Arasaratnam, Haykin, "Cubature Kalman filters", IEEE Transactions on
// Automatic Control 54(6), 2009): the mean over a Gaussian by the third-degree spherical-radial
// rule, 2 n points at a distance of sqrt n with equal weights and none at the centre. There is
// nothing to tune, and no weight is negative.
//
// In the deviation form of sigma_points.hpp c = n, and
//
//     m    = sum_i s_i / sqrt n
//     P_yy = sum_i (t_i t_i' + (s_i - s)(s_i - s)'),   s = sum_i s_i / n = m / sqrt n,
//
// which is the covariance about the mean, again a sum of squares. (It is that of a UKF with
// beta - alpha^2 = -1, whose m m' is taken off: a difference, and so not that filter's form.)
// Along the n - O columns that a measurement does not see, s_i = 0 and (s_i - s)(s_i - s)' = s s'.
#pragma once

#include "auvest/filters/sigma_point_filter.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct CubaturePoints {
  static constexpr Status status = Status::kOk;
  static constexpr bool fine = false;

  int count;            ///< n
  Scalar root;          ///< sqrt n: points lie at x +- root L_i
  Scalar half_inverse;  ///< 1 / (2 sqrt n)

  explicit CubaturePoints(int n)
      : count(n), root(math::sqrt(Scalar(n))), half_inverse(Scalar(0.5) / root) {}

  /// As SigmaPoints::transform.
  template <class Point, int O, int M>
  void transform(const Point& point, const Matrix<Scalar, O, O>& l, Matrix<Scalar, M, O>& t,
                 Vector<Scalar, M>& shift, Matrix<Scalar, M, M>& e) const {
    Matrix<Scalar, M, O + 1> s;  // the s_i and, last, what the columns that are not seen add
    for (int k = 0; k < O; ++k) {
      Vector<Scalar, O> step;
      for (int i = 0; i < O; ++i) step(i) = root * l(i, k);
      Vector<Scalar, M> sum;
      Vector<Scalar, M> difference;
      point.deviations(step, sum, difference);
      for (int m = 0; m < M; ++m) {
        t(m, k) = half_inverse * difference(m);
        s(m, k) = half_inverse * sum(m);
      }
    }
    const Scalar unseen = math::sqrt(Scalar(count - O));
    for (int m = 0; m < M; ++m) {
      Scalar total = s(m, 0);
      for (int k = 1; k < O; ++k) total = total + s(m, k);
      shift(m) = total / root;
      const Scalar mean = shift(m) / root;
      for (int k = 0; k < O; ++k) s(m, k) = s(m, k) - mean;
      s(m, O) = unseen * mean;
      for (int j = 0; j <= m; ++j) e(m, j) = math::plus_dot(e(m, j), &s(m, 0), &s(j, 0), O + 1);
    }
  }
};

template <class Scalar>
constexpr Status CubaturePoints<Scalar>::status;
template <class Scalar>
constexpr bool CubaturePoints<Scalar>::fine;

template <class Process>
class Ckf : public SigmaPointFilter<Process, CubaturePoints<typename Process::Scalar>> {
 public:
  using Base = SigmaPointFilter<Process, CubaturePoints<typename Process::Scalar>>;
  using typename Base::Scalar;

  explicit Ckf(const Process& process = Process())
      : Base(process, CubaturePoints<Scalar>(Process::kStates)) {}
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
