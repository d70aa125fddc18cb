#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/Cholesky>
#include <type_traits>

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"

namespace {

using auvest::Matrix;
using auvest::Vector;

template <class Scalar, int N>
Matrix<Scalar, N, N> random_covariance(auvest::math::Random& random) {
  Matrix<Scalar, N, N> a;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) a(i, j) = random.normal<Scalar>();
  }
  Matrix<Scalar, N, N> p = a * a.transpose();
  for (int i = 0; i < N; ++i) p(i, i) += Scalar(0.1);
  return p;
}

/// Worst error of P_oo = root root' and P_uo = slope P_oo, over the trace of P.
template <int O, class Scalar, int N>
double factor_error(const Matrix<Scalar, N, N>& p) {
  Matrix<Scalar, O, O> root;
  Matrix<Scalar, auvest::math::other_states(N, O), O> slope;
  const bool positive = auvest::math::factor_leading(p, root, slope);
  REQUIRE(positive);
  double worst = 0;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < O; ++j) {
      double sum = 0;
      for (int k = 0; k < O; ++k) {
        sum += i < O ? double(root(i, k)) * double(root(j, k))
                     : double(slope(i - O, k)) * double(k < j ? p(j, k) : p(k, j));
      }
      worst = std::max(worst, std::fabs(sum - double(i < j ? p(j, i) : p(i, j))));
      if (i < j) CHECK(double(root(i, j)) == 0);
    }
  }
  return worst / double(p.trace());
}

TEST_CASE("factor of the leading block: root and regression give the matrix back") {
  auvest::math::Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const auto p = random_covariance<double, 6>(random);
    CHECK(factor_error<1>(p) < 4e-16);
    CHECK(factor_error<2>(p) < 8e-16);
    CHECK(factor_error<4>(p) < 4e-15);  // the slope's error grows with the condition of P_oo
    CHECK(factor_error<6>(p) < 8e-16);
    const auto q = random_covariance<float, 6>(random);
    CHECK(factor_error<2>(q) < 8e-7);
  }
}

TEST_CASE("factor of the leading block: the full root is Eigen's") {
  auvest::math::Random random(2);
  const auto p = random_covariance<double, 6>(random);
  Matrix<double, 6, 6> root;
  Matrix<double, 1, 6> none;
  const bool positive = auvest::math::factor_leading(p, root, none);
  REQUIRE(positive);
  const Eigen::Matrix<double, 6, 6> expected = Eigen::Matrix<double, 6, 6>(p).llt().matrixL();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) CHECK(root(i, j) == close_to(expected(i, j), 1e-13));
  }
}

TEST_CASE("factor of the leading block: a lost pivot is floored, a bad diagonal refused") {
  Matrix<float, 2, 2> p;
  p << 1, 1, 1, 1;  // singular: the second pivot is 0
  Matrix<float, 2, 2> root;
  Matrix<float, 1, 2> none;
  const bool positive = auvest::math::factor_leading(p, root, none);
  REQUIRE(positive);
  CHECK(root(1, 1) ==
        close_to(std::sqrt(4.0 * double(std::numeric_limits<float>::epsilon())), 1e-7));
  for (const float bad : {0.0f, -1.0f, std::nanf("")}) {
    Matrix<float, 2, 2> q;
    q << 1, 0, 0, bad;
    CHECK_FALSE(auvest::math::factor_leading(q, root, none));
  }
  // With a third component, which both of these say all about: the first is taken.
  Matrix<float, 1, 2> slope;
  const Matrix<float, 3, 3> all = Matrix<float, 3, 3>::Ones();
  REQUIRE(auvest::math::factor_leading(all, root, slope));
  CHECK(root(1, 1) ==
        close_to(std::sqrt(4.0 * double(std::numeric_limits<float>::epsilon())), 1e-7));
  CHECK(slope(0, 0) == 1);
  CHECK(slope(0, 1) == 0);
  for (const float bad : {0.0f, -1.0f, std::nanf("")}) {
    Matrix<float, 3, 3> q = Matrix<float, 3, 3>::Identity();
    q(1, 1) = bad;
    CHECK_FALSE(auvest::math::factor_leading(q, root, slope));
  }
}

