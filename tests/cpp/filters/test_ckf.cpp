// The cubature Kalman filter: its rule on polynomials, against its textbook form, and in float.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "auvest/filters/ckf.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/math/random.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/linear.hpp"
#include "auvest/models/odometry.hpp"
#include "auvest/models/range_bearing.hpp"
#include "close.hpp"

namespace {

using auvest::Belief;
using auvest::Matrix;
using auvest::Status;
using auvest::Vector;

/// z = (x0^2, x0 x1): of degree 2, so that the rule's mean is exact.
struct Quadratic : auvest::MeasurementModel<Quadratic, double, 3, 2> {
  Measurement h(const State& x) const { return Measurement(x(0) * x(0), x(0) * x(1)); }
  Jacobian H(const State&) const { return Jacobian::Zero(); }
  Noise R() const { return 0.25 * Noise::Identity(); }
};

/// Mean, covariance and cross covariance over the points as the paper writes them.
template <class Model, int N>
void textbook(const Model& model, const Belief<double, N>& belief,
              Vector<double, Model::kSize>& mean, Matrix<double, Model::kSize, Model::kSize>& s,
              Matrix<double, N, Model::kSize>& cross) {
  const Matrix<double, N, N> root = Eigen::LLT<Eigen::Matrix<double, N, N>>(belief.P).matrixL();
  mean.setZero();
  for (int i = 0; i < 2 * N; ++i) {
    const Vector<double, N> step = (i < N ? 1.0 : -1.0) * std::sqrt(double(N)) * root.col(i % N);
    mean += model.h(belief.x + step) / (2.0 * N);
  }
  s = model.R();
  cross.setZero();
  for (int i = 0; i < 2 * N; ++i) {
    const Vector<double, N> step = (i < N ? 1.0 : -1.0) * std::sqrt(double(N)) * root.col(i % N);
    const Vector<double, Model::kSize> d = model.h(belief.x + step) - mean;
    s += d * d.transpose() / (2.0 * N);
    cross += step * d.transpose() / (2.0 * N);
  }
}

template <int N>
Belief<double, N> some_belief(std::uint64_t seed) {
  auvest::math::Random random(seed);
  Matrix<double, N, N> a;
  Belief<double, N> belief;
  for (int i = 0; i < N; ++i) {
    belief.x(i) = 3 + random.normal<double>();
    for (int j = 0; j < N; ++j) a(i, j) = 0.3 * random.normal<double>();
  }
  belief.P = a * a.transpose() + 0.05 * Matrix<double, N, N>::Identity();
  return belief;
}

/// An update is that of the paper's form, with the gain.
template <class Model, class Process>
void check_update(const Model& model, const Process& process,
                  const Belief<double, Process::kStates>& belief) {
  constexpr int n = Process::kStates;
  Vector<double, Model::kSize> mean;
  Matrix<double, Model::kSize, Model::kSize> s;
  Matrix<double, n, Model::kSize> cross;
  textbook(model, belief, mean, s, cross);
  const Vector<double, Model::kSize> z = mean + Vector<double, Model::kSize>::Constant(0.1);
  auvest::Ckf<Process> filter(process);
  REQUIRE(filter.reset(belief.x, belief.P) == Status::kOk);
  const auto correction = filter.update(z, model);
  REQUIRE(correction.status == Status::kOk);
  const Matrix<double, n, Model::kSize> gain = cross * s.inverse();
  const Vector<double, n> x = belief.x + gain * (z - mean);
  const Matrix<double, n, n> P = belief.P - gain * s * gain.transpose();
  CHECK((correction.S - s).cwiseAbs().maxCoeff() < 1e-12 * s.cwiseAbs().maxCoeff());
  CHECK((filter.x() - x).cwiseAbs().maxCoeff() < 1e-12);
  CHECK((filter.P() - P).cwiseAbs().maxCoeff() < 1e-12);
}

using Three = auvest::Odometry<double>;

TEST_CASE("CKF: an update is the textbook's, seen through all states") {
  check_update(Quadratic(), Three(), some_belief<3>(1));
}

TEST_CASE("CKF: an update is the textbook's where two of six states are seen") {
  auvest::RangeBearing<double, 6> sonar;
  sonar.params.station_x_m = -8;
  sonar.params.near_field = 0;
  check_update(sonar, auvest::ExactAcceleration<double>(), some_belief<6>(2));
}

TEST_CASE("CKF: the mean of a quadratic is exact: E x0^2 = m^2 + P, E x0 x1 = m0 m1 + P01") {
  const Belief<double, 3> belief = some_belief<3>(3);
  auvest::Ckf<Three> filter{Three()};
  REQUIRE(filter.reset(belief.x, belief.P) == Status::kOk);
  const auto correction = filter.update(Vector<double, 2>(1, 2), Quadratic());
  const double first = belief.x(0) * belief.x(0) + belief.P(0, 0);
  const double second = belief.x(0) * belief.x(1) + belief.P(1, 0);
  CHECK(correction.innovation(0) == close_to(1 - first, 1e-13));
  CHECK(correction.innovation(1) == close_to(2 - second, 1e-13));
}

TEST_CASE("CKF: a prediction is the textbook's") {
  Three odometry;
  odometry.input << 1.5, 0.2, 0.1;
  const Belief<double, 3> belief = some_belief<3>(4);
  const Matrix<double, 3, 3> root = Eigen::LLT<Eigen::Matrix3d>(belief.P).matrixL();
  Vector<double, 3> mean = Vector<double, 3>::Zero();
  Matrix<double, 3, 3> P = odometry.Q(0.5);
  Vector<double, 3> points[6];
  for (int i = 0; i < 6; ++i) {
    const Vector<double, 3> step = (i < 3 ? 1.0 : -1.0) * std::sqrt(3.0) * root.col(i % 3);
    points[i] = odometry.f(belief.x + step, 0.5);
    mean += points[i] / 6;
  }
  for (const auto& point : points) P += (point - mean) * (point - mean).transpose() / 6;
  auvest::Ckf<Three> filter(odometry);
  REQUIRE(filter.reset(belief.x, belief.P) == Status::kOk);
  REQUIRE(filter.predict(0.5) == Status::kOk);
  CHECK((filter.x() - mean).cwiseAbs().maxCoeff() < 1e-13);
  CHECK((filter.P() - P).cwiseAbs().maxCoeff() < 1e-13);
}

TEST_CASE("CKF: float follows double") {
  auvest::RangeBearing<float, 6> single;
  auvest::RangeBearing<double, 6> twice;
  single.params.station_x_m = -8.0f;
  twice.params.station_x_m = -8;
  const Belief<double, 6> belief = some_belief<6>(5);
  auvest::Ckf<auvest::ExactAcceleration<float>> a{auvest::ExactAcceleration<float>()};
  auvest::Ckf<auvest::ExactAcceleration<double>> b{auvest::ExactAcceleration<double>()};
  REQUIRE(a.reset(belief.x.cast<float>(), belief.P.cast<float>()) == Status::kOk);
  REQUIRE(b.reset(belief.x, belief.P) == Status::kOk);
  for (int k = 0; k < 50; ++k) {
    const Vector<double, 2> z(11.0 + 0.01 * k, 0.3);
    REQUIRE(a.predict(0.5f) == Status::kOk);
    REQUIRE(b.predict(0.5) == Status::kOk);
    REQUIRE(a.update(z.cast<float>(), single).status == Status::kOk);
    REQUIRE(b.update(z, twice).status == Status::kOk);
  }
  // 50 steps of a few dozen roundings of 6e-8, on coordinates of some metres.
  CHECK((a.x().cast<double>() - b.x()).cwiseAbs().maxCoeff() < 1e-4);
}

}  // namespace
