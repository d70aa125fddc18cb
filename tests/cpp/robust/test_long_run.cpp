// A million float updates keep P symmetric positive definite, and the filter where it should be.
#include <doctest/doctest.h>

#include <cmath>

#include "auvest/auvest.hpp"
#include "simulation/cooperative.hpp"

namespace {

using auvest::Matrix;
using auvest::Status;
using auvest::Vector;

struct LongRun {
  long updates = 0, not_definite = 0, not_symmetric = 0;
  double square = 0;  ///< of the error, mean [m^2]
};

/// Ranges every second, one of ten an outlier. Where the initial P is tiny or huge the first
/// updates are the hardest.
template <class Process>
LongRun million(double p0) {
  constexpr int kStates = Process::kStates;
  typename Process::Params params;
  params.sigma_starboard = 0.01f;
  auvest::RobustEkf<Process> filter{auvest::Ekf<Process>(Process(params))};
  Vector<float, kStates> x0 = Vector<float, kStates>::Zero();
  Matrix<float, kStates, kStates> P0 = Matrix<float, kStates, kStates>::Identity() * 1e-4f;
  P0(0, 0) = P0(1, 1) = float(p0);
  REQUIRE(filter.reset(x0, P0) == Status::kOk);

  auvest::math::Random random(5);
  auvest::RangeNoise noise;
  noise.outlier_fraction = 0.1;
  auvest::CooperativeFleet fleet;
  LongRun run;
  for (long k = 0; k < 1000000; ++k) {
    double speed_error = 0, heading_error = 0;
    random.normal_pair(speed_error, heading_error);
    const Vector<float, 3> input(float(fleet.speed + 0.1 * speed_error), 0,
                                 float(fleet.heading() + 0.0174533 * heading_error));
    fleet.advance(1);
    REQUIRE(filter.predict(1, input) == Status::kOk);
    double there[2];
    fleet.leader(int(k % 2), there);
    typename auvest::LeaderRange<float, kStates>::Params p;
    p.leader_x_m = float(there[0]);
    p.leader_y_m = float(there[1]);
    const Vector<float, 1> z(
        float(std::hypot(fleet.position[0] - there[0], fleet.position[1] - there[1]) +
              noise.draw(random)));
    const auto report = filter.update(z, auvest::LeaderRange<float, kStates>(p));
    REQUIRE(report.status == Status::kOk);
    ++run.updates;
    const Matrix<float, kStates, kStates> P = filter.P();
    if (!(P == P.transpose())) ++run.not_symmetric;
    Matrix<double, kStates, kStates> exact = P.template cast<double>();
    // Scaled to a unit diagonal: what counts is the correlation, not the units.
    const Vector<double, kStates> sigma = exact.diagonal().cwiseSqrt();
    exact = sigma.cwiseInverse().asDiagonal() * exact * sigma.cwiseInverse().asDiagonal();
    if (!auvest::math::is_positive_definite(exact)) ++run.not_definite;
    const double ex = double(filter.x()(0)) - fleet.position[0];
    const double ey = double(filter.x()(1)) - fleet.position[1];
    run.square += (ex * ex + ey * ey) / 1e6;
  }
  return run;
}

TEST_CASE("robust EKF: P stays symmetric positive definite over a million float updates" *
          doctest::test_suite("statistics")) {
  for (const double p0 : {1e-6, 1.0, 1e6}) {
    CAPTURE(p0);
    const LongRun two = million<auvest::SpeedHeading<float>>(p0);
    CHECK(two.updates == 1000000);
    CHECK(two.not_symmetric == 0);
    CHECK(two.not_definite == 0);
    // 0.6 m with a range of 1 m every second. From 1 km the way leads past the mirror position.
    if (p0 <= 1) CHECK(std::sqrt(two.square) < 1.0);
  }
  const LongRun four = million<auvest::SpeedHeading<float, true, true>>(1);
  CHECK(four.not_symmetric == 0);
  CHECK(four.not_definite == 0);
  CHECK(std::sqrt(four.square) < 1.0);
}

}  // namespace
