#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/LU>
#include <cmath>

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/random.hpp"

namespace {

using auvest::Belief;
using auvest::Correction;
using auvest::Matrix;
using auvest::Status;
using auvest::Vector;

template <class Scalar, int N, int M>
Matrix<Scalar, N, M> random_matrix(auvest::math::Random& random, double scale) {
  Matrix<Scalar, N, M> a;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < M; ++j) a(i, j) = Scalar(scale * random.normal<double>());
  }
  return a;
}

/// Against x + K r, P - K S K' and r' S^-1 r, for H that sees the first O of N states.
template <int N, int M, int O>
void check_against_textbook() {
  auvest::math::Random random(N * 100 + M * 10 + O);
  for (int trial = 0; trial < 50; ++trial) {
    const Matrix<double, N, N> root = random_matrix<double, N, N>(random, 1);
    const Matrix<double, N, N> p = root * root.transpose() + 0.1 * Matrix<double, N, N>::Identity();
    const Matrix<double, M, M> noise_root = random_matrix<double, M, M>(random, 0.3);
    const Matrix<double, M, M> noise =
        noise_root * noise_root.transpose() + 0.01 * Matrix<double, M, M>::Identity();
    const Matrix<double, M, O> h = random_matrix<double, M, O>(random, 1);
    Matrix<double, M, N> full = Matrix<double, M, N>::Zero();
    full.template leftCols<O>() = h;

    Belief<double, N> belief;
    belief.x = random_matrix<double, N, 1>(random, 1);
    belief.P = p;
    const Vector<double, N> x = belief.x;
    Correction<double, M> correction(Status::kOk);
    correction.innovation = random_matrix<double, M, 1>(random, 1);

    Matrix<double, O, O> l;
    Matrix<double, auvest::math::other_states(N, O), O> slope;
    const bool positive = auvest::math::factor_leading(p, l, slope);
    REQUIRE(positive);
    Matrix<double, M, O> a = h * l;
    Matrix<double, M, M> used_noise = noise;
    REQUIRE(auvest::SquareRootUpdate()(belief, l, slope, a, used_noise, correction) == Status::kOk);

    // L becomes a root of P_oo+.
    const Matrix<double, O, O> after = l * l.transpose();
    const Matrix<double, M, M> s = full * p * full.transpose() + noise;
    const Matrix<double, N, M> gain = p * full.transpose() * s.inverse();
    const Vector<double, N> expected_x = x + gain * correction.innovation;
    const Matrix<double, N, N> expected_p = p - gain * s * gain.transpose();
    for (int i = 0; i < N; ++i) {
      CHECK(std::fabs(belief.x(i) - expected_x(i)) < 1e-11);
      for (int j = 0; j <= i; ++j) {
        CHECK(std::fabs(belief.P(i, j) - expected_p(i, j)) < 1e-12 * p.trace());
      }
    }
    for (int i = 0; i < O; ++i) {
      for (int j = 0; j <= i; ++j) {
        CHECK(std::fabs(after(i, j) - expected_p(i, j)) < 1e-12 * p.trace());
      }
    }
    CHECK(used_noise.diagonal().prod() == close_to(s.determinant(), 1e-9));  // as potter() says
    CHECK((correction.S - s).cwiseAbs().maxCoeff() < 1e-12 * s.trace());
    CHECK(correction.nis ==
          close_to(correction.innovation.dot(s.inverse() * correction.innovation), 1e-9));
  }
}

TEST_CASE("square-root update: equals P - K S K'") {
  check_against_textbook<1, 1, 1>();
  check_against_textbook<6, 2, 2>();
  check_against_textbook<6, 1, 2>();
  check_against_textbook<6, 2, 6>();
  check_against_textbook<4, 3, 3>();
  check_against_textbook<3, 5, 2>();
}

TEST_CASE("square-root update: float stays positive where P - K S K' does not") {
  // A prior of 1 km against a sensor of 1 mm: 1 - k h is 1e-12, below the resolution of float.
  Belief<float, 2> belief;
  belief.x.setZero();
  belief.P << 1e6f, 0, 9.9e5f, 1e6f;
  Matrix<float, 2, 2> root;
  Matrix<float, 1, 2> none;
  const bool positive = auvest::math::factor_leading(belief.P, root, none);
  REQUIRE(positive);
  Matrix<float, 1, 2> a;
  a << root(0, 0), 0;  // H = (1, 0)
  Matrix<float, 1, 1> noise;
  noise << 1e-6f;
  Correction<float, 1> correction(Status::kOk);
  correction.innovation << 5;
  REQUIRE(auvest::SquareRootUpdate()(belief, root, none, a, noise, correction) == Status::kOk);
  // Closed form: P_00 = R to 1e-12, P_11 = P_11 - P_10^2 / P_00 = 1e6 - 9.801e5 = 19900.
  CHECK(belief.P(0, 0) > 0);
  CHECK(belief.P(0, 0) < 1e-2f);
  CHECK(belief.P(1, 1) == close_to(19900, 1e-3));
  CHECK(belief.P(0, 0) * belief.P(1, 1) >= belief.P(1, 0) * belief.P(1, 0));
  CHECK(belief.x(0) == close_to(5, 1e-12));
  CHECK(belief.x(1) == close_to(5 * 0.99, 1e-6));
}

