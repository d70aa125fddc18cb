#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstring>
#include <limits>

#include "auvest/filters/ekf.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/math/random.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/speed_heading.hpp"

namespace {

using auvest::Matrix;
using auvest::Status;
using auvest::Vector;

template <class Scalar>
using Tracker = auvest::Ukf<auvest::ExactAcceleration<Scalar>>;

template <class Scalar>
Tracker<Scalar> tracker(double alpha, double x0, double y0, double variance) {
  typename Tracker<Scalar>::Params params;
  params.alpha = Scalar(alpha);
  Tracker<Scalar> filter{auvest::ExactAcceleration<Scalar>(), params};
  Vector<Scalar, 6> x = Vector<Scalar, 6>::Zero();
  x(0) = Scalar(x0);
  x(1) = Scalar(y0);
  Matrix<Scalar, 6, 6> P = Matrix<Scalar, 6, 6>::Identity() * Scalar(variance);
  REQUIRE(filter.reset(x, P) == Status::kOk);
  return filter;
}

template <class Filter>
bool same_belief(const Filter& a, const Filter& b) {
  return std::memcmp(a.x().data(), b.x().data(), sizeof(a.x())) == 0 && a.P() == b.P();
}

/// A fix of x + y: a user's model of another size, without Jacobian or closed form.
struct SumSensor : auvest::MeasurementModel<SumSensor, double, 6, 1, 2> {
  Measurement h(const State& x) const { return Measurement(x(0) + x(1)); }
  Noise R() const { return Noise(0.04); }
};

TEST_CASE("a saved covariance whose elimination overflows is not restored") {
  auto filter = tracker<float>(1e-3, 300, 400, 4);
  const auto before = filter;
  auto saved = filter.belief();
  saved.P.diagonal() << 0.28f, 0.19f, 4e-4f, 4e-4f, 8e-5f, 8e-5f;
  REQUIRE(filter.restore(saved) == Status::kOk);
  filter = before;
  saved.P(4, 0) = 1e38f;
  CHECK(filter.restore(saved) == Status::kNotPositiveDefinite);
  CHECK(same_belief(filter, before));
}

TEST_CASE("UKF: second-order mean of the range, in closed form") {
  // E|D + e| for e ~ N(0, s^2 I), s << |D|: |D| + s^2 / (2 |D|) + O(s^4). The transform is exact to
  // second order for every alpha, so the innovation of z = |D| is -s^2 / (2 |D|).
  for (const double alpha : {1.0, 1e-3, 1e-6}) {
    auvest::RangeBearing<double, 6>::Params p;
    p.station_x_m = 0;
    p.station_y_m = 0;
    const auvest::RangeBearing<double, 6> sonar(p);
    auto filter = tracker<double>(alpha, 300, 400, 4);
    const auto correction = filter.update(Vector<double, 2>(500, std::atan2(400, 300)), sonar);
    REQUIRE(correction.status == Status::kOk);
    CHECK(correction.innovation(0) == close_to(-4.0 / 1000, 1e-4));
    CHECK(std::fabs(correction.innovation(1)) < 1e-9);
  }
}

TEST_CASE("UKF: several measurement models of different size") {
  auto filter = tracker<double>(1, 10, 5, 1);
  const auvest::RangeBearing<double, 6> sonar;
  CHECK(filter.update(Vector<double, 2>(10.2, 0.3), sonar).status == Status::kOk);
  const auto before = filter.P();
  const auto correction = filter.update(SumSensor::Measurement(15.1), SumSensor());
  REQUIRE(correction.status == Status::kOk);
  // One scalar linear measurement: S = v' P v + R with v = (1, 1, 0, ...).
  CHECK(correction.S(0, 0) ==
        close_to(before(0, 0) + 2 * before(1, 0) + before(1, 1) + 0.04, 1e-12));
  CHECK(filter.P().trace() < before.trace());
}

TEST_CASE("UKF: a refused call leaves the belief as it was") {
  const double nan = std::nan("");
  const double inf = std::numeric_limits<double>::infinity();
  const auvest::RangeBearing<double, 6> sonar;
  auto filter = tracker<double>(1e-6, 10, 5, 1);
  const auto before = filter;
  CHECK(filter.predict(nan) == Status::kNotFinite);
  CHECK(filter.predict(inf) == Status::kNotFinite);
  CHECK(filter.predict(-1e-9) == Status::kTimeBackwards);
  CHECK(filter.predict(1e200) == Status::kStepTooLong);
  CHECK(filter.update(Vector<double, 2>(nan, 0), sonar).status == Status::kNotFinite);
  CHECK(filter.update(Vector<double, 2>(1, inf), sonar).status == Status::kNotFinite);
  CHECK(filter.update(Vector<double, 2>(1e308, 0), sonar).status == Status::kOverflow);
  auvest::RangeBearing<double, 6>::Params broken;
  broken.sigma_range_m = nan;
  const auto refused =
      filter.update(Vector<double, 2>(10, 0.3), auvest::RangeBearing<double, 6>(broken));
  CHECK(refused.status == Status::kNotPositiveDefinite);
  CHECK(refused.nis == 0);
  CHECK(same_belief(filter, before));

  CHECK(filter.reset(Vector<double, 6>::Constant(nan), Matrix<double, 6, 6>::Identity()) ==
        Status::kNotFinite);
  CHECK(filter.reset(Vector<double, 6>::Zero(), Matrix<double, 6, 6>::Zero()) ==
        Status::kNotPositiveDefinite);
  Matrix<double, 6, 6> indefinite = Matrix<double, 6, 6>::Identity();
  indefinite(1, 0) = indefinite(0, 1) = 1.5;
  CHECK(filter.reset(Vector<double, 6>::Zero(), indefinite) == Status::kNotPositiveDefinite);
  CHECK(same_belief(filter, before));
}

TEST_CASE("filters: an input is taken over by a prediction that is not refused, and only then") {
  using Slave = auvest::Ekf<auvest::SpeedHeading<double>>;
  using Input = Vector<double, 3>;
  Slave filter{auvest::SpeedHeading<double>()};
  const Input first(1, 0.5, 0.1);
  const Input second(2, -0.5, 0.3);
  CHECK(filter.predict(1, first) == Status::kNotInitialised);
  CHECK(filter.process().input.isZero());
  REQUIRE(filter.reset(Vector<double, 2>(0, 0), Matrix<double, 2, 2>::Identity()) == Status::kOk);
  REQUIRE(filter.predict(1, first) == Status::kOk);
  CHECK(filter.process().input == first);
  CHECK(filter.predict(-1, second) == Status::kTimeBackwards);
  CHECK(filter.predict(std::nan(""), second) == Status::kNotFinite);
  CHECK(filter.predict(1, Input(1e308, 1e308, 0.7)) == Status::kOverflow);
  CHECK(filter.predict(1, Input(1, std::nan(""), 0)) == Status::kNotFinite);
  CHECK(filter.process().input == first);
  const auto before = filter;
  REQUIRE(filter.predict(0, second) == Status::kOk);  // no time passes: nothing moves
  CHECK(same_belief(filter, before));
  CHECK(filter.process().input == second);
}

TEST_CASE("UKF: without a belief nothing happens") {
  Tracker<double> filter{auvest::ExactAcceleration<double>()};
  CHECK(filter.predict(1) == Status::kNotInitialised);
  CHECK(filter.update(Vector<double, 2>(1, 0), auvest::RangeBearing<double, 6>()).status ==
        Status::kNotInitialised);
  CHECK_FALSE(filter.initialised());
}

TEST_CASE("UKF: parameters out of range are reported") {
  const auto status = [](double alpha, double beta, double kappa) {
    Tracker<double>::Params params;
    params.alpha = alpha;
    params.beta = beta;
    params.kappa = kappa;
    return Tracker<double>(auvest::ExactAcceleration<double>(), params).check();
  };
  CHECK(status(1e-6, 2, -3) == Status::kOk);
  CHECK(status(0, 2, -3) == Status::kBadParameter);
  CHECK(status(1.1, 2, -3) == Status::kBadParameter);
  CHECK(status(std::nan(""), 2, -3) == Status::kBadParameter);
  CHECK(status(1, 0.5, -3) == Status::kBadParameter);
  CHECK(status(1, 2, -6) == Status::kBadParameter);
  CHECK(status(1, 2, std::nan("")) == Status::kBadParameter);
  CHECK(status(1, HUGE_VAL, -3) == Status::kBadParameter);
  CHECK(status(1, 2, HUGE_VAL) == Status::kBadParameter);
  CHECK(status(1, 1, -3) == Status::kOk);  // beta = alpha^2: no weight of the mean's square

  // reset refuses what check() refuses, in the process too.
  Tracker<double>::Params params;
  params.alpha = 5;
  Tracker<double> filter(auvest::ExactAcceleration<double>(), params);
  CHECK(filter.reset(Vector<double, 6>::Zero(), Matrix<double, 6, 6>::Identity()) ==
        Status::kBadParameter);
  auvest::AccelerationNoise<double> noise;
  noise.position = -1;
  auvest::Ekf<auvest::ExactAcceleration<double>> ekf{auvest::ExactAcceleration<double>(noise)};
  CHECK(ekf.reset(Vector<double, 6>::Zero(), Matrix<double, 6, 6>::Identity()) ==
        Status::kBadParameter);
}

/// A process with a NaN where only a look at the whole triangle finds it.
struct BrokenProcess : auvest::ProcessModel<BrokenProcess, double, 2> {
  State f(const State& x, double) const { return x; }
  Covariance Phi(const State&, double) const { return Covariance::Identity(); }
  Covariance Q(double) const {
    Covariance q = Covariance::Identity();
    q(1, 0) = std::nan("");
    return q;
  }
};

TEST_CASE("a process that gives NaN is refused, the belief kept") {
  auvest::Ekf<BrokenProcess> ekf{BrokenProcess()};
  auvest::Ukf<BrokenProcess> ukf{BrokenProcess()};  // kappa = 3 - n is the default
  const Vector<double, 2> x(1, 2);
  REQUIRE(ekf.reset(x, Matrix<double, 2, 2>::Identity()) == Status::kOk);
  REQUIRE(ukf.reset(x, Matrix<double, 2, 2>::Identity()) == Status::kOk);
  CHECK(ekf.predict(1) == Status::kOverflow);
  CHECK(ukf.predict(1) == Status::kOverflow);
  CHECK(ekf.P() == Matrix<double, 2, 2>::Identity());
  CHECK(ukf.P() == Matrix<double, 2, 2>::Identity());
}

// ---- a nonlinear process: the generic prediction
// -------------------------------------------------

/// x' = x + dt (y^2 / 2), y' = y.
struct Quadratic : auvest::ProcessModel<Quadratic, double, 2> {
  State f(const State& x, double dt) const { return State(x(0) + dt * 0.5 * x(1) * x(1), x(1)); }
  Covariance Phi(const State& x, double dt) const {
    Covariance phi;
    phi << 1, dt * x(1), 0, 1;
    return phi;
  }
  Covariance Q(double dt) const { return 0.1 * dt * Covariance::Identity(); }
};

TEST_CASE("UKF: mean and covariance through a quadratic process, in closed form") {
  // y ~ N(y0, s^2) independent of x ~ N(x0, p), dt = 2: E x' = x0 + (y0^2 + s^2),
  // var x' = p + 4 y0^2 s^2 + 2 s^4, cov(x', y') = 2 y0 s^2. The transform with n + kappa = 3,
  // alpha = 1 and beta = 2 gives sum s s' = c s^4 and (beta - 1) m m' = s^4: var = p + 4 y0^2 s^2 +
  // 4 s^4.
  const double x0 = 1, y0 = 3, p = 0.5, s2 = 0.2;
  auvest::Ukf<Quadratic> filter{Quadratic()};
  Matrix<double, 2, 2> P;
  P << p, 0, 0, s2;
  REQUIRE(filter.reset(Vector<double, 2>(x0, y0), P) == Status::kOk);
  REQUIRE(filter.predict(2) == Status::kOk);
  CHECK(filter.x()(0) == close_to(x0 + y0 * y0 + s2, 1e-12));
  CHECK(filter.x()(1) == close_to(y0, 1e-12));
  CHECK(filter.P()(0, 0) == close_to(p + 4 * y0 * y0 * s2 + 4 * s2 * s2 + 0.2, 1e-12));
  CHECK(filter.P()(1, 0) == close_to(2 * y0 * s2, 1e-12));
  CHECK(filter.P()(1, 1) == close_to(s2 + 0.2, 1e-12));

  // The EKF takes the tangent at the old state: no s^2 in the mean, no s^4 in the variance.
  auvest::Ekf<Quadratic> ekf{Quadratic()};
  REQUIRE(ekf.reset(Vector<double, 2>(x0, y0), P) == Status::kOk);
  REQUIRE(ekf.predict(2) == Status::kOk);
  CHECK(ekf.x()(0) == close_to(x0 + y0 * y0, 1e-12));
  CHECK(ekf.P()(0, 0) == close_to(p + 4 * y0 * y0 * s2 + 0.2, 1e-12));
}

/// A heading that f wraps.
struct Heading : auvest::ProcessModel<Heading, double, 1> {
  State f(const State& x, double dt) const { return State(auvest::math::wrap(x(0) + dt)); }
  State residual(const State& a, const State& b) const {
    return State(auvest::math::wrap(a(0) - b(0)));
  }
  Covariance Q(double) const { return Covariance(0.01); }
};

TEST_CASE("UKF: a wrapped state keeps its variance across +-pi") {
  auvest::Ukf<Heading> filter{Heading()};
  REQUIRE(filter.reset(Vector<double, 1>(3.0), Matrix<double, 1, 1>(0.04)) == Status::kOk);
  REQUIRE(filter.predict(0.14) == Status::kOk);  // to 3.14; sigma points on both sides of pi
  CHECK(filter.P()(0, 0) == close_to(0.05, 1e-12));
  CHECK(filter.x()(0) == close_to(3.14, 1e-12));
}

TEST_CASE("UKF: restore goes on with the same bits") {
  auto filter = tracker<float>(1e-6, 10, 5, 1);
  const auvest::RangeBearing<float, 6> sonar;
  for (int k = 0; k < 10; ++k) {
    REQUIRE(filter.predict(0.5f) == Status::kOk);
    REQUIRE(filter.update(Vector<float, 2>(10.0f, 0.3f), sonar).status == Status::kOk);
  }
  Tracker<float> other = tracker<float>(1e-6, 0, 0, 3);
  REQUIRE(other.restore(filter.belief()) == Status::kOk);
  CHECK(same_belief(filter, other));
  filter.predict(0.5f);
  other.predict(0.5f);
  CHECK(same_belief(filter, other));
  auto bad = filter.belief();
  bad.P(2, 2) = -1;
  CHECK(other.restore(bad) == Status::kNotPositiveDefinite);
  bad.P(2, 2) = std::nanf("");
  CHECK(other.restore(bad) == Status::kNotFinite);
  bad = filter.belief();
  bad.P(1, 0) = 10 * bad.P(0, 0) + 10 * bad.P(1, 1);  // correlation far above 1
  CHECK(other.restore(bad) == Status::kNotPositiveDefinite);
}

// ---- at and around the station -----------------------------------------------------------------

template <class Scalar>
double smallest_eigenvalue(const Matrix<Scalar, 6, 6>& p) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(p.template cast<double>())
      .eigenvalues()(0);
}