TEST_CASE("LDL': gives the matrix back, floors and refuses as the root does") {
  auvest::math::Random random(4);
  const auto p = random_covariance<double, 5>(random);
  Matrix<double, 5, 5> a = p;
  REQUIRE(auvest::math::ldlt(a));
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = 0;
      for (int k = 0; k <= j; ++k) {
        sum += (i == k ? 1 : a(i, k)) * a(k, k) * (j == k ? 1 : a(j, k));
      }
      CHECK(std::fabs(sum - p(i, j)) < 8e-16 * p.trace());
    }
  }
  Matrix<float, 2, 2> singular;
  singular << 1, 1, 1, 1;
  REQUIRE(auvest::math::ldlt(singular));
  CHECK(singular(1, 1) == 4 * std::numeric_limits<float>::epsilon());
  singular(1, 1) = -1;
  CHECK_FALSE(auvest::math::ldlt(singular));
  Matrix<double, 2, 2> indefinite;
  indefinite << 1, 2, 2, 1;  // eigenvalues 3 and -1, positive diagonal
  CHECK_FALSE(auvest::math::ldlt(indefinite));
}

TEST_CASE("lower_finite: looks at the lower triangle and only there") {
  Matrix<double, 3, 3> a = Matrix<double, 3, 3>::Zero();
  a(0, 2) = std::nan("");
  CHECK(auvest::math::lower_finite(a));
  CHECK_FALSE(auvest::math::all_finite(a));
  a(2, 0) = std::numeric_limits<double>::infinity();
  CHECK_FALSE(auvest::math::lower_finite(a));
}

TEST_CASE("positive definite: against the smallest eigenvalue's sign") {
  Matrix<double, 3, 3> p;
  p << 2, -1, 0, -1, 2, -1, 0, -1, 2;
  CHECK(auvest::math::is_positive_definite(p));
  p(2, 2) = 0.5;  // determinant 2 (2 * 0.5 - 1) - 0.5 < 0
  CHECK_FALSE(auvest::math::is_positive_definite(p));
  p(0, 0) = std::numeric_limits<double>::infinity();
  CHECK_FALSE(auvest::math::is_positive_definite(p));
}

TEST_CASE("symmetric product: against Eigen") {
  auvest::math::Random random(3);
  const auto p = random_covariance<double, 4>(random);
  Matrix<double, 4, 4> phi;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) phi(i, j) = random.normal<double>();
  }
  Matrix<double, 4, 4> lower = p;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) lower(i, j) = 1e9;  // the upper triangle must not be read
  }
  const auto result = auvest::math::symmetric_product(phi, lower);
  const Matrix<double, 4, 4> expected = phi * p * phi.transpose();
  CHECK((result - expected).cwiseAbs().maxCoeff() < 1e-12 * expected.trace());
}

TEST_CASE_TEMPLATE("dropped pivots: L L' gives P back, and no more rank", Scalar, float, double) {
  auvest::math::Random random(21);
  const double tolerance = std::is_same<Scalar, float>::value ? 2e-6 : 4e-15;
  for (int trial = 0; trial < 200; ++trial) {
    // Rank 0 to 3: sums of outer products.
    const int rank = trial % 4;
    Matrix<Scalar, 3, 3> p = Matrix<Scalar, 3, 3>::Zero();
    for (int r = 0; r < rank; ++r) {
      Vector<Scalar, 3> v;
      for (int i = 0; i < 3; ++i) v(i) = random.normal<Scalar>();
      if (trial % 8 < 4) v(0) = Scalar(0);  // a leading zero pivot
      p += v * v.transpose();
    }
    Matrix<Scalar, 3, 3> l;
    Matrix<Scalar, 1, 3> none;
    auvest::math::factor_leading<auvest::math::DropLostPivots>(p, l, none);
    for (int i = 0; i < 3; ++i) {
      CHECK(l(i, i) >= Scalar(0));
      for (int j = 0; j <= i; ++j) {
        double sum = 0;
        for (int k = 0; k <= j; ++k) sum += double(l(i, k)) * double(l(j, k));
        CHECK(std::fabs(sum - double(p(i, j))) <= tolerance * double(p.trace()));
        if (double(l(j, j)) <= 0) CHECK(double(l(i, j)) == 0);  // a lost pivot: no column
      }
    }
  }
}

TEST_CASE("copy_where: all numbers of a belief and its lower triangle, or none") {
  auvest::Belief<float, 3> from;
  from.x << 1, 2, 3;
  from.P << 4, -1, -1, 5, 6, -1, 7, 8, 9;
  for (const bool where : {false, true}) {
    auvest::Belief<float, 3> to;
    to.x.setZero();
    to.P.setZero();
    auvest::math::copy_where(where, from, to);
    for (int i = 0; i < 3; ++i) {
      CHECK(to.x(i) == (where ? from.x(i) : 0.0f));
      for (int j = 0; j <= i; ++j) CHECK(to.P(i, j) == (where ? from.P(i, j) : 0.0f));
    }
  }
}

}  // namespace