TEST_CASE("square-root update: after an outage, float keeps what the fix says of the velocity") {
  // 1000 s without a fix: the position error is nearly the velocity error times the time.
  const double time = 1000;
  const double variance = 0.01;  // of the velocity
  const double fix = 0.0025;
  Belief<float, 2> belief;
  belief.x.setZero();
  belief.P << float(variance * time * time + 0.01), 0, float(variance * time), float(variance);
  Matrix<float, 1, 1> root;
  Matrix<float, 1, 1> slope;
  const bool positive = auvest::math::factor_leading(belief.P, root, slope);
  REQUIRE(positive);
  Matrix<float, 1, 1> a;
  a << root(0, 0);
  Matrix<float, 1, 1> noise;
  noise << float(fix);
  Correction<float, 1> correction(Status::kOk);
  correction.innovation << 30;
  REQUIRE(auvest::SquareRootUpdate()(belief, root, slope, a, noise, correction) == Status::kOk);
  CHECK(belief.P(0, 0) == close_to(fix, 1e-3));
  // P_uo+ = B P_oo+: a relative error, not one of the prior's size.
  CHECK(belief.P(1, 0) == close_to(fix / time, 1e-3));
  // What the start did not know, 0.01 m^2, and what the fix does not know. One rounding of the
  // prior's variance is a tenth of that.
  CHECK(std::fabs(double(belief.P(1, 1)) - (0.01 + fix) / (time * time)) <
        double(std::numeric_limits<float>::epsilon()) * variance);
  CHECK(belief.x(1) == close_to(30 / time, 1e-5));
}

TEST_CASE("square-root update: float leaves a variance to what a precise fix tells all of") {
  // The state that is not seen is a multiple of the one that is: the fix leaves 1e-12 of its
  // variance, and P_uu - P_uo^2 / P_oo is rounding noise of either sign.
  for (int k = 0; k < 50; ++k) {
    const double multiple = 0.1 + 0.07 * k;
    const double variance = 3 + 0.9 * k;
    Belief<float, 2> belief;
    belief.x.setZero();
    belief.P << float(variance), 0, float(multiple * variance),
        float(multiple * multiple * variance);
    const double before = double(belief.P(1, 1));
    Matrix<float, 1, 1> root;
    Matrix<float, 1, 1> slope;
    const bool positive = auvest::math::factor_leading(belief.P, root, slope);
    REQUIRE(positive);
    Matrix<float, 1, 1> a(root(0, 0));
    Matrix<float, 1, 1> noise(1e-12f);
    Correction<float, 1> correction(Status::kOk);
    correction.innovation << 1;
    REQUIRE(auvest::SquareRootUpdate()(belief, root, slope, a, noise, correction) == Status::kOk);
    const double epsilon = double(std::numeric_limits<float>::epsilon());
    CHECK(double(belief.P(1, 1)) >= 4 * epsilon * before);  // what the format resolves, ...
    CHECK(double(belief.P(1, 1)) < 8 * epsilon * before);   // ... and no more
  }
}

TEST_CASE("square-root update: what would overflow is refused and changes nothing") {
  for (const float innovation : {1e38f, 3e38f}) {
    Belief<float, 2> belief;
    belief.x << 3e38f, 1;
    belief.P << 1e4f, 0, 1, 1e4f;
    Matrix<float, 1, 1> root;
    Matrix<float, 1, 1> slope;
    const bool positive = auvest::math::factor_leading(belief.P, root, slope);
    REQUIRE(positive);
    Matrix<float, 1, 1> a;
    a << root(0, 0);
    Matrix<float, 1, 1> noise;
    noise << 1;
    Correction<float, 1> correction(Status::kOk);
    correction.innovation << innovation;
    CHECK(auvest::SquareRootUpdate()(belief, root, slope, a, noise, correction) ==
          Status::kOverflow);
    CHECK(belief.x(0) == 3e38f);
    CHECK(belief.x(1) == 1);
    CHECK(belief.P(0, 0) == 1e4f);
    CHECK(belief.P(1, 0) == 1);
  }
}

TEST_CASE("square-root update: an indefinite noise is refused") {
  Matrix<double, 1, 1> one = Matrix<double, 1, 1>::Identity();
  Belief<double, 1> belief;
  belief.x << 0;
  belief.P << 1;
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    Matrix<double, 1, 1> a = one;
    Matrix<double, 1, 1> noise;
    noise << bad;
    Correction<double, 1> correction(Status::kOk);
    CHECK(auvest::SquareRootUpdate()(belief, one, one, a, noise, correction) ==
          Status::kNotPositiveDefinite);
  }
  Belief<double, 2> pair;
  pair.x.setZero();
  pair.P.setIdentity();
  Matrix<double, 2, 2> root = pair.P;
  const Matrix<double, 1, 2> none = Matrix<double, 1, 2>::Zero();
  Matrix<double, 2, 2> indefinite;
  indefinite << 1, 2, 2, 1;
  Correction<double, 2> correction(Status::kOk);
  Matrix<double, 2, 2> unseen = Matrix<double, 2, 2>::Zero();
  CHECK(auvest::SquareRootUpdate()(pair, root, none, unseen, indefinite, correction) ==
        Status::kNotPositiveDefinite);
}