/// Follows a target that moves through `position(k)` for `steps` steps of 0.5 s.
template <class Scalar, class Position>
void check_survives(Tracker<Scalar> filter, Position position, int steps, double final_error_m) {
  const auvest::RangeBearing<Scalar, 6> sonar;
  auvest::math::Random random(17);
  double ex = 0, ey = 0;
  for (int k = 0; k < steps; ++k) {
    double truth[2] = {0, 0};
    position(k, truth);
    double v_r = 0, v_b = 0;
    random.normal_pair(v_r, v_b);
    const double dx = truth[0] - 0.2, dy = truth[1] - 2;
    Vector<Scalar, 2> z;
    z(0) = Scalar(std::abs(std::hypot(dx, dy) + 0.05 * v_r));
    z(1) = Scalar(auvest::math::wrap(std::atan2(dy, dx) + 0.01 * v_b));
    REQUIRE(filter.predict(Scalar(0.5)) == Status::kOk);
    REQUIRE(filter.update(z, sonar).status == Status::kOk);
    REQUIRE(smallest_eigenvalue(filter.P()) > 0);
    ex = double(filter.x()(0)) - truth[0];
    ey = double(filter.x()(1)) - truth[1];
    REQUIRE(std::isfinite(ex + ey));
  }
  CHECK(std::hypot(ex, ey) < final_error_m);
}

