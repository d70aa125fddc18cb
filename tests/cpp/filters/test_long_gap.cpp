// Hours without a measurement: the belief is then wider than a range is straight. Every filter must
// come out of it with a covariance, and say no more than the range does.
#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>

#include "auvest/auvest.hpp"

namespace {

using namespace auvest;

/// The smallest eigenvalue of the correlations; -2 where there are none.
template <class Scalar>
double least_correlation(const Matrix<Scalar, 6, 6>& P) {
  Eigen::Matrix<double, 6, 6> p = P.template cast<double>();
  if (!p.allFinite() || (p.diagonal().array() <= 0).any()) return -2;
  const Eigen::Matrix<double, 6, 1> scale = p.diagonal().cwiseSqrt().cwiseInverse();
  p = scale.asDiagonal() * p * scale.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(p).eigenvalues()(0);
}

template <class Filter, class Sensor>
void check_gaps(const typename Filter::Process& process, const Sensor& sensor) {
  using Scalar = typename Filter::Scalar;
  math::Random random(7);
  for (const double gap : {600.0, 3600.0, 14400.0, 86400.0, 604800.0}) {
    double least = 1;
    for (int start = 0; start < 40; ++start) {
      Filter filter{process};
      REQUIRE(filter.limit_steps(Scalar(1e9)) == Status::kOk);
      typename Filter::State x;
      typename Filter::Covariance P = Filter::Covariance::Zero();
      for (int i = 0; i < 6; ++i) {
        const double sigma = i < 2 ? 100 : i < 4 ? 1 : 0.01;
        x(i) = Scalar(sigma * double(random.normal<float>()));
        P(i, i) = Scalar(i < 2 ? 1 : i < 4 ? 0.1 : 0.01);
      }
      REQUIRE(filter.reset(x, P) == Status::kOk);
      for (const double dt : {1.0, 1.0, 1.0, gap, 1.0, 1.0, 1.0, 1.0, 1.0}) {
        REQUIRE(filter.predict(Scalar(dt)) == Status::kOk);
        REQUIRE(filter.update(sensor.h(filter.x()), sensor).status == Status::kOk);
        const double now = least_correlation<Scalar>(filter.P());
        if (!(now > least)) least = now;
      }
    }
    CAPTURE(gap);
    // What rounding alone may do to the eigenvalues of a symmetric matrix of six with a diagonal of
    // ones, for the dozen operations behind each element.
    CHECK(least > -6 * 12 * double(math::machine_epsilon<Scalar>()));
  }
}

template <class Scalar, template <class> class Filter>
void check_all_gaps() {
  using Acceleration = ExactAcceleration<Scalar>;
  typename Acceleration::Params noise;
  noise.velocity = Scalar(1e-2);
  noise.acceleration = Scalar(1e-6);
  RangeBearing<Scalar, 6> plane;
  plane.params.sigma_range_m = Scalar(0.1);
  check_gaps<Filter<Acceleration>>(Acceleration(noise), plane);
  RangeBearingElevation<Scalar, 6> space;
  space.params.sigma_range_m = Scalar(0.1);
  check_gaps<Filter<WhiteAcceleration<Scalar, 3>>>(WhiteAcceleration<Scalar, 3>(), space);
}

/// What the EKF makes of a range over a belief that is wide across the line of sight only.
template <class Sensor>
Correction<double, Sensor::kSize> across(const Sensor& sensor, double distance, double variance) {
  using Process = ExactAcceleration<double>;
  Ekf<Process> ekf{Process()};
  Vector<double, 6> x = Vector<double, 6>::Zero();
  x(0) = distance;
  Matrix<double, 6, 6> P = 1e-12 * Matrix<double, 6, 6>::Identity();
  P(1, 1) = variance;
  REQUIRE(ekf.reset(x, P) == Status::kOk);
  return ekf.update(sensor.h(x), sensor);
}

template <class Sensor>
void check_bend(Sensor sensor) {
  sensor.params.station_x_m = sensor.params.station_y_m = 0;
  sensor.params.sigma_range_m = 0.5;
  const double r = 1000;
  // A displacement e across adds e^2 / 2r to the range: v / 2r in the mean, v^2 / 2r^2 of variance.
  const double limit = 3 * 0.5 * std::sqrt(2.0) * r;
  for (const double factor : {0.5, 0.999}) {
    const auto below = across(sensor, r, factor * limit);
    CHECK(below.innovation(0) == 0);
    CHECK(below.S(0, 0) == doctest::Approx(0.25).epsilon(1e-9));
  }
  for (const double factor : {1.001, 20.0}) {
    const double v = factor * limit;
    const auto above = across(sensor, r, v);
    CHECK(above.innovation(0) == doctest::Approx(-v / (2 * r)).epsilon(1e-9));
    CHECK(above.S(0, 0) == doctest::Approx(0.25 + v * v / (2 * r * r)).epsilon(1e-9));
  }
}

}  // namespace

TEST_CASE("after hours without a measurement the covariance is one") {
  SUBCASE("EKF, float") { check_all_gaps<float, Ekf>(); }
  SUBCASE("EKF, double") { check_all_gaps<double, Ekf>(); }
  SUBCASE("UKF, float") { check_all_gaps<float, Ukf>(); }
  SUBCASE("UKF, double") { check_all_gaps<double, Ukf>(); }
  SUBCASE("CKF, float") { check_all_gaps<float, Ckf>(); }
  SUBCASE("CKF, double") { check_all_gaps<double, Ckf>(); }
}

TEST_CASE("the EKF sees the bend of a range where it is more than three sigma") {
  RangeBearing<double, 6> plane;
  plane.params.near_field = 0;
  check_bend(plane);
  RangeBearingElevation<double, 6> space;
  space.params.near_field = 0;
  check_bend(space);
}