TEST_CASE("square-root update: a number seen through the only two states, as the general code") {
  using Root = Matrix<double, 2, 2>;
  auvest::math::Random random(11);
  for (int k = 0; k < 200; ++k) {
    auvest::Belief<double, 2> general;
    const double spread = std::pow(10.0, 3 * random.normal<double>());
    const double c = 0.999 * std::sin(random.normal<double>());
    general.x << random.normal<double>(), random.normal<double>();
    general.P << 1, c * spread, c * spread, spread * spread;
    auvest::Belief<double, 2> planar = general;

    Root root, planar_root;
    Matrix<double, 1, 2> slope;
    using auvest::math::RaiseLostPivots;
    REQUIRE(auvest::math::factor_leading<RaiseLostPivots, 2, 1, double, 2>(general.P, root, slope));
    REQUIRE(auvest::math::factor_leading(planar.P, planar_root, slope));
    CHECK(root == planar_root);

    Matrix<double, 1, 2> a(random.normal<double>(), random.normal<double>());
    Matrix<double, 1, 1> noise(std::exp(random.normal<double>()));
    const Matrix<double, 1, 1> s(noise(0, 0) + a.squaredNorm());
    const Vector<double, 1> innovation(3 * random.normal<double>());
    Matrix<double, 1, 2> a_used = a;
    Matrix<double, 1, 1> noise_used = noise;
    auvest::Posterior<double, 2> posterior;
    const bool finite = auvest::potter(a_used, noise_used, innovation, posterior) &&
                        auvest::move_belief(general, root, slope, posterior);
    REQUIRE(finite);
    Correction<double, 1> correction(Status::kOk);
    correction.innovation = innovation;
    correction.S = s;
    REQUIRE(auvest::correct_belief(planar, planar_root, slope, a, noise, correction) ==
            Status::kOk);
    CHECK(correction.nis == close_to(posterior.nis, 1e-14));
    for (int i = 0; i < 2; ++i) {
      const double scale = std::sqrt(general.P(i, i));
      CHECK(std::fabs(planar.x(i) - general.x(i)) < 1e-13 * (scale + std::fabs(general.x(i))));
      for (int j = 0; j <= i; ++j) {
        const double size = scale * std::sqrt(general.P(j, j));
        CHECK(std::fabs(planar.P(i, j) - general.P(i, j)) < 1e-12 * size);
      }
    }
  }
}

TEST_CASE("square-root update: what a range cannot do leaves the belief") {
  auvest::Belief<double, 2> belief;
  belief.x << 1, 2;
  belief.P << 4, 1, 1, 3;
  const auvest::Belief<double, 2> before = belief;
  Matrix<double, 2, 2> root;
  Matrix<double, 1, 2> slope;
  REQUIRE(auvest::math::factor_leading(belief.P, root, slope));
  const auto with = [&](double noise_in, double innovation) {
    Matrix<double, 2, 2> l = root;
    Matrix<double, 1, 2> a(1, 1);
    Matrix<double, 1, 1> noise(noise_in);
    Correction<double, 1> correction(Status::kOk);
    correction.innovation(0) = innovation;
    correction.S(0, 0) = noise_in + 2;
    return auvest::correct_belief(belief, l, slope, a, noise, correction);
  };
  CHECK(with(0, 1) == Status::kNotPositiveDefinite);
  CHECK(with(-1, 1) == Status::kNotPositiveDefinite);
  CHECK(with(std::nan(""), 1) == Status::kNotPositiveDefinite);
  CHECK(with(1, 1e200) == Status::kOverflow);
  CHECK(belief.x == before.x);
  CHECK(belief.P == before.P);
}

TEST_CASE("square-root update: a range that takes one coordinate beyond the format is refused") {
  for (int k = 0; k < 2; ++k) {
    CAPTURE(k);
    auvest::Belief<double, 2> belief;
    belief.x << 1, 1;
    belief.x(k) = 1.79e308;
    belief.P << 1, 0, 0, 1;
    belief.P(k, k) = 1e306;
    const auvest::Belief<double, 2> before = belief;
    Matrix<double, 2, 2> root;
    Matrix<double, 1, 2> slope;
    const bool positive = auvest::math::factor_leading(belief.P, root, slope);
    REQUIRE(positive);
    Matrix<double, 1, 2> a(0, 0);
    a(k) = 1;
    Matrix<double, 1, 1> noise(1.0);
    Correction<double, 1> correction(Status::kOk);
    correction.innovation(0) = 1.5e154;  // its NIS is 1.1e308, and it moves x(k) by 7.5e306
    correction.S(0, 0) = 2;
    CHECK(auvest::correct_belief(belief, root, slope, a, noise, correction) == Status::kOverflow);
    CHECK(belief.x == before.x);
    CHECK(belief.P == before.P);
  }
}

}  // namespace