struct Leaving {  // from the station along (1, 2), 0.224 m/s: Table 1
  void operator()(int k, double (&p)[2]) const {
    p[0] = 0.2 + 0.05 * k;
    p[1] = 2 + 0.1 * k;
  }
};
struct Straddling {  // to and fro over the station, 1e-7 m aside at every passage
  void operator()(int k, double (&p)[2]) const {
    p[0] = 0.2 + 2 * std::sin(0.05 * k);
    p[1] = 2 + 1e-7;
  }
};
struct Standing {  // nearer than 1e-6 m for ever
  void operator()(int, double (&p)[2]) const {
    p[0] = 0.2 + 3e-7;
    p[1] = 2 - 4e-7;
  }
};
struct CrossingPi {  // a circle of 20 m: the bearing jumps by 2 pi once a turn
  void operator()(int k, double (&p)[2]) const {
    p[0] = 0.2 + 20 * std::cos(0.02 * k);
    p[1] = 2 + 20 * std::sin(0.02 * k);
  }
};

// Bounds: five standard deviations of one fix (0.05 m and 0.01 rad times the final range of
// 22, 1.1, 0 and 20 m), which a filter that has the track again cannot exceed, and one that lost it
// does.
TEST_CASE_TEMPLATE("UKF: start on the station, straddle it, stand on it, cross +-pi", Scalar, float,
                   double) {
  for (const double alpha : {1.0, 1e-3, 1e-6}) {
    check_survives(tracker<Scalar>(alpha, 0.2, 2, 0.01), Leaving(), 200, 1.1);
    check_survives(tracker<Scalar>(alpha, 0.2, 2, 1), Straddling(), 500, 0.26);
    check_survives(tracker<Scalar>(alpha, 0.2, 2, 1e-6), Standing(), 500, 0.25);
    check_survives(tracker<Scalar>(alpha, 20.2, 2, 1), CrossingPi(), 700, 1.0);
  }
}

TEST_CASE("the float filter object fits the chip") {
  // Process 12 B, x 24, P 144, flag 4, sigma points 24.
  CHECK(sizeof(Tracker<float>) <= 216);
}

}  // namespace
